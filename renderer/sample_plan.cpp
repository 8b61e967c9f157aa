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

SamplePlan plan_of(const RenderSettings& settings, const FrameSettings& frame, bool cache, bool merged) {
    const bool error = frame.error.has_value(), by_noise = settings.adaptive;
    const bool in_turns = settings.in_turns && !error && !by_noise;
    SamplePlan plan{.samples = frame.samples, .most = frame.samples, .first_look = frame.samples};
    if (error) {
        plan.sequences = kReplicates;
        plan.most = std::min(frame.samples / kReplicates, kMostReplicateSamples);
        plan.first_look = kFirstLook;
    } else if (in_turns || frame.time_limit > 0) {
        plan.one_by_one = true, plan.first_look = 1;
    } else if (frame.parts > 1 && frame.part == 0 && !merged) {
        plan.parts = frame.parts, plan.first_look = settings_of_part(frame, 1).samples;
    }
    if (cache) plan.cached = kCachedSamples;
    if (by_noise) plan.least = error ? kFirstLook : least_samples(frame.samples);
    plan.together = in_turns || (error && by_noise);
    plan.by_time = !by_noise && !plan.one_by_one;
    return plan;
}

SampleView view_of(const SamplePlan& plan, const FrameSettings& frame, const Band& where, int sequence, int index,
                   SamplePoints points) {
    if (plan.sequences > 1) return replicate_view(frame, where, sequence, index, points);
    const int first = plan.parts > 1 ? 0 : frame.first_sample;  // parts count from the first sample of all
    return sample_view(frame, where, static_cast<std::uint32_t>(first + index), points);
}

}  // namespace halflight
