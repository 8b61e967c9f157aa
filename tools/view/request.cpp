#include "tools/view/request.h"

#include <algorithm>
#include <string_view>
#include <tuple>

#include "engine/settings/layers.h"

namespace halflight::view {
namespace {

constexpr std::string_view kMotion = "motion";

}  // namespace

bool same(const Camera& a, const Camera& b) {
    const auto members = [](const Camera& c) {
        return std::tie(c.name, c.camera_to_world, c.orthographic, c.vertical_fov, c.ortho_height, c.aspect,
                        c.near_plane, c.far_plane, c.lens);
    };
    return members(a) == members(b);
}

bool Request::operator==(const Request& o) const {
    const auto members = [](const Request& r) {
        return std::tie(r.reference, r.scene, r.edits, r.frame, r.size, r.region, r.bounces, r.aovs, r.modes, r.culling,
                        r.measure);
    };
    return same(camera, o.camera) && members(*this) == members(o);
}

bool serves(const Request& made, const Request& wanted) {
    Request other = wanted;
    other.aovs = made.aovs, other.region = made.region;
    return other == made;
}

std::vector<std::string> sampled_aovs() {
    std::vector<std::string> aovs;
    for (const AovInfo& aov : known_aovs())
        if (!aov.is_matte()) aovs.emplace_back(aov.name);
    return aovs;
}

std::vector<std::string> complete_aovs() {
    std::vector<std::string> aovs;
    for (const AovInfo& aov : known_aovs())
        if (!aov.is_matte() && !aov.debug() && aov.name != kMotion) aovs.emplace_back(aov.name);
    return aovs;
}

bool wants_motion(const Request& request) {
    return std::ranges::find(request.aovs, kMotion) != request.aovs.end();
}

std::vector<std::string> mattes_of(const std::vector<std::string>& aovs) {
    std::vector<std::string> mattes;
    for (const std::string& name : aovs)
        if (const AovInfo* aov = find_aov(name); aov && aov->is_matte()) mattes.push_back(name);
    return mattes;
}

}  // namespace halflight::view
