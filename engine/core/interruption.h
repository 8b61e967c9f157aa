// Ends long work from inside, between two calls of its progress callback.
#pragma once

#include <cstdint>
#include <functional>

namespace halflight {

/// During its lifetime, interruption_point() calls `check` on this thread. `check` throws to end the work. The objects
/// of a thread may be nested; only the innermost one is asked.
class Interruptible {
  public:
    explicit Interruptible(std::function<void()> check);
    Interruptible(const Interruptible&) = delete;
    Interruptible& operator=(const Interruptible&) = delete;
    ~Interruptible();

  private:
    std::function<void()> check_;
    const Interruptible* outer_;
    friend void interruption_point();
};

/// Marks a place where the caller's work may end. Batches of rays, passes of the denoiser, and loops that wait for
/// files or for the device call it. In a sample, all calls come before the pass that adds to the sums, because
/// checkpoints save the sums as those of whole samples. Throws what the check of the thread's Interruptible throws.
void interruption_point();

/// Returns the number of interruption points at which work of this thread has ended. A function that catches an
/// exception can tell by it whether that is an interruption.
std::uint64_t interruptions();

}  // namespace halflight
