#include "api/halflight/scene_edits.h"
#include "api/halflight/settings_file.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

const std::filesystem::path kFile = "/there is none/settings.json";

/// Returns a scene with what edits can change: two materials with textures and emission, two instances, and a light of
/// each type.
Scene editable_scene() {
    Scene scene;
    scene.name = "scene";
    scene.images.push_back({.name = "image", .width = 1, .height = 1, .rgba = {255, 128, 0, 255}});
    for (const char* const name : {"floor", "lamp"}) {
        Material& material = scene.materials.emplace_back();
        material.name = name;
        material.base_color_texture.image = 0;
    }
    scene.materials[1].emission = vec3(2, 1, 0);
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.name = "triangle";
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.uvs[0].assign(3, vec2(0));
    mesh.triangles = {{0, 1, 2}, {2, 1, 0}};
    mesh.triangle_material = {0, 1};
    for (const char* const name : {"left", "right"}) scene.instances.push_back({.name = name, .mesh = 0});
    for (const LightType type : {LightType::point, LightType::spot, LightType::directional}) {
        PunctualLight& light = scene.lights.emplace_back();
        light.name = fmt::format("light {}", scene.lights.size());
        light.type = type;
    }
    scene.environment.color = vec3(0.5f);
    validate(scene);
    return scene;
}

void apply_to_scene(const SceneEdits& edits) {
    Scene scene = editable_scene();
    bool suits = true;
    try {
        check_edits(edits, scene, kFile.string());
    } catch (const Error& error) {
        check_message(error, kFile.string());
        suits = false;
    }
    try {
        apply(edits, scene, kFile.string());
        if (!suits) throw Broken("edits were applied that do not suit the scene");
    } catch (const Error& error) {
        if (suits) throw Broken(std::string("edits that suit the scene were refused: ") + error.what());
        check_message(error, kFile.string());
    }
    try {
        validate(scene);
    } catch (const Error& error) {
        throw Broken(std::string("edits made the scene invalid: ") + error.what());
    }
}

}  // namespace

void edits(std::string_view input) {
    check_errors(kFile.string(), [&] { apply_to_scene(parse_settings(input, kFile).edits); });
}

}  // namespace halflight::fuzz
