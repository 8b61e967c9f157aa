// Samples in flight: the CPU reads the results of a sample while the device works on the next one.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "engine/gpu/buffer.h"
#include "passes/picture/bad_values.h"
#include "renderer/cryptomatte.h"

namespace halflight {

/// Keeps at most kInFlight samples on the device, so that memory stays bounded and callers learn of progress after
/// every sample. Counts bad values on the device and reads them when they are wanted.
class SampleQueue {
  public:
    static constexpr std::size_t kInFlight = 2;

    /// paths: number of paths of a band.
    explicit SampleQueue(std::size_t paths);
    SampleQueue(const SampleQueue&) = delete;
    SampleQueue& operator=(const SampleQueue&) = delete;
    ~SampleQueue();

    /// Returns the buffer in which the kernels of all samples count bad values.
    gpu::Buffer& bad_values() { return bad_values_; }

    /// Ends the commands of a sample, then waits for the oldest sample if kInFlight are in flight. The hits of the
    /// sample's camera rays, one for each path, are copied and later added to `mattes`; null: there are none. Throws
    /// Error if waiting fails.
    void push(const gpu::Buffer* hits, Mattes* mattes);
    /// Waits for all samples; their hits are then in the mattes.
    void wait();
    /// Waits for all samples and reads their bad values, which are then in counted().
    void drain();
    /// Forgets all samples and counts, before another picture.
    void reset();
    const BadValueSums& counted() const { return counted_; }
    /// Sets the bad values of all samples so far, before further samples of a picture.
    void set_counted(std::span<const std::uint64_t, kBadValueCounts> sums) { counted_.set(sums); }

  private:
    struct Slot {
        GLsync fence = nullptr;  // signalled at the end of the sample; null: no sample
        Mattes* mattes = nullptr;
        std::optional<gpu::Buffer> hits;
    };
    void retire(Slot& slot);
    void read_bad_values();

    std::array<Slot, kInFlight> slots_;
    std::size_t next_ = 0;  // slot of the next sample; the oldest sample is in it, or in one of the following
    gpu::Buffer bad_values_{"bad values", kBadValueCounts * sizeof(std::uint32_t)};
    BadValueSums counted_;
    std::size_t hits_bytes_;        // size of a sample's hits, bytes; the graph's buffer may be larger
    std::uint64_t uncounted_ = 0;   // number of samples whose bad values are in the buffer
    std::uint64_t most_uncounted_;  // maximum number of samples whose counts cannot overflow 32 bits
};

}  // namespace halflight
