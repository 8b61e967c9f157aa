// Tests that randomly damaged files load into a valid scene or are refused in one line. The seeds are fixed.
#include <random>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

/// Returns a scene with most features of the loader.
GltfBuilder rich_scene() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["attributes"].update(
        {{"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1})},
         {"TEXCOORD_0", b.accessor("VEC2", kU16, std::vector<std::uint16_t>{0, 1, 2, 3, 4, 5}, true)},
         {"COLOR_0", b.floats("VEC4", std::vector<float>(12, 1))},
         {"JOINTS_0", b.accessor("VEC4", kU8, std::vector<std::uint8_t>(12, 0))},
         {"WEIGHTS_0", b.floats("VEC4", std::vector<float>(12, 0.25f))}});
    primitive["indices"] = b.accessor("SCALAR", kU16, std::vector<std::uint16_t>{0, 1, 2});
    primitive["targets"] = {{{"POSITION", 0}}};
    primitive["material"] =
        b.push("materials", {{"normalTexture", {{"index", 0}, {"texCoord", 0}}},
                             {"extensions", {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1}}}}}});
    b.push("textures", {{"source", 0}, {"sampler", 0}});
    b.push("samplers", {{"wrapS", 33071}});
    b.push("images", {{"uri",
                       "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQeg/"
                       "AwMjA8P/1Wf//wcAPtIIBqaX8jwAAAAASUVORK5CYII="}});
    b.json["meshes"][0]["weights"] = {0.5};
    b.json["accessors"][0]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", b.view(std::vector<std::uint8_t>{2})}, {"componentType", kU8}, {"byteOffset", 0}}},
        {"values", {{"bufferView", b.view(std::vector<float>{0, 2, 0})}, {"byteOffset", 0}}}};
    std::vector<float> bind(32, 0.0f);
    for (const std::size_t diagonal : {0u, 5u, 10u, 15u}) bind[diagonal] = bind[16 + diagonal] = 1;
    b.push("skins", {{"joints", {1, 2}}, {"inverseBindMatrices", b.floats("MAT4", bind)}});
    b.json["nodes"][0].update({{"skin", 0}, {"children", {1}}});
    b.push("nodes", {{"translation", {1, 2, 3}}, {"rotation", {0, 0, 0, 1}}, {"scale", {1, 2, 3}}, {"children", {2}}});
    b.push("nodes",
           {{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 1}}}}}}}});
    b.push("nodes", {{"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.push("cameras",
           {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 1}, {"zfar", 2}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"intensity", 2}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}}};
    b.push("scenes", {{"nodes", {0, 3}}});
    b.json["scene"] = 0;
    const int times = b.floats("SCALAR", {0, 1});
    b.push("animations", {{"name", "all"},
                          {"samplers",
                           {{{"input", times}, {"output", b.floats("VEC4", {0, 0, 0, 1, 0, 1, 0, 0})}},
                            {{"input", times}, {"output", b.floats("SCALAR", {0, 1})}, {"interpolation", "STEP"}},
                            {{"input", times},
                             {"output", b.floats("VEC3", std::vector<float>(18, 1))},
                             {"interpolation", "CUBICSPLINE"}}}},
                          {"channels",
                           {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
                            {{"sampler", 1}, {"target", {{"node", 2}, {"path", "weights"}}}},
                            {{"sampler", 2}, {"target", {{"node", 3}, {"path", "translation"}}}}}}});
    b.add_buffer();
    return b;
}

class GltfFuzz : public GltfTest {
  protected:
    /// Poses the file; returns the error, which must be one line. A pose must pass validate().
    static std::string refusal_in_motion(const std::filesystem::path& path) {
        return without_name(error_message([&] {
            GltfScene scene(path);
            for (std::size_t i = 0; i < scene.animations().size(); ++i) scene.at(0.5, {&i, 1});
        }));
    }
};

TEST_F(GltfFuzz, TheUndamagedSceneLoads) {
    const Scene scene = load(rich_scene());
    EXPECT_EQ(scene.instances.size(), 4u);
    EXPECT_EQ(scene.lights.size() + scene.cameras.size() + scene.images.size(), 3u);
    EXPECT_EQ(refusal_in_motion(folder_ / "scene.glb"), "");
}

TEST_F(GltfFuzz, PropertiesOfAnyValue) {
    const GltfBuilder whole = rich_scene();
    const Json values[] = {0,
                           1,
                           2,
                           3,
                           -1,
                           255,
                           5126,
                           1e9,
                           4294967295u,
                           9007199254740992u,
                           18446744073709551615u,
                           1e-30,
                           1e300,
                           -0.5,
                           true,
                           nullptr,
                           "",
                           "VEC4",
                           "MAT2",
                           "x",
                           Json::array(),
                           Json::object(),
                           {1},
                           {0, 0, 0, 0}};
    std::size_t loaded = 0, moved = 0;
    const Json leaves = whole.json.flatten();
    for (const auto& [pointer, leaf] : leaves.items()) {
        for (const Json& value : values) {
            GltfBuilder b = whole;
            b.json[Json::json_pointer(pointer)] = value;
            const bool at_rest = refusal(b).empty();
            loaded += at_rest;
            if (at_rest || pointer.starts_with("/animations"))
                moved += refusal_in_motion(folder_ / "scene.glb").empty();
        }
    }
    EXPECT_GT(loaded, 100u);
    EXPECT_GT(moved, 100u);
    EXPECT_LT(moved, loaded) << "damaged animations do not affect the rest pose";
}

TEST_F(GltfFuzz, BytesOfAnyValue) {
    const std::string whole = rich_scene().glb();
    std::mt19937 random(1);
    for (int i = 0; i < 2000; ++i) {
        std::string damaged = whole;
        for (int flips = 0; flips <= i % 4; ++flips) damaged[random() % damaged.size()] = static_cast<char>(random());
        const auto path = write("damaged.glb", damaged);
        without_name(error_message([&] { load_gltf(path); }));
        refusal_in_motion(path);
    }
}

}  // namespace
}  // namespace halflight
