#include "tools/measure/bench/setup.h"

#include <charconv>
#include <cstdio>

#include "engine/core/error.h"
#include "engine/io/gltf/gltf.h"

namespace halflight::bench {

NamedCamera pick_camera(const Scene& scene, const std::string& wanted) {
    for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
        const std::string& name = scene.cameras[i].name;
        if (wanted.empty() || wanted == name || wanted == std::to_string(i)) return {name, scene.cameras[i]};
    }
    if (!wanted.empty()) throw Error(scene.name, "has no camera \"{}\"", wanted);
    return {"framing", framing_camera(scene)};
}

ivec2 parse_size(const std::string& text) {
    constexpr int kGreatest = 65536;  // largest side, pixels; also the limit of `halflight render`
    ivec2 size(0);
    const char* const end = text.data() + text.size();
    const auto [after_width, wrong_width] = std::from_chars(text.data(), end, size.x);
    const bool crossed = wrong_width == std::errc() && after_width != end && *after_width == 'x';
    const auto [after, wrong] = std::from_chars(crossed ? after_width + 1 : end, end, size.y);
    if (wrong != std::errc() || after != end || glm::any(glm::lessThan(size, ivec2(1))) ||
        glm::any(glm::greaterThan(size, ivec2(kGreatest)))) {
        throw Error("--size", "\"{}\" is not WIDTHxHEIGHT, each from 1 to {}", text, kGreatest);
    }
    return size;
}

Scene load_lit(const std::string& file, bool strict) {
    Scene scene = load_gltf(file, {.strict = strict});
    if (!has_light(scene)) scene.environment = default_sky();
    return scene;
}

rays::PackedScene pack(const TraceTables& tables, const std::string& nodes) {
    if (nodes == "auto") return rays::pack_scene(tables);
    return rays::pack_scene(tables, nodes == "grid" ? rays::NodeFormat::grid : rays::NodeFormat::floating);
}

}  // namespace halflight::bench
