#include <algorithm>
#include <cmath>
#include <utility>

#include "api/first_picture/default_camera.h"
#include "api/first_picture/default_light.h"
#include "api/halflight/loaded_scene.h"
#include "engine/io/environment.h"
#include "engine/scene/framing.h"
#include "engine/scene/material_lobes.h"

namespace halflight {
namespace {

/// Returns a light whose name no light of the scene has, since edits by name go on to mean the light of the file.
PunctualLight with_own_name(const Scene& scene, PunctualLight light, const char* prefix = "added ") {
    while (std::ranges::find(scene.lights, light.name, &PunctualLight::name) != scene.lights.end())
        light.name.insert(0, prefix);
    return light;
}

/// Returns the mean radiance of an environment over the sphere, luminance.
double mean_radiance(const Environment& environment) {
    const auto color = double(luminance(environment.color));
    const Image& map = environment.map;
    if (map.width == 0) return color;
    double sum = 0, weights = 0;
    for (int y = 0; y < map.height; ++y) {
        const double weight = std::sin(kPi * (y + 0.5) / map.height);
        for (int x = 0; x < map.width; ++x)
            sum += weight * double(luminance(vec3(map.at(x, y)[0], map.at(x, y)[1], map.at(x, y)[2])));
        weights += weight * map.width;
    }
    return color * sum / weights;
}

/// Adds a sky or lamps if the cameras see little (default_light()).
void add_light(Scene& scene, const Log& log, const AddedLight& added) {
    const bool lit = has_light(scene), dark = scene.environment.black();
    const auto add_sky = [&](const char* reason) {
        scene.environment = preset_sky(SkyPreset::neutral, added.azimuth).environment;
        log.note("{}: a neutral sky is added (--env replaces it; --env none prevents it)", reason);
    };
    if (!dark && !added.lamps) return;
    if (scene.paged_bounds || scene.instances.empty()) {
        if (!lit && dark) add_sky("the scene has no light");
        return;
    }
    const WorldBounds bounds = world_bounds(scene);
    const auto within = [&](const Camera& camera) {
        const dvec3 at(camera.camera_to_world[3]);
        return glm::all(glm::greaterThan(at, bounds.lower)) && glm::all(glm::lessThan(at, bounds.upper));
    };
    const rays::LazyProbe own(scene);
    const rays::LazyProbe& probe = added.probe ? *added.probe : own;
    std::vector<Camera> cameras = scene.cameras;
    if (added.camera) cameras.push_back(*added.camera);
    if (cameras.empty()) cameras = {default_camera(probe.get(), kUsualAspect).camera};
    // Cameras outside see surfaces that the environment lights, unless they look through back faces.
    if (!dark && std::ranges::none_of(cameras, within) && std::ranges::none_of(scene.materials, is_one_sided)) return;
    // A free camera may get lamps. Otherwise it has the light of the file's cameras, so that equal views are equal.
    const double radiance = mean_radiance(scene.environment);
    DefaultLight light;
    if (added.camera) light = default_light(probe.get(), {*added.camera}, radiance);
    if (light.lamps.empty() && (!added.camera || !scene.cameras.empty()))
        light = default_light(probe.get(), scene.cameras.empty() ? cameras : scene.cameras, radiance);
    const char* const reason = dark && !lit ? "the scene has no light" : "the cameras see little by the scene's light";
    if (added.lamps && !light.lamps.empty()) {
        log.note(
            "{}, and hardly any sky can enter: {} lamps are added in what its cameras see (--no-lamps prevents it)",
            reason, light.lamps.size());
        for (PunctualLight& lamp : light.lamps) scene.lights.push_back(with_own_name(scene, std::move(lamp)));
        return;
    }
    if (light.closed && light.lamps.empty())
        log.note("{}, and neither sky nor lamps reach what the cameras see (--hide removes shells around it)", reason);
    if (dark && (light.sky || !lit)) add_sky(reason);
}

}  // namespace

void set_environment(Scene& scene, const EnvironmentChoice& choice, const Log& log, const AddedLight& added) {
    std::erase_if(scene.lights, &PunctualLight::of_environment);
    const auto take = [&](Sky sky) {
        scene.environment = std::move(sky.environment);
        if (!sky.sun) return;
        scene.lights.push_back(with_own_name(scene, *sky.sun, "sky "));
    };
    if (const auto* color = std::get_if<vec3>(&choice)) {
        scene.environment = {"constant", *color, {}};
        if (scene.environment.black() && !has_light(scene))
            log.note("the scene has no light, so its surfaces are black");
    } else if (const auto* preset = std::get_if<SkyPreset>(&choice)) {
        take(preset_sky(*preset, added.azimuth));
    } else if (const auto* clear = std::get_if<ClearSky>(&choice)) {
        take(clear_sky(*clear));
    } else if (const auto* file = std::get_if<std::filesystem::path>(&choice)) {
        const std::size_t warned = scene.report.warnings.size();
        // A map has 12 bytes per texel, and as many in its table and in the buffers of both.
        ExrLimits limits;
        if (const std::uint64_t most = MemoryLedger::process().free() / 4; most < limits.max_bytes) {
            limits.max_bytes = most;
            limits.reason = ", a quarter of what the memory budget has left (--memory)";
        }
        scene.environment = load_environment(*file, scene.report, limits);
        for (std::size_t i = warned; i < scene.report.warnings.size(); ++i) log.warn("{}", scene.report.warnings[i]);
    }
    const bool none = std::holds_alternative<vec3>(choice) && scene.environment.black();
    if (none || added.lit_elsewhere) return;
    const std::vector<Material> unedited = scene.materials;
    if (added.straight_glass) edit_materials({.straight_glass = true}, scene);
    add_light(scene, log, added);
    scene.materials = unedited;
}

}  // namespace halflight
