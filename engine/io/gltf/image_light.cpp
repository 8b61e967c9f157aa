#include "engine/io/gltf/image_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtx/component_wise.hpp>
#include <nlohmann/json.hpp>

#include "engine/core/memory_ledger.h"
#include "engine/io/environment.h"
#include "engine/io/gltf/material.h"
#include "engine/io/gltf/nodes.h"
#include "engine/io/gltf/schema.h"
#include "engine/scene/srgb.h"

namespace halflight {
namespace {

constexpr const char* kElement = "extensions.EXT_lights_image_based";

/// A face of the cube: directions of its centre, and from there to its right and lower edges.
struct Face {
    dvec3 centre, right, down;
};
constexpr std::array<Face, 6> kFaces{{{{-1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
                                      {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
                                      {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}},
                                      {{0, -1, 0}, {-1, 0, 0}, {0, 0, -1}},
                                      {{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}},
                                      {{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}}};
using Cube = std::array<Image, kFaces.size()>;

/// Returns the linear values of an RGBD image. An alpha of 0 counts as the least other one.
Image decode_rgbd(const TextureImage& from) {
    Image image(from.width, from.height, 3);
    const double largest = from.largest();
    for (int y = 0; y < from.height; ++y) {
        for (int x = 0; x < from.width; ++x) {
            const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(from.width);
            const std::uint8_t* texel = from.rgba.data() + (row + static_cast<std::size_t>(x)) * from.texel_bytes();
            const double divisor = std::max(from.code(texel, 3), 1u) / largest;
            for (std::size_t c = 0; c < 3; ++c)
                image.at(x, y)[c] = static_cast<float>(srgb_to_linear(from.code(texel, c) / largest) / divisor);
        }
    }
    return image;
}

/// Returns the radiance in a direction, interpolated linearly within a face.
vec3 radiance_of(const Cube& cube, const dvec3& direction) {
    std::size_t face = 0;
    for (std::size_t i = 1; i < cube.size(); ++i)
        if (glm::dot(kFaces[i].centre, direction) > glm::dot(kFaces[face].centre, direction)) face = i;
    const Image& image = cube[face];
    const Face& axes = kFaces[face];
    const int end = image.width - 1;
    // Returns the texel before a place along an axis, and the weight of the next one.
    const auto place = [&](const dvec3& axis) {
        const double from_centre = glm::dot(axis, direction) / glm::dot(axes.centre, direction);
        const double at = std::clamp((from_centre + 1) / 2 * image.width - 0.5, 0.0, double(end));
        const int before = static_cast<int>(at);
        return std::pair(before, static_cast<float>(at - before));
    };
    const auto [x, tx] = place(axes.right);
    const auto [y, ty] = place(axes.down);
    const auto pixel = [&](int px, int py) {
        const float* const p = image.at(std::min(px, end), std::min(py, end));
        return vec3(p[0], p[1], p[2]);
    };
    return glm::mix(glm::mix(pixel(x, y), pixel(x + 1, y), tx), glm::mix(pixel(x, y + 1), pixel(x + 1, y + 1), tx), ty);
}

/// Reads the first level of a light's images.
Cube read_cube(const nlohmann::json& levels, GltfDocument& document) {
    const std::size_t faces = levels.empty() ? 0 : levels[0].size();
    if (faces != kFaces.size())
        document.fail(kElement, "the first level of specularImages has {} images, not six", faces);
    // The faces as floats, and two maps: the document's and the scene's.
    const std::size_t texels = measure_image(document, levels[0][0].get<std::size_t>());
    const std::size_t most = 3 * sizeof(float) * (kFaces.size() + 2 * 8) * texels;
    MemoryLedger::process().check(most, fmt::format("{}: {}", document.file, kElement), "environment map");
    Cube cube;
    for (std::size_t i = 0; i < cube.size(); ++i) {
        const auto index = levels[0][i].get<std::size_t>();
        const TextureImage image = read_image(document, index);
        cube[i] = decode_rgbd(image);
        const int side = cube[0].width;
        if (image.width != side || image.height != side)
            document.fail(fmt::format("images[{}]", index), "has {} x {} texels, not {} x {} like a face of the cube",
                          image.width, image.height, side, side);
    }
    return cube;
}

/// Returns the matrix that turns directions of the world into those of the light.
dmat3 to_light(const nlohmann::json& light, GltfDocument& document) {
    const auto rotation = light.find("rotation");
    if (rotation == light.end()) return dmat3(1);
    dvec4 q;
    for (int i = 0; i < 4; ++i) q[i] = (*rotation)[static_cast<std::size_t>(i)].get<double>();
    const double largest = glm::compMax(glm::abs(q));
    if (!(largest > 0) || !std::isfinite(largest)) {
        document.value_fault("rotation is 0 or not finite; it is ignored", kElement);
        return dmat3(1);
    }
    return glm::transpose(dmat3(compose(dvec3(0), q / largest, dvec3(1))));
}

}  // namespace

nlohmann::json environment_of(const nlohmann::json& root) {
    const nlohmann::json::json_pointer color("/extensions/HALFLIGHT_environment/color");
    if (root.contains(color)) return root[color];
    const nlohmann::json::json_pointer reference("/extensions/EXT_lights_image_based/light");
    const auto scenes = root.find("scenes");
    const auto scene = root.value("scene", std::size_t{0});
    if (scenes == root.end() || scene >= scenes->size() || !(*scenes)[scene].contains(reference)) return nullptr;
    return root["extensions"]["EXT_lights_image_based"]["lights"][(*scenes)[scene][reference].get<std::size_t>()];
}

void read_environment(const nlohmann::json& from, GltfDocument& document) {
    Environment& environment = document.environment;
    if (from.is_null()) return;
    if (from.is_array()) {
        environment.name = "HALFLIGHT_environment";
        for (int i = 0; i < 3; ++i) environment.color[i] = static_cast<float>(from[static_cast<std::size_t>(i)]);
        if (!all_finite(environment.color) || glm::any(glm::lessThan(environment.color, vec3(0))))
            document.fail("extensions.HALFLIGHT_environment", "color is negative or not finite");
        return;
    }
    const auto intensity = static_cast<float>(from.value("intensity", 1.0));
    if (!(intensity >= 0) || !std::isfinite(intensity))
        document.fail(kElement, "intensity is negative, not finite or too large");
    const dmat3 rotation = to_light(from, document);
    Cube cube;
    try {
        cube = read_cube(from["specularImages"], document);
    } catch (const Error& error) {
        if (document.options.strict) throw;
        document.warnings.add(fmt::format("{}; the light of EXT_lights_image_based is left out", error.reason()),
                              element_of(error, document.file));
        return;
    }
    environment.map = equirectangular(cube[0].width, [&](const dvec3& d) { return radiance_of(cube, rotation * d); });
    document.environment_memory = {MemoryLedger::process(), MemoryPart::scene,
                                   2 * sizeof(float) * environment.map.pixels.size()};  // the scene has a copy
    environment.name = from.value("name", "EXT_lights_image_based");
    environment.color = vec3(intensity);
    const auto dark = [](float v) { return v == 0; };
    if (std::ranges::all_of(environment.map.pixels, dark)) {
        document.warnings.add("has no light: all its images are black", kElement);
        environment.map = Image();
        environment.color = vec3(0);
    }
}

}  // namespace halflight
