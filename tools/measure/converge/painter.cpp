#include "tools/measure/converge/painter.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/core/image_tools.h"
#include "renderer/hand_over.h"

namespace halflight::converge {
namespace {

constexpr int kManySamples = 1 << 24;  // number of samples, more than any budget of seconds allows

/// Returns the culling of a method of the GL renderer.
rays::Culling culling_of(Method method) {
    switch (method) {
        case Method::compute:
            return rays::Culling::compute;
        case Method::raster:
            return rays::Culling::raster;
        case Method::native:
            return rays::Culling::native;
        default:
            return rays::Culling::off;
    }
}

/// Sets the members that the settings of both renderers share.
template <class Settings>
void set_view(Settings& settings, const View& view) {
    settings.width = view.width;
    settings.height = view.height;
    settings.camera = view.camera;
    settings.bounces = view.bounces;
    settings.filter = view.filter;
}

class GlPainter final : public Painter {
  public:
    GlPainter(PreparedScene& scene, const ColorConfig& colors, const View& view, Method method, float clamp,
              const Technique& technique, int warm_up)
        : scene_(scene), colors_(colors), warm_up_(technique.preview.cache ? warm_up : 0) {
        set_view(settings_, view);
        settings_.clamp = clamp;
        settings_.preview = technique.preview;
        settings_.denoise = technique.denoise;
        settings_.aovs.assign(kComponents.begin(), kComponents.end());
        settings_.culling = culling_of(method);
        const CpuStopwatch preparing;
        renderer_.emplace(scene_, colors_, settings_);
        preparation_ = preparing.seconds();
    }

    Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        return render(*renderer_, budget, seed, pulse).first;
    }

    std::vector<PassTime> passes(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        RenderSettings measured = settings_;
        measured.measure = true;
        Renderer renderer(scene_, colors_, measured);
        return render(renderer, budget, seed, pulse).second.passes;
    }

    Seconds preparation() const override { return preparation_; }

  private:
    std::pair<Painted, RenderStats> render(Renderer& renderer, const Budget& budget, std::uint32_t seed,
                                           const Pulse& pulse) {
        FrameSettings frame = settings_;
        frame.samples = budget.seconds > 0 ? kManySamples : budget.samples;
        frame.time_limit = budget.seconds;
        frame.seed = seed;
        renderer.forget("pictures are independent of each other, and so are their times");
        // Only the first samples of a picture fill the cache.
        for (int done = 0; done < warm_up_; done += kCachedSamples) {
            FrameSettings elsewhere = settings_;
            elsewhere.camera = aside(settings_.camera);
            elsewhere.samples = std::min(kCachedSamples, warm_up_ - done);
            elsewhere.seed = seed + kSeedsOfMethods / 2;
            renderer.render(elsewhere);
        }
        std::exception_ptr stopped;
        const CpuStopwatch rendering;
        RenderResult result = renderer.render(frame, [&](const RenderProgress&) {
            try {
                pulse();
            } catch (...) {
                stopped = std::current_exception();
            }
            return !stopped;
        });
        Painted painted;
        painted.time = rendering.seconds();
        if (stopped) std::rethrow_exception(stopped);
        // Compilation runs on one thread.
        painted.time.wall -= result.stats.compile_seconds;
        painted.time.cpu = std::max(painted.time.cpu - result.stats.compile_seconds, 0.0);
        painted.picture.beauty = rgb(result.beauty);
        // Layers hold the mean of the samples, not the components of a picture that is filtered.
        const bool replaced = settings_.denoise || settings_.preview.of_picture();
        for (std::size_t c = 0; c < kComponents.size() && !replaced; ++c)
            painted.picture.components[c] = std::move(result.aovs[c].image);
        painted.picture.samples = result.stats.samples;
        for (const BadValues& bad : result.stats.bad_values) painted.picture.non_finite += bad.total();
        return {std::move(painted), std::move(result.stats)};
    }

    /// Returns the camera moved by a 20th of the scene's diagonal and turned by 20 degrees.
    Camera aside(Camera camera) const {
        const Bounds& box = scene_.tables().bounds;
        const double distance = box.empty() ? 0 : 0.05 * glm::length(dvec3(box.upper - box.lower));
        camera.camera_to_world = glm::rotate(glm::translate(camera.camera_to_world, dvec3(distance, 0, 0)),
                                             glm::radians(20.0), dvec3(0, 1, 0));
        return camera;
    }

    PreparedScene& scene_;
    const ColorConfig& colors_;
    int warm_up_;
    RenderSettings settings_;
    std::optional<Renderer> renderer_;
    Seconds preparation_;
};

class OraclePainter final : public Painter {
  public:
    OraclePainter(const Scene& scene, const View& view) : view_(view) {
        const CpuStopwatch preparing;
        scene_.emplace(scene);
        preparation_ = preparing.seconds();
    }

    /// Renders portions of about a tenth of a second, so that it ends in time and can be stopped.
    Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) override {
        constexpr double kPortion = 0.1;  // time of a portion, seconds
        const CpuStopwatch watch;
        PictureSums sums(view_.width, view_.height);
        std::uint64_t non_finite = 0;
        int portion = 1;
        while (portion > 0) {
            const Picture more = oracle_samples(*scene_, view_, seed, static_cast<int>(sums.samples), portion);
            sums.add(more);
            non_finite += more.non_finite;
            pulse();
            const double spent = watch.seconds().wall, pace = static_cast<double>(sums.samples) / spent;
            const double left = budget.seconds > 0 ? (budget.seconds - spent) * pace
                                                   : static_cast<double>(budget.samples - sums.samples);
            portion = static_cast<int>(std::clamp(left, 0.0, std::max(1.0, kPortion * pace)));
        }
        Painted painted{sums.mean(), watch.seconds()};
        painted.picture.non_finite = non_finite;
        return painted;
    }

    std::vector<PassTime> passes(const Budget&, std::uint32_t, const Pulse&) override { return {}; }
    Seconds preparation() const override { return preparation_; }

  private:
    std::optional<ReferenceScene> scene_;
    View view_;
    Seconds preparation_;
};

}  // namespace

std::unique_ptr<Painter> gl_painter(PreparedScene& scene, const ColorConfig& colors, const View& view, Method method,
                                    float clamp, const Technique& technique, int warm_up) {
    return std::make_unique<GlPainter>(scene, colors, view, method, clamp, technique, warm_up);
}

std::unique_ptr<Painter> oracle_painter(const Scene& scene, const View& view) {
    return std::make_unique<OraclePainter>(scene, view);
}

Picture oracle_samples(const ReferenceScene& scene, const View& view, std::uint64_t seed, int first, int count) {
    ReferenceSettings settings;
    set_view(settings, view);
    settings.seed = seed;
    settings.first_sample = first;
    settings.samples = count;
    ReferenceResult result = render_reference(scene, settings);
    ReferenceComponents& c = result.components;
    return {std::move(result.beauty),
            {std::move(c.emission), std::move(c.direct_diffuse), std::move(c.direct_glossy),
             std::move(c.indirect_diffuse), std::move(c.indirect_glossy)},
            count,
            result.non_finite_samples};
}

}  // namespace halflight::converge
