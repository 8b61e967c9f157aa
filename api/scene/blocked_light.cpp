#include "api/scene/blocked_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "api/first_picture/default_camera.h"

namespace halflight {
namespace {

constexpr std::size_t kMostLights = 64, kMostCameras = 4;
constexpr int kSide = 12;                // points along each side of a picture
constexpr double kLeastShare = 0.1;      // share of a light's points from which on it counts as hidden
constexpr std::size_t kLeastHidden = 2;  // points that glass hides from a light

std::string called(const char* what, const std::string& name, std::size_t index) {
    return name.empty() ? fmt::format("{} {}", what, index) : fmt::format("{} '{}'", what, name);
}

/// Returns the surfaces that cameras see.
std::vector<rays::ProbeHit> seen_by(const rays::SceneProbe& probe, const std::vector<Camera>& cameras) {
    std::vector<rays::ProbeHit> seen;
    for (std::size_t view = 0; view < std::min(cameras.size(), kMostCameras); ++view)
        for (int cell = 0; cell < kSide * kSide; ++cell) {
            const Camera& camera = cameras[view];
            const auto [origin, direction] = camera_ray(camera, camera.aspect > 0 ? camera.aspect : kUsualAspect,
                                                        (cell % kSide + 0.5) / kSide, (cell / kSide + 0.5) / kSide);
            if (const auto hit = probe.see(origin, direction)) seen.push_back(*hit);
        }
    return seen;
}

/// Returns the first glass between a surface and a light on its side. Sets `open` if there is nothing. Returns null
/// in this case, and if something opaque is in between.
const Material* glass_before(const rays::SceneProbe& probe, const PunctualLight& light, const rays::ProbeHit& at,
                             bool& open) {
    dvec3 direction = -dvec3(light.direction);
    double distance = rays::SceneProbe::kFar;
    if (light.type != LightType::directional) {
        const dvec3 to = light.position - at.position;
        distance = glm::length(to);
        direction = to / std::max(distance, 1e-30);
    }
    if (light.type == LightType::spot &&
        -glm::dot(direction, dvec3(light.direction)) < std::cos(double(light.outer_cone)))
        return nullptr;
    if (rays::sine_of(light, distance) > rays::kLargeSine || glm::dot(at.normal, direction) <= 0) return nullptr;
    const dvec3 from = at.position + probe.spacing() * at.normal;
    const double most = (1 - 1e-4) * distance - 2 * probe.spacing();
    const auto hit = probe.trace(from, direction, most, rays::kPassPanes | rays::kPassScattered);
    open = !hit;
    if (!hit || !rays::hides_points(*hit->material)) return nullptr;
    return probe.trace(from, direction, most, rays::kPassClear | rays::kPassScattered) ? nullptr : hit->material;
}

}  // namespace

std::vector<std::string> blocked_lights(const rays::LazyProbe& probe, const Scene& scene,
                                        const std::vector<Camera>& cameras) {
    std::vector<std::string> lines;
    if (scene.lights.empty() || std::ranges::none_of(scene.materials, rays::hides_points)) return lines;
    const std::vector<rays::ProbeHit> seen =
        seen_by(probe.get(), cameras.empty() ? std::vector{default_camera(probe.get(), kUsualAspect).camera} : cameras);
    for (std::size_t i = 0; i < std::min(scene.lights.size(), kMostLights); ++i) {
        const PunctualLight& light = scene.lights[i];
        if (light.intensity == vec3(0) || light.links.blockers != LightLinks().blockers) continue;
        std::map<const Material*, std::size_t> hidden;  // points behind glass
        std::size_t behind = 0, open = 0;
        for (const rays::ProbeHit& at : seen) {
            bool is_open = false;
            if (const Material* glass = glass_before(probe.get(), light, at, is_open)) ++hidden[glass], ++behind;
            open += is_open;
        }
        const double share = double(behind) / double(open + behind);
        if (behind < kLeastHidden || share < kLeastShare) continue;
        const Material& glass = *std::ranges::max_element(hidden, {}, [](const auto& h) { return h.second; })->first;
        const auto material = static_cast<std::size_t>(&glass - scene.materials.data());
        const std::string kind = is_solid(glass) ? "solid" : fmt::format("of roughness {:g}", glass.roughness);
        Material straight = glass;
        straight.straight_shadows = true;
        lines.push_back(fmt::format(
            "{}: glass, {}{}, which is {}, is before {:.0f} % of the visible surfaces that the light reaches: {} is "
            "found"
            " there, because light of little size passes thin clear glass alone (thickness 0, roughness below 0.01){}",
            called("light", light.name, i), called("material", glass.name, material),
            hidden.size() > 1 ? " and others" : "", kind, 100 * share,
            light.radius > 0 || light.angle > 0 ? "its light, in speckles that are rare and bright,"
                                                : "hardly any of its light",
            is_pane(straight) ? "; --glass-shadows straight lets it through panes and bulbs, without bending it" : ""));
    }
    return lines;
}

}  // namespace halflight
