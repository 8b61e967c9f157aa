#include "api/near_frames.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/motion.h"

namespace halflight {
namespace {

/// Returns the frames that the denoiser uses for a frame, itself included.
std::vector<std::uint32_t> frames_near(std::uint32_t frame, std::int64_t reach) {
    std::vector<std::uint32_t> frames;
    for (std::int64_t n = frame - reach; n <= frame + reach; ++n)
        if (n >= 0 && n <= std::numeric_limits<std::uint32_t>::max()) frames.push_back(static_cast<std::uint32_t>(n));
    return frames;
}

/// Returns the scene at a frame; none where it cannot be posed. Such a frame fails alone and is no neighbour.
std::optional<Scene> pose_of(LoadedScene& scene, std::uint32_t frame) {
    try {
        return scene.posed(scene.time_of(frame));
    } catch (const BudgetError&) {
        throw;
    } catch (const Error&) {
        return std::nullopt;
    }
}

}  // namespace

NearFrames::Held NearFrames::noisy(LoadedScene& scene, std::uint32_t frame, std::span<const std::uint32_t> frames,
                                   const Steps& steps, const ProgressCallback& progress) {
    Held made{{}, std::make_unique<NoisyFrame>()};
    made.result = steps.render(frame, *made.noisy, progress);
    if (made.result.stats.interrupted) return made;
    const Camera own = steps.camera(frame);
    for (const std::uint32_t other : frames) {
        if (other == frame) continue;
        Stopwatch clock;
        std::optional<PreviousSurfaces> surfaces;
        if (scene.surfaces_move()) {
            std::optional<Scene> there = pose_of(scene, other);
            if (!there) continue;
            surfaces.emplace(scene.scene(), std::move(*there));
        }
        const auto offset = static_cast<int>(std::int64_t{other} - frame);
        made.noisy->add_motion(offset, own, steps.camera(other), surfaces ? &*surfaces : nullptr);
        load_seconds_ += clock.lap();
    }
    made.noisy->finish();
    return made;
}

RenderResult NearFrames::render(LoadedScene& scene, std::uint32_t frame, int reach, const Steps& steps,
                                const ProgressCallback& progress) {
    load_seconds_ = 0;
    std::vector<std::uint32_t> frames = frames_near(frame, reach);
    if (choice_ != scene.choice_revision()) held_.clear();
    choice_ = scene.choice_revision();
    std::erase_if(held_, [&](const auto& h) {
        const bool near = std::ranges::find(frames, h.first) != frames.end();
        return !near || (h.first == frame && h.second.result.beauty.pixels.empty());
    });
    const auto missing = static_cast<int>(frames.size() - held_.size());
    int rendered = 0;
    bool interrupted = false;
    // The frame itself comes first, so that a stopped picture is of this frame.
    std::stable_partition(frames.begin(), frames.end(), [&](std::uint32_t n) { return n == frame; });
    for (const std::uint32_t n : frames) {
        if (held_.contains(n)) continue;
        const auto of_all = [&](RenderProgress p) {
            p.samples_done += rendered * p.samples_total;
            p.samples_total *= missing;
            p.picture = {};
            return !progress || progress(p);
        };
        if (n != frame && scene.surfaces_move() && !pose_of(scene, n)) continue;
        Held made = noisy(scene, n, frames_near(n, reach), steps, of_all);
        interrupted = made.result.stats.interrupted;
        if (interrupted && n == frame) return std::move(made.result);
        if (interrupted) break;
        held_.emplace(n, std::move(made));
        ++rendered;
    }
    std::vector<NearFrame> others;
    for (auto& [n, h] : held_)
        if (n != frame) others.push_back({static_cast<int>(std::int64_t{n} - frame), h.noisy.get()});
    Held& own = held_.at(frame);
    RenderResult result = std::move(own.result);
    own.result = {};
    steps.denoise(*own.noisy, others, result);
    result.stats.interrupted = interrupted;
    if (result.stats.neighbours) result.stats.neighbours->rendered = rendered;
    return result;
}

}  // namespace halflight
