#include "api/sequence/near_frames.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/motion.h"

namespace halflight {
namespace {

/// Returns the frames that the denoiser uses for a frame, itself included.
std::vector<FrameNumber> frames_near(FrameNumber frame, int reach) {
    std::vector<FrameNumber> frames;
    for (FrameNumber n = frame - reach; n <= frame + reach; ++n)
        if (n >= kLeastFrame && n <= kMostFrame) frames.push_back(n);
    return frames;
}

/// Returns the scene at a frame; none if it cannot be posed. Such a frame fails alone and is no neighbour.
std::optional<Scene> pose_of(LoadedScene& scene, FrameNumber frame) {
    try {
        return scene.posed(scene.time_of(frame));
    } catch (const BudgetError&) {
        throw;
    } catch (const Error&) {
        return std::nullopt;
    }
}

/// Returns, per material that emits, how many triangles of instances have it.
std::vector<std::size_t> emitters(const Scene& scene) {
    std::vector<std::size_t> shown(scene.meshes.size()), triangles(scene.materials.size());
    for (const Instance& instance : scene.instances) ++shown[static_cast<std::size_t>(instance.mesh)];
    for (std::size_t mesh = 0; mesh < shown.size(); ++mesh) {
        if (shown[mesh] == 0) continue;
        for (const std::uint32_t material : scene.meshes[mesh].triangle_material)
            if (has_emission(scene.materials[material])) triangles[material] += shown[mesh];
    }
    return triangles;
}

/// Returns whether lights and materials emit alike in two poses. If they do not, the light of one frame is wrong in the
/// other, however well its surfaces match.
bool emit_alike(const Scene& a, const Scene& b) {
    constexpr float kMost = 0.002f;  // relative difference that is too small to be seen
    const auto alike = [](const vec3& x, const vec3& y) {
        return glm::all(glm::lessThanEqual(glm::abs(x - y), kMost * glm::max(glm::abs(x), glm::abs(y))));
    };
    const auto same_lamp = [&](const PunctualLight& x, const PunctualLight& y) {
        return alike(x.intensity, y.intensity) &&
               alike(vec3(x.inner_cone, x.outer_cone, 0), vec3(y.inner_cone, y.outer_cone, 0));
    };
    return std::ranges::equal(a.lights, b.lights, same_lamp) &&
           std::ranges::equal(a.materials, b.materials, alike, &Material::emission, &Material::emission) &&
           (std::ranges::equal(a.instances, b.instances, {}, &Instance::mesh, &Instance::mesh) ||
            emitters(a) == emitters(b));
}

/// Waits a moment for frames of other processes.
void wait_for_others() {
    interruption_point();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

}  // namespace

NoisyPicture NearFrames::noisy(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                               const ProgressCallback& progress) {
    NoisyPicture made{.result = {}, .noisy = std::make_unique<NoisyFrame>()};
    made.result = steps.render(frame, *made.noisy, progress);
    if (made.result.stats.interrupted) return made;
    const Camera own = steps.camera(frame);
    for (const FrameNumber other : frames_near(frame, reach)) {
        if (other == frame) continue;
        Stopwatch clock;
        std::optional<PreviousSurfaces> surfaces;
        if (scene.surfaces_move()) {
            std::optional<Scene> there = pose_of(scene, other);
            // A frame without motion to another one does not use it.
            if (!there || !emit_alike(scene.scene(), *there) || !scene.same_environment(frame, other)) continue;
            surfaces.emplace(scene.scene(), std::move(*there));
        }
        made.noisy->add_motion(static_cast<int>(other - frame), own, steps.camera(other),
                               surfaces ? &*surfaces : nullptr);
        load_seconds_ += clock.lap();
    }
    made.noisy->finish();
    return made;
}

bool NearFrames::hold(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                      const ProgressCallback& progress) {
    NoisyPicture made = noisy(scene, frame, reach, steps, progress);
    ++rendered_;
    if (made.result.stats.interrupted) {
        stopped_ = std::move(made.result);
        return false;
    }
    if (steps.files) steps.files->describe(frame, made);
    held_.emplace(frame, Held{std::move(made)});
    return true;
}

NearFrames::Obtained NearFrames::obtain(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                                        const ProgressCallback& progress) {
    if (held_.contains(frame)) return Obtained::yes;
    NoisyFiles* const files = steps.files;
    const auto take_file = [&] {
        std::optional<NoisyPicture> read = files->read(frame);
        if (read) held_.emplace(frame, Held{std::move(*read), true});
        return read.has_value();
    };
    if (!files) return hold(scene, frame, reach, steps, progress) ? Obtained::yes : Obtained::no;
    if (take_file()) return Obtained::yes;
    if (!files->claim(frame)) return Obtained::elsewhere;
    struct Release {
        NoisyFiles& files;
        ~Release() { files.release(); }
    } const release{*files};
    if (take_file()) return Obtained::yes;  // another process has written it before the claim
    if (!hold(scene, frame, reach, steps, progress)) return Obtained::no;
    for (auto& [n, held] : held_) {  // other processes may have come since frames were rendered
        if (held.in_file || held.result().beauty.pixels.empty() || !files->writes()) continue;
        files->write(n, held.picture);
        held.in_file = true;
    }
    return Obtained::yes;
}

RenderResult NearFrames::render(LoadedScene& scene, FrameNumber frame, int reach, const Steps& steps,
                                const ProgressCallback& progress) {
    load_seconds_ = 0;
    rendered_ = 0;
    std::vector<FrameNumber> frames = frames_near(frame, reach);
    if (choice_ != scene.choice_revision()) held_.clear();
    choice_ = scene.choice_revision();
    std::erase_if(held_, [&](auto& h) {
        const bool near = std::ranges::find(frames, h.first) != frames.end();
        return !near || (h.first == frame && h.second.picture.result.beauty.pixels.empty());
    });
    const auto missing = static_cast<int>(frames.size() - held_.size());
    const auto of_all = [&](RenderProgress p) {
        if (steps.denoise) {
            p.samples_done += rendered_ * p.samples_total;
            p.samples_total *= missing;
        }
        p.picture = {};
        return !progress || progress(p);
    };
    // The frame itself comes first: it knows its neighbours, and a stopped picture is of this frame.
    std::vector<FrameNumber> waiting{frame};
    bool interrupted = false, knows = false;
    while (!waiting.empty() && !interrupted) {
        std::vector<FrameNumber> elsewhere;
        for (const FrameNumber n : waiting) {
            const Obtained obtained = obtain(scene, n, reach, steps, of_all);
            if (obtained == Obtained::elsewhere) elsewhere.push_back(n);
            interrupted = obtained == Obtained::no;
            if (interrupted) break;
        }
        if (interrupted && !knows) return std::move(stopped_);
        if (elsewhere.size() == waiting.size() && !interrupted) wait_for_others();
        waiting = std::move(elsewhere);
        if (!knows && waiting.empty()) {
            knows = true;
            for (const FrameNumber n : frames)
                if (n != frame && held_.at(frame).noisy().motion(static_cast<int>(n - frame)) &&
                    (steps.denoise || (steps.files && !steps.files->listed(n))))
                    waiting.push_back(n);
        }
    }
    Held& own = held_.at(frame);
    std::vector<NearFrame> others;
    for (auto& [n, h] : held_)
        if (const auto offset = static_cast<int>(n - frame); n != frame && own.noisy().motion(offset))
            others.push_back({offset, &h.noisy()});
    RenderResult result = std::exchange(own.result(), {});
    if (steps.denoise) steps.denoise(own.noisy(), others, result);
    if (!steps.denoise) held_.clear(), result.stats.neighbours = RenderStats::Neighbours{};
    result.stats.interrupted = interrupted;
    if (result.stats.neighbours) result.stats.neighbours->rendered = rendered_;
    return result;
}

}  // namespace halflight
