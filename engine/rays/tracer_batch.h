// State that a tracer keeps for each batch: its method and its statistics.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/context.h"
#include "engine/rays/batch_statistics.h"
#include "engine/rays/choice.h"
#include "engine/rays/tracer.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/tile_list.h"

namespace halflight::rays {

/// Statistics of a batch and the method of its next run.
class Tracer::Batch {
  public:
    /// Starts with the first of `methods`, for at least `first_runs` runs. `measures` tells whether all runs are timed,
    /// or only those on trial.
    Batch(std::string name, std::vector<TraceMethod> methods, std::uint64_t first_runs, std::string reason,
          bool measures)
        : methods_(std::move(methods)), choice_(names_of(methods_), first_runs), measures_(measures) {
        statistics_.batch = std::move(name);
        statistics_.method = methods_.front();
        statistics_.reason = methods_.size() > 1 ? choice_.reason() : std::move(reason);
    }

    TraceMethod method() const { return statistics_.method; }
    /// Returns the method of the last run.
    std::optional<TraceMethod> ran() const { return ran_; }
    bool measuring() const { return measures_ || choice_.on_trial(); }
    const gpu::Buffer& culled() {
        if (!culled_) culled_.emplace("tiles culled", sizeof(std::uint32_t));
        return *culled_;
    }
    void set_state_bytes(std::size_t bytes) { statistics_.state_bytes = bytes; }

    using Step = double BatchStatistics::Seconds::*;
    void begin() { seconds_ = 0; }
    void add(Step step, double seconds) {
        seconds_ += seconds;
        if (method() == TraceMethod::tiles) statistics_.steps.*step += seconds;
    }
    /// Records the end of a run over `tiles` tiles.
    void end(std::uint64_t tiles) {
        BatchStatistics::Measured& m = of(method());
        ++m.runs;
        if (measuring()) {
            m.best = m.timed == 0 ? seconds_ : std::min(m.best, seconds_);
            ++m.timed;
            m.seconds += seconds_;
        }
        ran_ = method();
        statistics_.tiles += tiles;
        if (methods_.size() < 2) return;
        choice_.ran(seconds_);
        statistics_.method = methods_[choice_.now()];
        statistics_.reason = choice_.reason();
    }

    /// Starts and stops the clock of a batch that has one method and no steps.
    void start() { watch_.emplace(); }
    void stop() {
        seconds_ = watch_->seconds();
        end(0);
    }
    /// Adds the counts of the last run.
    void count(const shared::BatchCounts& counts, const shared::RestHeader& rest) {
        of(*ran_).rays += counts.rays;
        if (ran_ != TraceMethod::tiles) return;
        BatchStatistics::Lists& l = statistics_.lists;
        l.tiles += counts.tiles;
        l.entries += counts.entries;
        l.leaves += counts.leaves;
        l.longest = std::max(l.longest, std::uint64_t{counts.longest});
        l.rays += counts.rays;
        l.rest_rays += rest.list.count;
        l.remembered += rest.remembered;
    }

    BatchStatistics statistics() const {
        BatchStatistics s = statistics_;
        if (culled_) s.tiles_culled = culled_->read<std::uint32_t>().front();
        return s;
    }

    void reset_statistics() {
        for (BatchStatistics::Measured& m : statistics_.measured) m = {};
        statistics_.steps = {};
        statistics_.tiles = 0;
        statistics_.lists = {};
        if (culled_) culled_->clear();
    }

    /// Discards the results of earlier trials.
    void forget() {
        if (methods_.size() < 2) return;
        choice_.forget();
        statistics_.method = methods_[choice_.now()];
        statistics_.reason = choice_.reason();
    }

  private:
    static std::vector<std::string> names_of(const std::vector<TraceMethod>& methods) {
        std::vector<std::string> names;
        for (const TraceMethod method : methods) names.emplace_back(name(method));
        return names;
    }
    BatchStatistics::Measured& of(TraceMethod method) { return statistics_.measured[static_cast<std::size_t>(method)]; }

    std::vector<TraceMethod> methods_;  // candidates; the first one serves the first runs
    Choice choice_;
    bool measures_;
    BatchStatistics statistics_;
    std::optional<TraceMethod> ran_;
    double seconds_ = 0;
    std::optional<gpu::Stopwatch> watch_;
    std::optional<gpu::Buffer> culled_;  // number of tiles whose lists were made anew; made by the first run of tiles
};

}  // namespace halflight::rays
