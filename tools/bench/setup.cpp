#include "tools/bench/setup.h"

#include <cstdio>

#include "engine/core/error.h"
#include "engine/io/gltf.h"

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
    ivec2 size(0);
    char end = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &size.x, &size.y, &end) != 2 || glm::any(glm::lessThan(size, ivec2(1))))
        throw Error("--size", "\"{}\" is not WIDTHxHEIGHT", text);
    return size;
}

Scene load_lit(const std::string& file) {
    Scene scene = load_gltf(file);
    if (!has_light(scene)) scene.environment = default_sky();
    return scene;
}

rays::PackedScene pack(const TraceTables& tables, const std::string& nodes) {
    if (nodes == "auto") return rays::pack_scene(tables);
    return rays::pack_scene(tables, nodes == "grid" ? rays::NodeFormat::grid : rays::NodeFormat::floating);
}

}  // namespace halflight::bench
