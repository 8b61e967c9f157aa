#include "engine/core/optics.h"

#include <fmt/format.h>

namespace halflight {

std::span<const Projection> projections() {
    static constexpr Projection kAll[] = {Projection::camera, Projection::panorama, Projection::fisheye,
                                          Projection::equisolid};
    return kAll;
}

const char* name(Projection projection) {
    constexpr const char* kNames[] = {"auto", "panorama", "fisheye", "fisheye-equisolid"};
    return kNames[static_cast<std::size_t>(projection)];
}

std::span<const Stereo> stereo_layouts() {
    static constexpr Stereo kAll[] = {Stereo::none,       Stereo::left,         Stereo::right,
                                      Stereo::over_under, Stereo::side_by_side, Stereo::views};
    return kAll;
}

const char* name(Stereo stereo) {
    constexpr const char* kNames[] = {"none", "left", "right", "over-under", "side-by-side", "views"};
    return kNames[static_cast<std::size_t>(stereo)];
}

dvec2 eyes_in_picture(const Optics& optics) {
    const Stereo stereo = optics.stereo;
    return {stereo == Stereo::side_by_side ? 2 : 1, stereo == Stereo::over_under || stereo == Stereo::views ? 2 : 1};
}

const char* odd_side(const Optics& optics, const ivec2& image) {
    const dvec2 eyes = eyes_in_picture(optics);
    if (eyes.x > 1 && image.x % 2 != 0) return "width";
    return eyes.y > 1 && image.y % 2 != 0 ? "height" : "";
}

double eye_aspect(const Optics& optics, const ivec2& image) {
    const dvec2 size = dvec2(image) / eyes_in_picture(optics);
    return size.x / size.y;
}

std::string text(const Optics& optics) {
    std::string words = optics.projection == Projection::camera ? "" : name(optics.projection);
    if (optics.is_fisheye()) words += fmt::format(" of {:g} degrees", optics.fisheye_fov);
    if (optics.stereo == Stereo::none) return words;
    words += fmt::format("{}stereo {}, eyes {:g} m apart, {}", words.empty() ? "" : ", ", name(optics.stereo),
                         optics.eye_distance,
                         optics.convergence > 0 ? fmt::format("converging at {:g} m", optics.convergence) : "parallel");
    return words;
}

}  // namespace halflight
