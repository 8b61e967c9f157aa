#include "tools/halflight/loading.h"

#include "engine/io/environment.h"

namespace halflight {

GltfOptions gltf_options(bool allow_outside) {
    GltfOptions options;
    options.allow_outside_folder = allow_outside;
    return options;
}

Scene load_scene(const std::filesystem::path& path, bool allow_outside, const Console& console) {
    Scene scene = load_gltf(path, gltf_options(allow_outside));
    for (const std::string& warning : scene.report.warnings) console.warn("{}", warning);
    return scene;
}

void set_environment(Scene& scene, const EnvironmentChoice& choice, const Console& console) {
    if (const auto* color = std::get_if<vec3>(&choice)) {
        scene.environment = {"constant", *color, {}};
    } else if (const auto* file = std::get_if<std::filesystem::path>(&choice)) {
        const std::size_t warned = scene.report.warnings.size();
        scene.environment = load_environment(*file, scene.report);
        for (std::size_t i = warned; i < scene.report.warnings.size(); ++i)
            console.warn("{}", scene.report.warnings[i]);
    } else if (!has_light(scene)) {
        scene.environment = default_sky();
        console.note("no light in the scene: a neutral sky is added (--env chooses another, --env 0,0,0 none)");
    }
}

}  // namespace halflight
