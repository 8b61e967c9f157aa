#include "engine/scene/skies.h"

#include <algorithm>
#include <array>
#include <cmath>

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

/// Perez et al. 1993, as equation 3 of Preetham et al. has it.
struct Perez {
    double a, b, c, d, e;
    double operator()(double cos_theta, double gamma) const {
        return (1 + a * std::exp(b / cos_theta)) * (1 + c * std::exp(d * gamma) + e * std::pow(std::cos(gamma), 2));
    }
};

dvec3 rgb_of_xyY(double x, double y, double luminance) {
    const double big_x = luminance * x / y, big_z = luminance * (1 - x - y) / y;
    // XYZ to linear Rec.709 (IEC 61966-2-1).
    return {3.2406 * big_x - 1.5372 * luminance - 0.4986 * big_z, -0.9689 * big_x + 1.8758 * luminance + 0.0415 * big_z,
            0.0557 * big_x - 0.2040 * luminance + 1.0570 * big_z};
}

/// Returns the illuminance of a surface that faces the sun, lux by channel.
dvec3 sun_illuminance(double zenith_angle, double turbidity) {
    constexpr double kOutside = 128000;                      // lux, outside the atmosphere
    constexpr std::array kWavelengths = {0.65, 0.55, 0.45};  // micrometres
    // Relative optical mass (Kasten 1966, as in the appendix A.1).
    const double degrees = zenith_angle * 180 / kPi;
    const double mass = 1 / (std::max(std::cos(zenith_angle), 0.0) + 0.15 * std::pow(93.885 - degrees, -1.253));
    const double beta = 0.04608 * turbidity - 0.04586;
    dvec3 illuminance;
    for (int c = 0; c < 3; ++c) {
        const double wavelength = kWavelengths[static_cast<std::size_t>(c)];
        const double rayleigh = 0.008735 * std::pow(wavelength, -4.08), aerosol = beta * std::pow(wavelength, -1.3);
        illuminance[c] = kOutside * std::exp(-(rayleigh + aerosol) * mass);
    }
    return illuminance;
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
    /// Returns a direction; degrees to the right of the camera, seen from the object, and above the horizon.
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
    const double t = s.turbidity, elevation = radians(s.elevation), zenith = kPi / 2 - elevation;
    const double azimuth = radians(std::remainder(s.azimuth, 360));
    const dvec3 sun(std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                    -std::cos(azimuth) * std::cos(elevation));
    const Perez luminance{0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771,
                          -0.0670 * t + 0.3703};
    const Perez chroma_x{-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989,
                         -0.0033 * t + 0.0452};
    const Perez chroma_y{-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537,
                         -0.0109 * t + 0.0529};
    const double z1 = zenith, z2 = z1 * z1, z3 = z2 * z1;
    const double zenith_luminance =
        1000 * ((4.0453 * t - 4.9710) * std::tan((4.0 / 9 - t / 120) * (kPi - 2 * zenith)) - 0.2155 * t + 2.4192);
    const double zenith_x = (0.00166 * z3 - 0.00375 * z2 + 0.00209 * z1) * t * t +
                            (-0.02903 * z3 + 0.06377 * z2 - 0.03202 * z1 + 0.00394) * t +
                            (0.11693 * z3 - 0.21196 * z2 + 0.06052 * z1 + 0.25886);
    const double zenith_y = (0.00275 * z3 - 0.00610 * z2 + 0.00317 * z1) * t * t +
                            (-0.04214 * z3 + 0.08970 * z2 - 0.04153 * z1 + 0.00516) * t +
                            (0.15346 * z3 - 0.26756 * z2 + 0.06670 * z1 + 0.26688);
    const auto relative = [&](const Perez& perez, double cos_theta, double gamma) {
        return perez(cos_theta, gamma) / perez(1, zenith);
    };
    Sky sky;
    sky.environment = {"clear sky", vec3(1), make_map(512, [&](const dvec3& direction) {
                           if (direction.y <= 0) return dvec3(0);
                           const double gamma = std::acos(std::clamp(glm::dot(direction, sun), -1.0, 1.0));
                           const dvec3 rgb =
                               rgb_of_xyY(zenith_x * relative(chroma_x, direction.y, gamma),
                                          zenith_y * relative(chroma_y, direction.y, gamma),
                                          std::max(zenith_luminance, 0.0) * relative(luminance, direction.y, gamma));
                           return glm::max(rgb, dvec3(0));
                       })};
    const dvec3 illuminance = sun_illuminance(zenith, t);
    Image& map = sky.environment.map;
    constexpr double kGround = 0.2;
    const vec3 ground(kGround / kPi * (horizontal_irradiance(map) + std::max(sun.y, 0.0) * illuminance));
    for (int y = map.height / 2; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x)
            for (int c = 0; c < 3; ++c) map.at(x, y)[c] = ground[c];
    PunctualLight light;
    light.name = "sun";
    light.type = LightType::directional;
    light.intensity = vec3(illuminance);
    light.direction = vec3(-sun);
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
