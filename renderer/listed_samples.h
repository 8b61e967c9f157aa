// Samples of listed blocks, which adaptive sampling adds to a band.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "renderer/frame_constants.h"
#include "shaders/shared/sampled_block.h"

namespace halflight {

/// The samples of listed blocks, a run at a time. Blocks come in the order of their paths, so that the samples of one
/// block follow each other.
class ListedSamples {
  public:
    /// Returns the sample with this number in a sequence; numbers are < 2^31.
    using SampleOf = std::function<SampleView(std::uint32_t number)>;

    /// from, to: number of samples of each block, in the order of paths, before and after all runs; from <= to.
    ListedSamples(std::vector<std::uint32_t> from, std::vector<std::uint32_t> to, SampleOf sample_of)
        : taken_(std::move(from)), wanted_(std::move(to)), sample_of_(std::move(sample_of)) {
        skip_finished();
    }

    bool done() const { return block_ == wanted_.size(); }
    /// Returns the number of samples that each block has after the runs so far.
    const std::vector<std::uint32_t>& taken() const { return taken_; }
    /// Returns the number of samples that are left.
    std::uint64_t left() const {
        return std::accumulate(wanted_.begin(), wanted_.end(), std::uint64_t{0}) -
               std::accumulate(taken_.begin(), taken_.end(), std::uint64_t{0});
    }

    /// Returns the blocks of the next run; blocks that are left over are kNoBlock.
    std::vector<shared::SampledBlock> next_run() {
        std::vector<shared::SampledBlock> run(wanted_.size(), shared::SampledBlock{shared::kNoBlock, 0, vec2(0)});
        for (shared::SampledBlock& entry : run) {
            if (done()) break;
            const SampleView sample = sample_of_(taken_[block_]++);
            const std::uint32_t half = sample.first_half ? shared::kInFirstHalf : 0;
            entry = {static_cast<std::uint32_t>(block_), sample.sample | half, sample.jitter};
            skip_finished();
        }
        return run;
    }

  private:
    void skip_finished() {
        while (!done() && taken_[block_] == wanted_[block_]) ++block_;
    }

    std::vector<std::uint32_t> taken_, wanted_;
    SampleOf sample_of_;
    std::size_t block_ = 0;  // block of the next sample
};

}  // namespace halflight
