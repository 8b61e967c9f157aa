// Samples of listed blocks, which adaptive sampling adds to a band.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
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
        : from_(from),
          taken_(std::move(from)),
          first_halves_(from_.size()),
          wanted_(std::move(to)),
          sample_of_(std::move(sample_of)) {
        const std::uint32_t most = wanted_.empty() ? 0 : *std::ranges::max_element(wanted_);
        for (std::uint32_t number = most > 0 ? *std::ranges::min_element(from_) : 0; number < most; ++number)
            by_time_[time_of(sample_of_(number))].push_back(number);
        time_ = by_time_.begin();
        begin_block();
        skip_finished();
    }

    bool done() const { return time_ == by_time_.end(); }
    /// Returns SampleView::at and seed of the samples of the next run.
    double at() const { return time_->first.first; }
    std::uint32_t seed() const { return time_->first.second; }
    /// Returns the number of samples that each block has after the runs so far.
    const std::vector<std::uint32_t>& taken() const { return taken_; }
    /// Returns the number of samples in the first half that each block got in the runs so far.
    const std::vector<std::uint32_t>& first_halves() const { return first_halves_; }
    /// Returns the number of samples that are left.
    std::uint64_t left() const {
        return std::accumulate(wanted_.begin(), wanted_.end(), std::uint64_t{0}) -
               std::accumulate(taken_.begin(), taken_.end(), std::uint64_t{0});
    }

    /// Returns the blocks of the next run, whose samples have the same time and seed; blocks that are left over are
    /// kNoBlock.
    std::vector<shared::SampledBlock> next_run() {
        std::vector<shared::SampledBlock> run(wanted_.size(), shared::SampledBlock{shared::kNoBlock, 0, vec2(0)});
        const auto time = time_;
        for (shared::SampledBlock& entry : run) {
            if (time_ != time) break;
            const SampleView sample = sample_of_(time_->second[next_++]);
            ++taken_[block_];
            first_halves_[block_] += sample.first_half ? 1 : 0;
            const std::uint32_t half = sample.first_half ? shared::kInFirstHalf : 0;
            entry = {static_cast<std::uint32_t>(block_), sample.sample | half, sample.jitter};
            skip_finished();
        }
        return run;
    }

  private:
    using Time = std::pair<double, std::uint32_t>;  // SampleView::at and seed
    static Time time_of(const SampleView& sample) { return {sample.at, sample.seed}; }

    /// Goes on to the next sample: of the block, of the blocks after it, or of the next time.
    void skip_finished() {
        for (; !done(); ++time_, block_ = 0, begin_block()) {
            const std::vector<std::uint32_t>& numbers = time_->second;
            for (; block_ < wanted_.size(); ++block_, begin_block())
                if (next_ < numbers.size() && numbers[next_] < wanted_[block_]) return;
        }
    }
    /// Goes to the first sample of the block at this time.
    void begin_block() {
        if (done() || block_ == wanted_.size()) return;
        next_ = std::size_t(std::ranges::lower_bound(time_->second, from_[block_]) - time_->second.begin());
    }

    std::vector<std::uint32_t> from_, taken_, first_halves_, wanted_;
    SampleOf sample_of_;
    std::map<Time, std::vector<std::uint32_t>> by_time_;  // numbers of samples, rising
    std::map<Time, std::vector<std::uint32_t>>::const_iterator time_;
    std::size_t block_ = 0, next_ = 0;  // the next sample: its block, and its place among those of the time
};

}  // namespace halflight
