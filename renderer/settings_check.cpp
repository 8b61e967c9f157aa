#include "renderer/settings_check.h"

#include <algorithm>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "engine/settings/layers.h"
#include "engine/settings/settings_table.h"
#include "passes/picture/adaptive.h"
#include "renderer/film.h"
#include "renderer/needs.h"
#include "renderer/replicates.h"

namespace halflight {
namespace {

void require(bool good, const char* what) {
    if (!good) throw Error("render settings", what);
}

}  // namespace

void check_settings(const RenderSettings& s, bool checkpoint) {
    check_setting_ranges(s);
    for (const std::string& layer : s.aovs)  // names of groups, such as "all", are not accepted
        if (!find_aov(layer)) throw Error("render settings", "unknown AOV \"{}\"", layer);
    if (const std::string problem = kept_problem(s.kept); !problem.empty()) throw Error("render settings", problem);
    require(s.first_sample >= 0 && s.first_sample <= std::numeric_limits<int>::max() - s.samples,
            "the first sample must be at least 0, and the last one must be a 32-bit number");
    require(
        s.camera.orthographic ? s.camera.ortho_height > 0 : s.camera.vertical_fov > 0 && s.camera.vertical_fov < kPi,
        "the camera's field of view must be between 0 and 180 degrees, or its height positive");
    if (const std::string problem = lens_problem(s.camera); !problem.empty()) throw Error("lens", problem);
    if (const std::string problem = optics_problem(s.camera); !problem.empty()) throw Error("render settings", problem);
    if (const std::string side = odd_side(s.camera.optics, {s.width, s.height}); !side.empty())
        throw Error("render settings", "stereo {} needs an even {}, that of both eyes together",
                    name(s.camera.optics.stereo), side);
    require(s.camera.optics.stereo != Stereo::views || !has_window(s),
            "crop and overscan cannot be combined with stereo views, which share their pixels");
    require(!s.previous_camera || s.previous_camera->optics == s.camera.optics,
            "the previous camera needs the projection and eyes of the camera, between which there is no motion");
    require(!s.camera.optics.traced() || !s.preview.temporal,
            "the preview mode temporal needs the projection of the camera itself, without stereo");
    require(
        !s.camera.lens.blurs() || !s.preview.temporal,
        "the preview mode temporal cannot be combined with depth of field: blurred surfaces have no single place in "
        "the last frame");
    if (s.parts > 1) {
        require(s.part > 0 || s.parts <= s.samples, "there are more parts than samples");
        require(!s.error && !s.adaptive && !(s.time_limit > 0) && !s.in_turns,
                "parts of samples cannot be combined with an error target, a time limit, adaptive sampling, or samples "
                "of bands in turns");
        require(!s.preview.any(), "parts of samples cannot be combined with a preview mode");
        require(s.part > 0 || !checkpoint, "a picture that renders all parts of its samples keeps no checkpoint");
    }
    if (has_window(s)) {
        const PixelWindow window = rendered_window(s, s.camera.optics);
        require(std::max(window.size().x, window.size().y) <= kMaxSide, "crop and overscan make the picture too large");
        require(!s.preview.any(), "crop and overscan cannot be combined with a preview mode");
        require(neighbour_frames(s) == 0,
                "crop and overscan cannot be combined with denoising over frames, which needs the whole picture");
    }
    require(light_group_layers(s).empty() || !s.preview.cache,
            "light groups cannot be combined with the preview mode cache, which holds the light of all lights together "
            "(--preview none)");
    require(!s.denoise || !s.preview.any(), "denoising cannot be combined with a preview mode");
    require(s.denoise_error == 0 || s.denoise, "an estimate for the denoised picture needs denoising");
    require(s.denoise_error == 0 || !s.adaptive || s.denoise_error >= kLeastAdaptiveSamples,
            "an estimate for the denoised picture takes at least 16 samples where sampling is adaptive");
    if (s.adaptive) {
        require(s.samples >= kLeastAdaptiveSamples, "adaptive sampling takes at least 16 samples");
        require(s.first_sample == 0, "a picture with adaptive sampling must begin with the first sample");
        require(s.error || !(s.time_limit > 0), "adaptive sampling takes a time limit only with an error target");
        require(!s.preview.any(), "adaptive sampling cannot be combined with a preview mode");
        require(s.estimator.sampler == SamplePoints::sobol, "adaptive sampling needs the sampler sobol");
    }
    require(
        !checkpoint || !((s.error && s.adaptive) || s.in_turns || s.preview.cache || s.preview.temporal),
        "checkpoints cannot be combined with adaptive sampling up to an error target, samples of bands in turns, or "
        "the preview modes cache and temporal");
    if (!s.error) return;
    require(s.first_sample == 0, "a picture with an error target must begin with the first sample");
    require(s.samples >= kFirstLook * kReplicates, "an error target takes at least 16 samples");
    require(!s.preview.any(), "an error target cannot be combined with a preview mode");
}

void check_settings(const RenderSettings& settings, const FrameSettings& frame, bool checkpoint) {
    RenderSettings all = settings;
    static_cast<FrameSettings&>(all) = frame;
    check_settings(all, checkpoint);
}

std::string kept_problem(const Kept& kept) {
    if (kept.names().empty()) return "";
    const std::vector<std::string> known = keepable_names();
    for (const std::string& name : kept.names())
        if (std::ranges::find(known, name) == known.end())
            return fmt::format("cannot keep '{}'; `halflight info SCENE --needs` lists the names without a *{}", name,
                               did_you_mean(name, known));
    return "";
}

}  // namespace halflight
