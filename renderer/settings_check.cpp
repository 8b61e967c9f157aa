#include "renderer/settings_check.h"

#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "renderer/replicates.h"

namespace halflight {
namespace {

void require(bool good, const char* what) {
    if (!good) throw Error("render settings", what);
}

}  // namespace

void check_settings(const FrameSettings& s, const Preview& preview) {
    require(s.samples > 0, "samples must be positive");
    require(s.first_sample >= 0 && s.first_sample <= std::numeric_limits<int>::max() - s.samples,
            "the first sample must not be negative, nor the last one beyond all numbers");
    require(
        s.camera.orthographic ? s.camera.ortho_height > 0 : s.camera.vertical_fov > 0 && s.camera.vertical_fov < kPi,
        "the camera's field of view is not between 0 and 180 degrees, or its height is not positive");
    require(s.filter.radius > 0 && s.filter.radius <= kMaxFilterRadius,
            "the filter's radius must be positive and at most 16 pixels");
    require(s.time_limit >= 0 && std::isfinite(s.time_limit), "the time limit must be zero or positive");
    if (!s.error) return;
    require(s.first_sample == 0, "a picture that is rendered to an error begins with the first sample");
    require(s.error->error > 0 && std::isfinite(s.error->error), "the error must be positive");
    require(s.samples >= kFirstLook * kReplicates, "there must be at least 16 samples to tell an error");
    require(!preview.any(), "the error of a picture in a preview mode is not known");
}

void check_settings(const RenderSettings& s) {
    require(s.width > 0 && s.height > 0, "width and height must be positive");
    require(s.width <= 65536 && s.height <= 65536, "width and height must be at most 65536");
    require(s.bounces >= 0, "bounces must not be negative");
    require(s.clamp >= 0 && std::isfinite(s.clamp), "the clamp must be positive, or zero for none");
    check_settings(s, s.preview);
    for (const std::string& name : s.aovs) {
        if (find_aov(name)) continue;
        std::string names;
        for (const AovInfo& a : known_aovs()) names += (names.empty() ? "" : ", ") + std::string(a.name);
        throw Error("render settings", "unknown AOV \"{}\"; there are: {}", name, names);
    }
}

}  // namespace halflight
