#include "renderer/sample_plan.h"

#include <algorithm>

#include "passes/picture/adaptive.h"
#include "renderer/hand_over.h"
#include "renderer/replicates.h"
#include "shaders/shared/pixel_order.h"

namespace halflight {

std::vector<std::size_t> blocks_in_picture(const Band& where) {
    std::vector<std::size_t> blocks;
    const uvec2 tiles = where.tiles();
    for (std::uint32_t path = 0; path < where.paths(); path += 256) {
        const uvec2 pixel = shared::pixel_of_path(path, tiles) + uvec2(0, static_cast<std::uint32_t>(where.y));
        blocks.push_back(std::size_t{pixel.y / 16} * tiles.x + pixel.x / 16);
    }
    return blocks;
}

SamplePlan plan_of(const RenderSettings& settings, const FrameSettings& frame, bool cache, bool saved) {
    // Samples of all pixels before the time of an adaptive picture counts. They tell little of its pace.
    constexpr int kLeastOfTimed = 4;
    const bool error = frame.error.has_value(), by_noise = settings.adaptive, timed = frame.time_limit > 0;
    SamplePlan plan{.samples = frame.samples, .most = frame.samples, .first_look = frame.samples};
    plan.parts = frame.part == 0 ? std::max(frame.parts, 1) : 1;
    const bool in_turns = settings.in_turns && !error && !by_noise && plan.parts == 1 && !saved;
    if (error) {
        plan.sequences = kReplicates;
        plan.most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
        plan.first_look = kFirstLook;
    } else if (by_noise && timed) {
        plan.first_look = std::min(kLeastOfTimed, frame.samples);
    } else if (in_turns || timed) {
        plan.one_by_one = true, plan.first_look = 1;
    }
    if (cache) plan.cached = kCachedSamples;
    if (by_noise) plan.least = error ? kFirstLook : timed ? kLeastOfTimed : least_samples(frame.samples);
    plan.grows = by_noise && (error || timed);
    plan.together = in_turns || plan.grows;
    plan.by_time = !by_noise && !plan.one_by_one;
    return plan;
}

SampleView view_of(const SamplePlan& plan, const FrameSettings& frame, const Band& where, int sequence, int index,
                   SamplePoints points) {
    if (plan.sequences > 1) return replicate_view(frame, where, sequence, index, points);
    return sample_view(frame, where, static_cast<std::uint32_t>(frame.first_sample + index), points);
}

}  // namespace halflight
