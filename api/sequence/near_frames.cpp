#include "api/sequence/near_frames.h"

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

/// Returns the scene at a frame; none if it cannot be posed. Such a frame fails alone and is no neighbour.
std::optional<Scene> pose_of(LoadedScene& scene, std::uint32_t frame) {
    try {
        return scene.posed(scene.time_of(frame));
    } catch (const BudgetError&) {
        throw;
    } catch (const Error&) {
        return std::nullopt;
    }
}

/// Returns whether lights and materials emit alike in two poses. If they do not, the light of one frame is wrong in the
/// other, however well its surfaces match.
bool emit_alike(const Scene& a, const Scene& b) {
    constexpr float kMost = 0.002f;  // relative difference that is too small to be seen
    const auto alike = [](const vec3& x, const vec3& y) {
        return glm::all(glm::lessThanEqual(glm::abs(x - y), kMost * glm::max(glm::abs(x), glm::abs(y))));
    };
    // LoadedScene::posed() has no lights of the environment, which does not change.
    const auto of_file = [](const Scene& scene) {
        std::vector<PunctualLight> lights = scene.lights;
        std::erase_if(lights, &PunctualLight::of_environment);
        return lights;
    };
    const auto same_lamp = [&](const PunctualLight& x, const PunctualLight& y) {
        return alike(x.intensity, y.intensity) &&
               alike(vec3(x.inner_cone, x.outer_cone, 0), vec3(y.inner_cone, y.outer_cone, 0));
    };
    return std::ranges::equal(of_file(a), of_file(b), same_lamp) &&
           std::ranges::equal(a.materials, b.materials, alike, &Material::emission, &Material::emission);
}

}  // namespace

NearFrames::Held NearFrames::noisy(LoadedScene& scene, std::uint32_t frame, std::span<const std::uint32_t> frames,
                                   const Steps& steps, const ProgressCallback& progress) {
    Held made{.result = {}, .noisy = std::make_unique<NoisyFrame>()};
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
            if (!emit_alike(scene.scene(), *there)) {
                made.lit_otherwise.insert(other);
                continue;
            }
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
        if (n != frame && held_.at(frame).lit_otherwise.contains(n)) continue;  // it emits otherwise
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
    Held& own = held_.at(frame);
    for (auto& [n, h] : held_)
        if (n != frame && !own.lit_otherwise.contains(n))
            others.push_back({static_cast<int>(std::int64_t{n} - frame), h.noisy.get()});
    RenderResult result = std::move(own.result);
    own.result = {};
    steps.denoise(*own.noisy, others, result);
    result.stats.interrupted = interrupted;
    if (result.stats.neighbours) result.stats.neighbours->rendered = rendered;
    return result;
}

}  // namespace halflight
