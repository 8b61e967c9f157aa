#include "renderer/pilot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/statistics.h"
#include "engine/core/stopwatch.h"

namespace halflight {
namespace {

/// Returns the time of a sample with these techniques relative to one without. The factors approximate what `halflight
/// converge` measures with scenes/ on llvmpipe (docs/measuring.md).
double cost(const Estimator& e) {
    const double group = static_cast<double>(e.reuse);
    const double reuse = e.reuse == Reuse::off ? 0 : 0.15 + 0.04 * group;
    return 1 + reuse + 0.06 * (static_cast<double>(e.camera) - 1) + 0.08 * (static_cast<double>(e.shadow) - 1);
}

/// Returns the error with n samples from the known errors with one sample and with `tried` samples.
double shared_and_own(double with_one, double with_tried, double tried, double n) {
    // The sample's own error is clamped, since well distributed samples converge faster than 1/n.
    const double own = std::clamp((with_one - with_tried) / (1 - 1 / tried), 0.0, with_one);
    return with_one - own * (1 - 1 / n);
}

double power_law(double with_one, double with_tried, double tried, double n) {
    if (!(with_one > 0)) return 0;
    constexpr double kLeast = 1e-3;  // minimum ratio, since the estimate of so few pictures may be 0
    return with_one * std::pow(std::clamp(with_tried / with_one, kLeast, 1.0), std::log(n) / std::log(tried));
}

double error(const Estimator& asked, const Estimator& e, const PilotFigures& f) {
    constexpr auto number = [](auto rays) { return static_cast<double>(rays); };
    double sum = 0;
    sum += asked.camera != CameraRays::automatic
               ? f.plain.emission
               : power_law(f.plain.emission, f.tried.emission, number(kTried.camera), number(e.camera));
    sum += asked.shadow != ShadowRays::automatic
               ? f.plain.direct
               : shared_and_own(f.plain.direct, f.tried.direct, number(kTried.shadow), number(e.shadow));
    sum += asked.reuse != Reuse::automatic
               ? f.plain.indirect
               : shared_and_own(f.plain.indirect, f.tried.indirect, number(kTried.reuse), number(e.reuse));
    return sum;
}

/// Returns `asked` with its open choices replaced by those of `open`.
Estimator filled(Estimator asked, const Estimator& open) {
    if (asked.reuse == Reuse::automatic) asked.reuse = open.reuse;
    if (asked.camera == CameraRays::automatic) asked.camera = open.camera;
    if (asked.shadow == ShadowRays::automatic) asked.shadow = open.shadow;
    return asked;
}

/// Returns all combinations of values for the open choices.
std::vector<Estimator> choices(const Estimator& asked) {
    std::vector<Estimator> all;
    for (const Reuse reuse : kReuses)
        for (const CameraRays camera : kCameraRays)
            for (const ShadowRays shadow : kShadowRays) {
                const Estimator e = filled(asked, {.reuse = reuse, .camera = camera, .shadow = shadow});
                if (leaves_open(e) || std::ranges::find(all, e) != all.end()) continue;
                all.push_back(e);
            }
    return all;
}

RenderSettings pilot_settings(const RenderSettings& of) {
    const double pixels = double(of.width) * double(of.height);
    const double scale = std::min(1.0, std::sqrt(std::max(kPilotPixels / pixels, kPilotShare)));
    const auto scaled = [&](int size) {
        const int blocks = std::max(static_cast<int>(std::lround(size * scale / 16)), 1);
        return std::min(16 * blocks, size);
    };
    RenderSettings s;
    s.camera = of.camera;
    s.samples = kPilotSamples;
    s.filter = of.filter;
    s.width = scaled(of.width);
    s.height = scaled(of.height);
    s.bounces = of.bounces;
    s.clamp = of.clamp;
    s.culling = rays::Culling::off;
    s.primary = of.primary;
    s.show_lamps = of.show_lamps;
    s.backfaces = of.backfaces;
    s.kept = of.kept;
    s.frame = -1;  // frame number of hardly any picture, so that no sample is shared
    return s;
}

struct Cancelled {};

/// Reports the progress of the pilot, to which each of its pictures contributes equally.
class Progress {
  public:
    explicit Progress(const PilotProgress& callback) : callback_(callback) {}

    /// Reports a sample of the current picture. Throws Cancelled if the callback cancels.
    void sample(const RenderProgress& picture) const {
        constexpr double kPictures = 2 * (kPilotPictures + kPilotEmissionPictures);
        const double share = double(picture.samples_done) / std::max(picture.samples_total, 1);
        if (callback_ && !callback_(std::min((pictures_ + share) / kPictures, 1.0))) throw Cancelled();
    }
    void end_picture() { ++pictures_; }

  private:
    const PilotProgress& callback_;
    int pictures_ = 0;  // done
};

/// Returns the variance of each sum of layers over `pictures` pictures, averaged over pixels and channels.
std::vector<double> variances(PreparedScene& scene, const ColorConfig& colors, RenderSettings settings, int pictures,
                              const std::vector<std::vector<std::string>>& sums, Progress& progress) {
    for (const std::vector<std::string>& layers : sums)
        settings.aovs.insert(settings.aovs.end(), layers.begin(), layers.end());
    settings.pictures = pictures;
    Renderer renderer(scene, colors, settings);
    const std::size_t values = std::size_t(settings.width) * std::size_t(settings.height) * 3;
    std::vector<std::vector<RunningMoments>> moments(sums.size(), std::vector<RunningMoments>(values));
    for (int picture = 0; picture < pictures; ++picture) {
        settings.seed = static_cast<std::uint32_t>(picture);
        const RenderResult r = renderer.render(settings, [&](const RenderProgress& p) {
            progress.sample(p);
            return true;
        });
        progress.end_picture();
        auto layer = r.aovs.begin();
        for (std::size_t s = 0; s < sums.size(); ++s) {
            std::vector<double> sum(values);
            for (std::size_t l = 0; l < sums[s].size(); ++l, ++layer)
                for (std::size_t v = 0; v < values; ++v) sum[v] += double(layer->image.pixels[v]);
            for (std::size_t v = 0; v < values; ++v) moments[s][v].add(sum[v]);
        }
    }
    std::vector<double> means;
    for (const std::vector<RunningMoments>& of_sum : moments) {
        double all = 0;
        for (const RunningMoments& m : of_sum) all += m.variance();
        means.push_back(all / double(values));
    }
    return means;
}

PilotErrors measure(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                    Progress& progress) {
    const std::vector<double> reflected =
        variances(scene, colors, settings, kPilotPictures,
                  {{"direct_diffuse", "direct_glossy"}, {"indirect_diffuse", "indirect_glossy"}}, progress);
    // All pixels share the sample point, so one picture says little about edges. Pictures of emission are cheap.
    RenderSettings seen = settings;
    seen.bounces = 0;
    return {variances(scene, colors, seen, kPilotEmissionPictures, {{"emission"}}, progress)[0], reflected[0],
            reflected[1]};
}

}  // namespace

Estimator settled(const Estimator& asked, const PilotFigures& figures) {
    constexpr double kHardlyBetter = 1.05;
    const auto product = [&](const Estimator& e) { return error(asked, e, figures) * cost(e); };
    const std::vector<Estimator> all = choices(asked);
    Estimator chosen = *std::ranges::min_element(all, {}, product);
    const double least = product(chosen);
    for (const Estimator& e : all)
        if (product(e) <= kHardlyBetter * least && cost(e) < cost(chosen)) chosen = e;
    return chosen;
}

bool find_estimator(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                    const PilotProgress& callback) {
    const Estimator asked = scene.estimator();
    if (!leaves_open(asked)) return true;
    const Stopwatch watch;
    const RenderSettings pilot = pilot_settings(settings);
    PilotFigures figures;
    Progress progress(callback);
    try {
        scene.settle(filled(asked, {}), 0);
        figures.plain = measure(scene, colors, pilot, progress);
        scene.settle(filled(asked, kTried), 0);
        figures.tried = measure(scene, colors, pilot, progress);
    } catch (const Cancelled&) {
        scene.settle(asked, 0);
        return false;
    } catch (...) {
        scene.settle(asked, 0);
        throw;
    }
    // Edges are one-dimensional: the larger a picture, the smaller their share of its pixels.
    const double scale = double(pilot.width) / double(settings.width);
    const double reflected = has_halves(settings) ? kDenoisedError : 1;
    for (PilotErrors* errors : {&figures.plain, &figures.tried}) {
        errors->emission *= scale;
        errors->direct *= reflected;
        errors->indirect *= reflected;
    }
    scene.settle(settled(asked, figures), watch.seconds());
    return true;
}

}  // namespace halflight
