#include "renderer/settings_check.h"

#include <algorithm>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "engine/settings/layers.h"
#include "engine/settings/settings_table.h"
#include "passes/picture/adaptive.h"
#include "renderer/needs.h"
#include "renderer/replicates.h"

namespace halflight {
namespace {

static_assert(kLeastEstimatedSamples == kLeastAdaptiveSamples && kLeastEstimatedSamples == kFirstLook * kReplicates);

void require(bool good, const char* what) {
    if (!good) throw Error("render settings", what);
}

}  // namespace

void check_settings(const RenderSettings& s, const Occasion& occasion) {
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
    require(!s.previous_camera || s.previous_camera->optics == s.camera.optics,
            "the previous camera needs the projection and eyes of the camera, between which there is no motion");
    require(s.parts <= 1 || s.part > 0 || s.parts <= s.samples, "there are more parts than samples");
    if (has_window(s)) {
        const ivec2 size = rendered_window(s, s.camera.optics).size();
        require(std::max(size.x, size.y) <= kMaxSide, "crop and overscan make the picture too large");
    }
    check_constraints(s, occasion);
}

void check_settings(const RenderSettings& settings, const FrameSettings& frame, const Occasion& occasion) {
    RenderSettings all = settings;
    static_cast<FrameSettings&>(all) = frame;
    check_settings(all, occasion);
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
