// Reports the steps of work whose number is unknown in advance, such as programs that are compiled at their first use.
#pragma once

#include <cstddef>
#include <functional>

namespace halflight {

/// During its lifetime, begin_step() calls `begun` on this thread, which may throw to end the work. The objects of a
/// thread may be nested; only the innermost one is called.
class StepWatch {
  public:
    /// what: the kind of step, such as "compiling shaders"; number: 1 for the first step of the watch, whatever its
    /// kind.
    using Begun = std::function<void(const char* what, int number)>;
    /// ended: called by end_step(); null: nothing is.
    explicit StepWatch(Begun begun, std::function<void()> ended = {});
    StepWatch(const StepWatch&) = delete;
    StepWatch& operator=(const StepWatch&) = delete;
    ~StepWatch();

  private:
    Begun begun_;
    std::function<void()> ended_;
    int steps_ = 0;
    StepWatch* outer_;
    friend void begin_step(const char* what);
    friend void end_step();
};

/// Part of the thread's current work, such as a pass of a frame.
struct WorkPart {
    int number = 0;  // number of the part, from 1; 0: the work has no parts
    int count = 0;   // number of all parts
};
/// Returns the current part of the thread's work.
WorkPart current_part();

/// Numbers the parts of work on this thread during its lifetime. The objects of a thread may be nested.
class WorkParts {
  public:
    explicit WorkParts(std::size_t count);
    WorkParts(const WorkParts&) = delete;
    WorkParts& operator=(const WorkParts&) = delete;
    ~WorkParts();
    void begin_next();  ///< Begins the next part.

  private:
    WorkPart outer_;
};

/// Marks the beginning of a step. Throws what the thread's StepWatch throws; does nothing if there is none.
void begin_step(const char* what);
/// Marks the end of the step that was begun last.
void end_step();

}  // namespace halflight
