#include "engine/scene/skies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/scene/atmosphere.h"

namespace halflight {
namespace {

double radians(double degrees) {
    return degrees * kPi / 180;
}

/// Returns the direction of the centre of a texel, as Environment defines it.
dvec3 direction_of(const Image& map, int x, int y) {
    const double phi = 2 * kPi * ((x + 0.5) / map.width - 0.5), theta = kPi * (y + 0.5) / map.height;
    return {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
}

/// Calls f(direction) for all texels of a new map; f returns their radiance.
template <class F>
Image make_map(int width, const F& f) {
    Image map(width, width / 2, 3);
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const vec3 radiance(f(direction_of(map, x, y)));
            for (int c = 0; c < 3; ++c) map.at(x, y)[c] = radiance[c];
        }
    return map;
}

/// Returns the irradiance of a horizontal surface that faces up.
dvec3 horizontal_irradiance(const Image& map) {
    dvec3 sum(0);
    for (int y = 0; y < map.height / 2; ++y) {
        const double from = kPi * y / map.height, to = kPi * (y + 1) / map.height;
        const double projected = 0.5 * (std::pow(std::sin(to), 2) - std::pow(std::sin(from), 2)) * 2 * kPi / map.width;
        for (int x = 0; x < map.width; ++x)
            for (int c = 0; c < 3; ++c) sum[c] += projected * double(map.at(x, y)[c]);
    }
    return sum;
}

/// Interpolates between the light of two directions.
Atmosphere::Light between(const Atmosphere::Light& a, const Atmosphere::Light& b, double t) {
    return {glm::mix(a.rayleigh, b.rayleigh, t), glm::mix(a.aerosol, b.aerosol, t), glm::mix(a.rest, b.rest, t)};
}

double smooth_step(double from, double to, double x) {
    const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// A soft box: a rectangle of directions with soft edges.
struct SoftBox {
    dvec3 centre;        // direction, any length
    double half_width;   // radians
    double half_height;  // radians
    double radiance;
    double softness = 0.08;  // width of the edges, radians
};

/// Returns the sum of `radiance` and the radiances of boxes.
double add_boxes(double radiance, std::span<const SoftBox> boxes, const dvec3& direction) {
    for (const SoftBox& box : boxes) {
        const dvec3 ahead = glm::normalize(box.centre), right = glm::normalize(glm::cross(ahead, dvec3(0, 1, 0)));
        const double z = glm::dot(direction, ahead);
        const double x = std::atan2(glm::dot(direction, right), z);
        const double y = std::atan2(glm::dot(direction, glm::cross(right, ahead)), z);
        const auto inside = [&](double at, double half) {
            return smooth_step(0, 1, (half - std::abs(at)) / box.softness + 0.5);
        };
        radiance += box.radiance * inside(x, box.half_width) * inside(y, box.half_height);
    }
    return radiance;
}

/// Returns grey light of a map, scaled to a horizontal irradiance of pi.
template <class F>
Sky grey_light(int width, const F& f) {
    Sky sky;
    sky.environment.map = make_map(width, [&](const dvec3& direction) { return dvec3(f(direction)); });
    sky.environment.color = vec3(float(kPi / horizontal_irradiance(sky.environment.map).x));
    return sky;
}

Sky studio() {
    constexpr SoftBox kBoxes[] = {
        {{-0.75, 0.75, 0.75}, 0.5, 0.45, 7}, {{1, 0.35, 0.35}, 0.22, 0.6, 3}, {{0.1, 1, -0.9}, 0.9, 0.2, 4}};
    return grey_light(256, [&](const dvec3& direction) {
        return add_boxes(0.12 + 0.13 * std::max(direction.y, 0.0), kBoxes, direction);
    });
}

Sky neutral(double azimuth) {
    /// Returns a direction from two angles in degrees: to the right of the camera as seen from the object, and above
    /// the
    /// horizon.
    const auto at = [](double aside, double elevation) {
        const double a = radians(aside), e = radians(elevation);
        return dvec3(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e));
    };
    const SoftBox boxes[] = {
        {at(-48, 34), radians(36), radians(34), 2.876, radians(34)},  // key: wide and soft, so that noise stays low
        {at(72, 14), radians(8), radians(32), 0.516, radians(16)},    // fill: a strip, which curved metal shows
        {at(140, 40), radians(16), radians(22), 1.150, radians(24)},  // rim: light on the outline of the dark side
        {at(180, 24), radians(50), radians(10), 0.458, radians(16)},  // wall of light, which glass shows
    };
    const double s = std::sin(radians(azimuth)), c = std::cos(radians(azimuth));
    return grey_light(128, [&](const dvec3& direction) {
        const dvec3 seen(c * direction.x - s * direction.z, direction.y, s * direction.x + c * direction.z);
        constexpr double kHorizon = 0.42, kSky = 0.18, kGround = 0.2;
        const double base = direction.y > 0 ? glm::mix(kHorizon, kSky, smooth_step(0, 0.5, direction.y))
                                            : glm::mix(kHorizon, kGround, smooth_step(0, 0.6, -direction.y));
        return add_boxes(base + 0.431 * smooth_step(0.85, 0.98, direction.y), boxes, seen);
    });
}

}  // namespace

Sky clear_sky(const ClearSky& s) {
    const Atmosphere air(s);
    const double elevation = radians(s.elevation), azimuth = radians(std::remainder(s.azimuth, 360));
    const dvec3 sun(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                    -std::cos(azimuth) * std::cos(elevation));
    // Without phase functions, the light of a row changes slowly with the azimuth from the sun. It is therefore
    // computed
    // at nodes and interpolated linearly.
    constexpr int kNodes = 65;
    // Mean luminance of the zenith without moon, 21.6 mag per square arcsecond (Patat 2003, UBVRI Night Sky Brightness
    // during Sunspot Maximum at ESO-Paranal).
    constexpr double kNight = 2.5e-4;
    Sky sky;
    sky.environment = {"clear sky", vec3(1), Image(512, 256, 3)};
    Image& map = sky.environment.map;
    std::array<double, kNodes> azimuths;
    for (int i = 0; i < kNodes; ++i) azimuths[std::size_t(i)] = kPi * i / (kNodes - 1);
    for (int y = 0; y < map.height; ++y) {
        const double height = kPi * (0.5 - (y + 0.5) / map.height);
        const std::vector<Atmosphere::Light> nodes = air.lights(height, azimuths);
        for (int x = 0; x < map.width; ++x) {
            const dvec3 direction = direction_of(map, x, y);
            const double apart = std::abs(std::remainder(std::atan2(direction.x, -direction.z) - azimuth, 2 * kPi));
            const double node = apart / kPi * (kNodes - 1);
            const std::size_t i = std::min(std::size_t(node), std::size_t(kNodes - 2));
            const Atmosphere::Light light = between(nodes[i], nodes[i + 1], node - double(i));
            const dvec3 radiance = Atmosphere::radiance(light, glm::dot(direction, sun)) + (height > 0 ? kNight : 0.0);
            for (int c = 0; c < 3; ++c) map.at(x, y)[c] = float(std::max(radiance[c], 0.0));
        }
    }
    const dvec3 illuminance = glm::max(air.sun_illuminance(), dvec3(0));
    if (illuminance == dvec3(0)) return sky;
    PunctualLight light;
    light.name = "sun";
    light.type = LightType::directional;
    light.intensity = vec3(illuminance);
    light.direction = vec3(-sun);
    light.angle = static_cast<float>(glm::radians(2 * kSunRadius));
    light.of_environment = true;
    sky.sun = light;
    return sky;
}

std::span<const SkyPreset> sky_presets() {
    static constexpr SkyPreset kPresets[] = {SkyPreset::neutral, SkyPreset::studio, SkyPreset::sky,
                                             SkyPreset::overcast};
    return kPresets;
}

const char* name(SkyPreset preset) {
    switch (preset) {
        case SkyPreset::neutral:
            return "neutral";
        case SkyPreset::studio:
            return "studio";
        case SkyPreset::sky:
            return "sky";
        case SkyPreset::overcast:
            return "overcast";
    }
    return "";
}

double view_azimuth(const Camera& camera) {
    const dvec3 up(camera.camera_to_world[1]), back(camera.camera_to_world[2]);
    const dvec3 from = std::hypot(back.x, back.z) > 1e-3 ? back : back.y > 0 ? -up : up;
    return std::round(std::atan2(from.x, from.z) * 180e6 / kPi) / 1e6;
}

Sky preset_sky(SkyPreset preset, double azimuth) {
    Sky sky;
    switch (preset) {
        case SkyPreset::neutral:
            sky = neutral(azimuth);
            break;
        case SkyPreset::studio:
            sky = studio();
            break;
        case SkyPreset::overcast:
            sky.environment = default_sky();
            break;
        case SkyPreset::sky: {
            sky = clear_sky({.elevation = 40, .azimuth = 105});  // 45 degrees to the right of the default camera
            const double sine = -double(sky.sun->direction.y);
            const dvec3 both = horizontal_irradiance(sky.environment.map) + sine * dvec3(sky.sun->intensity);
            const double scale = kPi / double(luminance(vec3(both)));
            sky.environment.color *= float(scale);
            sky.sun->intensity *= float(scale);
        }
    }
    sky.environment.name = name(preset);
    return sky;
}

}  // namespace halflight
