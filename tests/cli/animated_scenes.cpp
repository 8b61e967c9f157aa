#include "tests/cli/animated_scenes.h"

#include <cmath>
#include <limits>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

class AnimatedScene {
  public:
    GltfBuilder b;

    int material(const Json& color, const Json& emission = {0, 0, 0}) {
        return b.push("materials", {{"pbrMetallicRoughness",
                                     {{"baseColorFactor", {color[0], color[1], color[2], 1}}, {"metallicFactor", 0}}},
                                    {"emissiveFactor", emission}});
    }
    /// Adds a box from -half to half with eight shared vertices; returns its primitive.
    Json& box(const std::string& name, int material, const Json& at, const vec3& half) {
        std::vector<float> positions;
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis) positions.push_back((corner >> axis & 1 ? 1.0f : -1.0f) * half[axis]);
        const std::vector<std::uint8_t> triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                                     2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
        Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", positions)}});
        primitive["indices"] = b.accessor("SCALAR", kU8, triangles);
        primitive["material"] = material;
        b.json["nodes"].back()["name"] = name;
        b.json["nodes"].back()["translation"] = at;
        return primitive;
    }
    int last_node() const { return static_cast<int>(b.json["nodes"].size()) - 1; }
    int camera(const std::string& name, const Json& at) {
        const int index = b.push("cameras", {{"type", "perspective"},
                                             {"name", name},
                                             {"perspective", {{"yfov", 0.8}, {"znear", 0.1}, {"aspectRatio", 1}}}});
        return b.push("nodes", {{"camera", index}, {"translation", at}});
    }
    void animate(const std::string& name, int node, const char* path, const char* interpolation,
                 const std::vector<float>& times, int output) {
        b.push("animations",
               {{"name", name},
                {"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}},
                {"samplers",
                 {{{"input", b.floats("SCALAR", times)}, {"output", output}, {"interpolation", interpolation}}}}});
    }
    std::filesystem::path write(const std::filesystem::path& path) const {
        write_text(path, b.glb());
        return path;
    }
};

void add_room(AnimatedScene& scene) {
    const int grey = scene.material({0.7, 0.7, 0.7}), light = scene.material({0, 0, 0}, {1, 1, 1});
    scene.box("floor", grey, {0, -0.1, 0}, {3, 0.1f, 3});
    scene.box("lamp", light, {0, 4, 1}, {1, 0.05f, 1});
}

/// Adds a box whose upper four vertices follow the second joint, which leans over and back.
void add_bending_box(AnimatedScene& scene) {
    Json& primitive = scene.box("bending", scene.material({0.8, 0.2, 0.1}), {0, 0, 0}, {0.3f, 0.8f, 0.3f});
    std::vector<std::uint8_t> joints(8 * 4, 0), weights(8 * 4, 0);
    for (std::size_t corner = 0; corner < 8; ++corner) {
        joints[4 * corner] = corner & 2 ? 1 : 0;
        weights[4 * corner] = 255;
    }
    primitive["attributes"]["JOINTS_0"] = scene.b.accessor("VEC4", kU8, joints);
    primitive["attributes"]["WEIGHTS_0"] = scene.b.accessor("VEC4", kU8, weights, true);
    const int mesh_node = scene.last_node();
    scene.b.push("nodes", {{"translation", {-1, 0.9, 0}}});
    const int tip = scene.b.push("nodes", Json::object());
    scene.b.json["nodes"][static_cast<std::size_t>(tip - 1)]["children"] = {tip};
    scene.b.json["nodes"][static_cast<std::size_t>(mesh_node)]["skin"] =
        scene.b.push("skins", {{"joints", {tip - 1, tip}}});
    const float s = std::sin(0.4f), c = std::cos(0.4f);
    scene.animate("bend", tip, "rotation", "CUBICSPLINE", {0, 0.5f, 1},
                  scene.b.floats("VEC4", {0, 0, 0, 0, 0, 0, 0,  1, 0, 0, 1, 0,  //
                                          0, 0, 0, 0, 0, 0, s,  c, 0, 0, 0, 0,  //
                                          0, 0, 0, 0, 0, 0, -s, c, 0, 0, 0, 0}));
}

void add_breathing_box(AnimatedScene& scene) {
    Json& primitive = scene.box("breathing", scene.material({0.1, 0.6, 0.2}), {1, 0.5, -0.5}, {0.4f, 0.4f, 0.4f});
    std::vector<float> outwards;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) outwards.push_back(corner >> axis & 1 ? 0.3f : -0.3f);
    primitive["targets"] = {{{"POSITION", scene.b.floats("VEC3", outwards)}}};
    scene.animate("breathe", scene.last_node(), "weights", "LINEAR", {0, 0.5f, 1}, scene.b.floats("SCALAR", {0, 1, 0}));
}

void add_turning_box(AnimatedScene& scene) {
    scene.box("turning", scene.material({0.2, 0.3, 0.9}), {0.6, 0.4, 1}, {0.3f, 0.3f, 0.3f});
    scene.animate("turn", scene.last_node(), "rotation", "LINEAR", {0, 1},
                  scene.b.floats("VEC4", {0, 0, 0, 1, 0, std::sin(0.7f), 0, std::cos(0.7f)}));
}

}  // namespace

void animate_pointer(GltfBuilder& scene, const std::string& pointer, const char* type,
                     const std::vector<float>& values) {
    const Json extension = {{"KHR_animation_pointer", {{"pointer", pointer}}}};
    const Json sampler = {{"input", scene.floats("SCALAR", {0, 1})}, {"output", scene.floats(type, values)}};
    scene.json["extensionsUsed"].push_back("KHR_animation_pointer");
    scene.push("animations",
               {{"channels", {{{"sampler", 0}, {"target", {{"path", "pointer"}, {"extensions", extension}}}}}},
                {"samplers", {sampler}}});
}

std::filesystem::path write_animated_scene(const std::filesystem::path& folder) {
    AnimatedScene scene;
    add_room(scene);
    add_bending_box(scene);
    add_breathing_box(scene);
    add_turning_box(scene);
    scene.camera("still", {0, 1, 6});
    const int moving = scene.camera("moving", {0, 1, 6});
    scene.animate("fly", moving, "translation", "LINEAR", {0, 1}, scene.b.floats("VEC3", {-1, 1, 6, 1, 1.5f, 5}));
    return scene.write(folder / "animated.glb");
}

std::filesystem::path write_scene_with_bad_frame(const std::filesystem::path& folder) {
    AnimatedScene scene;
    add_room(scene);
    scene.box("thrown", scene.material({1, 1, 1}), {0, 1, 0}, {0.5f, 0.5f, 0.5f});
    const int thrown = scene.last_node();
    const float huge = std::numeric_limits<float>::max();
    scene.animate("throw", thrown, "translation", "STEP", {0, 3, 4},
                  scene.b.floats("VEC3", {0, 1, 0, huge, 1, 0, 0, 2, 0}));
    scene.b.push("nodes", {{"children", {thrown}}, {"scale", {2, 2, 2}}});
    scene.camera("still", {0, 1, 6});
    return scene.write(folder / "bad_frame.glb");
}

std::filesystem::path write_blinking_scene(const std::filesystem::path& folder, const std::array<vec3, 3>& scales) {
    AnimatedScene scene;
    add_room(scene);
    Json lids = scene.box("blinking", scene.material({0.8, 0.6, 0.1}), {0, 1, 0}, {0.5f, 0.5f, 0.5f});
    Json sides = lids;
    sides["material"] = scene.material({0.1, 0.6, 0.8});
    const auto triangles = [&](const std::vector<std::uint8_t>& list) { return scene.b.accessor("SCALAR", kU8, list); };
    lids["indices"] = triangles({0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7});
    sides["indices"] = triangles({0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5});
    scene.b.json["meshes"].back()["primitives"] = {lids, sides};
    scene.b.json["nodes"].back()["scale"] = {scales[0].x, scales[0].y, scales[0].z};
    scene.b.json["meshes"].back()["name"] = "cube";
    std::vector<float> values;
    for (const vec3& s : scales) values.insert(values.end(), {s.x, s.y, s.z});
    scene.animate("blink", scene.last_node(), "scale", "STEP", {0, 1, 2}, scene.b.floats("VEC3", values));
    scene.camera("still", {0, 1, 6});
    return scene.write(folder / "blinking.glb");
}

std::filesystem::path write_fading_scene(const std::filesystem::path& folder, float first, float last) {
    AnimatedScene scene;
    GltfBuilder& b = scene.b;
    Json& floor = b.add_mesh({{"POSITION", b.floats("VEC3", {-1, 0, -1, -1, 0, 1, 1, 0, 1})}});
    floor["material"] = b.push("materials", Json::object());
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.push("nodes", {{"translation", {0, 1, 0}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    animate_pointer(b, "/extensions/KHR_lights_punctual/lights/0/intensity", "SCALAR", {first, last});
    return scene.write(folder / "fading.glb");
}

std::filesystem::path write_sliding_light(const std::filesystem::path& folder, double fps) {
    AnimatedScene scene;
    GltfBuilder& b = scene.b;
    Json& square = b.add_mesh({{"POSITION", b.floats("VEC3", {-0.5f, -0.5f, 0, 0.5f, -0.5f, 0, 0.5f, 0.5f, 0,  //
                                                              -0.5f, 0.5f, 0})}});
    square["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3});
    square["material"] = scene.material({0, 0, 0}, {1, 1, 1});
    b.json["nodes"].back()["name"] = "slider";
    const int slider = scene.last_node();
    const auto camera = [&](const char* name) {
        const Json shape = {{"xmag", 2}, {"ymag", 2}, {"znear", 0.1}, {"zfar", 100}};
        const int index = b.push("cameras", {{"type", "orthographic"}, {"name", name}, {"orthographic", shape}});
        return b.push("nodes", {{"camera", index}, {"translation", {0, 0, 5}}});
    };
    camera("still");
    const int panning = camera("panning"), cutting = camera("cutting");
    scene.animate("slide", slider, "translation", "LINEAR", {0, 2}, b.floats("VEC3", {-2, 0, 0, 2, 0, 0}));
    scene.animate("pan", panning, "translation", "LINEAR", {0, 2}, b.floats("VEC3", {2, 0, 5, -2, 0, 5}));
    scene.animate("cut", cutting, "translation", "STEP", {0, 1}, b.floats("VEC3", {0, 0, 5, 10, 0, 5}));
    if (fps != 0) b.json["asset"]["extras"]["fps"] = fps;
    return scene.write(folder / "sliding.glb");
}

}  // namespace halflight::test
