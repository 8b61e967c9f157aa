// Tests that faults which other loaders accept give one warning per kind, and that strict options refuse them.
#include "tests/unit/io/compress_gltf.h"

namespace halflight {
namespace {

/// A file with a fault, and the start of its warning.
struct Case {
    std::string pointer;  // place of `value`, which ends with "-" to append to a list
    Json value;
    std::string warning;
};

class GltfTolerance : public GltfTest {
  protected:
    /// Expects all functions that load a file to give the scene `good` and one warning, which is an error with strict
    /// options.
    void expect_tolerated(const GltfBuilder& b, const std::string& warning, const Scene& good) const {
        SCOPED_TRACE(warning);
        const auto path = write("scene.glb", b.glb());
        Scene scene;
        ASSERT_EQ(error_message([&] { scene = load_gltf(path); }), "");
        expect_warnings(scene.report.warnings, {warning});
        ASSERT_EQ(scene.meshes.size(), good.meshes.size());
        for (std::size_t i = 0; i < good.meshes.size(); ++i) {
            EXPECT_EQ(scene.meshes[i].positions, good.meshes[i].positions);
            EXPECT_EQ(scene.meshes[i].normals, good.meshes[i].normals);
        }
        GltfMeshSource source(path);
        for (std::size_t i = 0; i < source.scene().meshes.size(); ++i) source.read(i);
        expect_warnings(source.report().warnings, {warning});

        const GltfOptions strict{.strict = true};
        const std::string element = warning.substr(0, warning.find(": ") + 2);
        const auto refused = [&](const std::string& message) {
            EXPECT_TRUE(without_name(message).starts_with(element)) << message;
        };
        refused(error_message([&] { load_gltf(path, strict); }));
        refused(error_message([&] { GltfScene(path, strict).at_rest(); }));
        refused(error_message([&] {
            GltfMeshSource strict_source(path, strict);
            for (std::size_t i = 0; i < strict_source.scene().meshes.size(); ++i) strict_source.read(i);
        }));
    }
    void expect_tolerated(const GltfBuilder& base, const std::vector<Case>& cases) const {
        const Scene good = load(base);
        for (const auto& [pointer, value, warning] : cases) {
            GltfBuilder b = base;
            b.json[Json::json_pointer(pointer)] = value;
            expect_tolerated(b, warning, good);
        }
    }
    /// Returns a scene with one object of each list, all of which are used.
    static GltfBuilder used() {
        GltfBuilder b;
        Json& primitive = b.add_triangle();
        primitive["material"] = b.push("materials", Json::object());
        b.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
        b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
        b.push("scenes", {{"nodes", {0}}});
        b.add_buffer();
        return b;
    }
};

TEST_F(GltfTolerance, WhatNothingUsesMayHaveFaults) {
    std::vector<Case> cases{
        {"/accessors/-", {{"componentType", kF32}, {"count", 1}, {"type", "VEC9"}}, "accessors[1]: type 'VEC9'"},
        {"/accessors/-",
         {{"bufferView", 9}, {"componentType", kF32}, {"count", 1}, {"type", "VEC3"}},
         "accessors[1].bufferView: 9 is not an index"},
        {"/bufferViews/-", {{"buffer", 9}, {"byteLength", 4}}, "bufferViews[1].buffer: 9 is not an index"},
        {"/bufferViews/-", {{"buffer", 0}, {"byteLength", 4}, {"byteStride", 3}}, "bufferViews[1]: byteStride 3"},
        {"/buffers/-", {{"byteLength", 4}, {"uri", "none.bin"}}, "buffers[1]: "},
        {"/buffers/-", {{"byteLength", 4}, {"uri", "https://a.b/c.bin"}}, "buffers[1]: "},
        {"/buffers/-", {{"byteLength", 0}}, "buffers[1]: byteLength is 0"},
        {"/cameras/-", {{"type", "fisheye"}}, "cameras[0]: type 'fisheye' is unknown"},
        {"/cameras/-", {{"type", "perspective"}}, "cameras[0]: has no 'perspective'"},
        {"/images/-", {{"bufferView", 9}}, "images[0].bufferView: 9 is not an index"},
        {"/images/-", Json::object(), "images[0]: has neither a URI nor a bufferView"},
        {"/materials/-", {{"normalTexture", {{"index", 9}}}}, "materials[1].normalTexture.index: 9 is not an index"},
        {"/meshes/-",
         {{"primitives", {{{"attributes", {{"POSITION", 9}}}}}}},
         "meshes[1].primitives[0].attributes.POSITION: 9 is not an index"},
        {"/nodes/-", {{"mesh", 9}}, "nodes[1].mesh: 9 is not an index"},
        {"/nodes/-", {{"children", {9}}}, "nodes[1].children[0]: 9 is not an index"},
        {"/nodes/-", {{"children", {1}}}, "nodes[1]: is its own ancestor"},
        {"/nodes/-", {{"children", {2}}, {"scale", {1e300, 1e300, 1e300}}}, "nodes[1].children[0]: 2 is not an index"},
        {"/nodes/-", {{"scale", {1e300, 1e300, 1e300}}}, "nodes[1]: its transform overflows"},
        {"/scenes/-", {{"nodes", {9}}}, "scenes[1].nodes[0]: 9 is not an index"},
        {"/skins/-", {{"joints", {9}}}, "skins[0].joints[0]: 9 is not an index"},
        {"/textures/-", {{"source", 9}}, "textures[0].source: 9 is not an index into images, which has 0"},
        {"/textures/-", {{"sampler", 9}}, "textures[0].sampler: 9 is not an index"},
        {"/extensions/KHR_lights_punctual/lights/-",
         {{"type", "spot"}},
         "extensions.KHR_lights_punctual.lights[1]: has no 'spot'"},
        {"/extensions/KHR_lights_punctual/lights/-", Json::object(),
         "extensions.KHR_lights_punctual.lights[1]: has no 'type'"},
    };
    for (const char* const list : {"accessors", "bufferViews", "buffers", "cameras", "meshes", "skins"})
        cases.push_back({fmt::format("/{}/-", list), Json::object(),
                         fmt::format("{}[{}]: has no '", list, used().json.value(list, Json::array()).size())});
    expect_tolerated(used(), cases);

    // A node beside the scene that claims one of its nodes.
    const Scene good = load(used());
    GltfBuilder b = used();
    const int child = b.push("nodes", Json::object());
    b.json["nodes"][0]["children"] = {child};
    b.push("nodes", {{"children", {child}}, {"scale", {2, 2, 2}}});
    expect_tolerated(b, "nodes[1]: is a child of both nodes[0] and nodes[2]", good);
    b = used();
    for (const char* const list : {"accessors", "nodes", "materials", "textures"})
        for (const Json& wrong : {Json(7), Json(nullptr), Json::array()}) {
            GltfBuilder bad = used();
            bad.push(list, wrong);
            EXPECT_TRUE(refusal(bad).starts_with(list)) << list << wrong << refusal(bad);
        }
}

/// Whatever the scene reaches must be right: by joints outside of it, by animations, or without scenes.
TEST_F(GltfTolerance, WhatIsUsedMayNot) {
    GltfBuilder b = used();
    b.json["nodes"].push_back({{"mesh", 9}});
    EXPECT_NE(load(b).report.warnings.size(), 0u);
    const std::string element = "nodes[1].mesh: 9 is not an index";
    b.json["nodes"][0]["children"] = {1};
    EXPECT_TRUE(refusal(b).starts_with(element)) << refusal(b);
    b.json["nodes"][0].erase("children");
    b.json["scenes"][0]["nodes"] = {0, 1};
    EXPECT_TRUE(refusal(b).starts_with(element)) << refusal(b);
    b.json["scenes"][0]["nodes"] = {0};
    b.json["nodes"].push_back(Json::object());
    b.json["nodes"][1]["children"] = {2};  // a parent of the joint, which moves it
    b.json["nodes"][0]["skin"] = b.push("skins", {{"joints", {2}}});
    EXPECT_NE(refusal(b), "");
    b.json["nodes"][0].erase("skin");
    b.json.erase("scenes");
    EXPECT_TRUE(refusal(b).starts_with(element)) << refusal(b);

    GltfBuilder moved = used();
    const int times = moved.floats("SCALAR", {0, 1});
    moved.push("accessors", {{"bufferView", 99}, {"componentType", kF32}, {"count", 2}, {"type", "VEC3"}});
    EXPECT_EQ(load(moved).report.warnings.size(), 1u);
    moved.animate(0, "translation", times, times + 1);
    EXPECT_TRUE(refusal(moved).starts_with(fmt::format("accessors[{}].bufferView: 99", times + 1))) << refusal(moved);
}

TEST_F(GltfTolerance, OptionalMembersMayBeNull) {
    GltfBuilder b = used();
    b.json["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "spot";
    b.json["extensions"]["KHR_lights_punctual"]["lights"][0]["spot"] = Json::object();
    const std::string light = "/extensions/KHR_lights_punctual/lights/0/";
    expect_tolerated(b, {{"/nodes/0/camera", nullptr, "nodes[0].camera: is null"},
                         {"/nodes/0/name", nullptr, "nodes[0].name: is null"},
                         {"/nodes/0/skin", nullptr, "nodes[0].skin: is null"},
                         {"/nodes/0/matrix", nullptr, "nodes[0].matrix: is null"},
                         {"/nodes/0/children", nullptr, "nodes[0].children: is null"},
                         {"/cameras", nullptr, "cameras: is null"},
                         {"/scene", nullptr, "scene: is null"},
                         {"/materials/0/extensions", nullptr, "materials[0].extensions: is null"},
                         {"/materials/0/normalTexture", nullptr, "materials[0].normalTexture: is null"},
                         {"/accessors/0/sparse", nullptr, "accessors[0].sparse: is null"},
                         {"/bufferViews/0/byteStride", nullptr, "bufferViews[0].byteStride: is null"},
                         {"/meshes/0/weights", nullptr, "meshes[0].weights: is null"},
                         {"/meshes/0/primitives/0/indices", nullptr, "meshes[0].primitives[0].indices: is null"},
                         {light + "color", nullptr, "extensions.KHR_lights_punctual.lights[0].color: is null"}});
    // The cone of a spot light is then the default one.
    b.json[Json::json_pointer(light + "spot")] = nullptr;
    const Scene spot = load(b);
    EXPECT_EQ(spot.lights.at(0).outer_cone, float(kPi / 4));
    expect_warnings(spot.report.warnings, {"extensions.KHR_lights_punctual.lights[0].spot: is null"});
    b.json[Json::json_pointer(light + "type")] = "point";
    EXPECT_EQ(load(b).report.warnings.size(), 1u);

    b.json["extensions"]["KHR_lights_punctual"]["lights"][0] = {{"type", "spot"}};
    const Scene absent = load(b);
    EXPECT_EQ(absent.lights.at(0).outer_cone, float(kPi / 4));
    expect_warnings(absent.report.warnings, {"extensions.KHR_lights_punctual.lights[0]: has no 'spot'"});
    EXPECT_NE(error_message([&] { load_gltf(write("scene.glb", b.glb()), {.strict = true}); }), "");
}

/// Values that are repaired, which other loaders read in their own ways.
TEST_F(GltfTolerance, InvalidValuesAreErrorsWithStrict) {
    const auto expect = [&](const std::string& start, const auto& change) {
        GltfBuilder b = used();
        change(b);
        expect_warnings(load(b).report.warnings, {start});
        const std::string message =
            without_name(error_message([&] { load_gltf(write("scene.glb", b.glb()), {.strict = true}); }));
        EXPECT_TRUE(message.starts_with(start)) << message;
    };
    const float nan = std::nanf("");
    const auto put = [](const char* pointer, const Json& value) {
        return [=](GltfBuilder& b) { b.json[Json::json_pointer(pointer)] = value; };
    };
    expect("meshes[1].primitives[0]: has positions that are not finite", [&](GltfBuilder& b) {
        b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, nan, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0})}});
        b.json["scenes"][0]["nodes"].push_back(b.json["nodes"].size() - 1);
        b.json["buffers"][0]["byteLength"] = b.bytes().size();
    });
    expect("materials[0]: metallicFactor is outside [0, 1]",
           put("/materials/0/pbrMetallicRoughness/metallicFactor", 2));
    expect("materials[0]: alphaMode 'GLASS' is unknown", put("/materials/0/alphaMode", "GLASS"));
    expect("nodes[0]: rotation is a zero quaternion", put("/nodes/0/rotation", {0, 0, 0, 0}));
    expect("extensions.KHR_lights_punctual.lights[0]: light intensity is negative",
           put("/extensions/KHR_lights_punctual/lights/0/intensity", -1));
}

TEST_F(GltfTolerance, RulesWithoutEffectOnThePicture) {
    GltfBuilder b = used();
    b.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const Json mapping{{"material", 0}, {"variants", {0}}};
    const std::string variants = "/meshes/0/primitives/0/extensions/KHR_materials_variants";
    const std::string place = "meshes[0].primitives[0].extensions.KHR_materials_variants";
    b.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "blue"}}};
    b.json[Json::json_pointer(variants)]["mappings"] = {mapping};
    b.json.erase("buffers");
    b.make_sparse(0, {1, 2}, {1, 0, 0, 0, 1, 0});
    const int zeros = b.floats("SCALAR", {0});
    b.add_buffer();
    expect_tolerated(
        b, {{"/nodes/0/translation", {1, 2, 3}, "nodes[0]: has a matrix, its translation is ignored"},
            {"/nodes/0/scale", {2, 2, 2}, "nodes[0]: has a matrix, its scale is ignored"},
            {fmt::format("/accessors/{}/count", zeros), 0, fmt::format("accessors[{}]: count is 0", zeros)},
            {"/bufferViews/0/byteStride", 0, "bufferViews[0]: byteStride is 0"},
            {"/extensions/KHR_materials_variants/variants/0", 7,
             "extensions.KHR_materials_variants.variants[0]: is not an object; it is left out"},
            {variants + "/mappings/-", {{"material", 9}, {"variants", {0}}}, place + ".mappings[1].material: 9 is not"},
            {variants + "/mappings/-",
             {{"material", 0}, {"variants", {5}}},
             place + ".mappings[1].variants[0]: 5 is not an index into variants, which has 1; it is left out"},
            {variants + "/mappings", 7, place + ".mappings: is not an array; it is left out"},
            {"/materials/-",
             {{"normalTexture", {{"index", 0}}}},
             "materials[1].normalTexture.index: 0 is not an index into textures, which has 0; nothing uses it"}});
    GltfBuilder backwards = used();
    const Scene good = load(backwards);
    backwards.json.erase("buffers");
    backwards.make_sparse(0, {2, 1}, {0, 1, 0, 1, 0, 0});
    expect_tolerated(backwards, "accessors[0]: its sparse indices do not ascend", good);
}

/// A missing image is left out if its texture is used, too. The file of an image that nothing uses is not read.
TEST_F(GltfTolerance, ImagesWithoutContent) {
    GltfBuilder b = used();
    b.push("images", Json::object());
    b.push("textures", {{"source", 0}});
    b.json["materials"][0]["normalTexture"]["index"] = 0;
    const Scene scene = load(b);
    EXPECT_FALSE(scene.materials[0].normal_texture);
    expect_warnings(scene.report.warnings, {"images[0]: has neither", "textures[0]: has no image"});
    b.json["images"][0]["uri"] = "missing.png";
    EXPECT_TRUE(refusal(b).starts_with("images[0] (missing.png): ")) << refusal(b);
    b.json["materials"][0].erase("normalTexture");
    expect_warnings(load(b).report.warnings, {});
    b.push("materials", {{"normalTexture", {{"index", 0}}}});
    expect_warnings(load(b).report.warnings, {"images[0] (missing.png): "});
}

TEST_F(GltfTolerance, JointsWithoutWeight) {
    const auto skinned = [](std::uint8_t joint, float weight) {
        GltfBuilder b = used();
        b.json.erase("buffers");
        b.attributes()["JOINTS_0"] =
            b.accessor("VEC4", kU8, std::vector<std::uint8_t>{0, joint, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255});
        b.attributes()["WEIGHTS_0"] = b.floats("VEC4", {1, weight, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1});
        b.json["nodes"][0]["skin"] = b.push("skins", {{"joints", {0}}});
        return b;
    };
    GltfBuilder good = used();
    expect_tolerated(skinned(9, 0), "meshes[0].primitives[0]: refers to joint 255 of 1 with weight 0", load(good));
    EXPECT_TRUE(refusal(skinned(9, 0.5f)).starts_with("meshes[0].primitives[0]: JOINTS_0 refers to joint 9 of 1"));
}

/// Draco data with other counts than the accessors, and without attributes that the primitive names.
TEST_F(GltfTolerance, DracoDataDecides) {
    GltfBuilder b;
    add_grid(b, 4);
    for (const bool edgebreaker : {true, false}) {
        GltfBuilder packed = b;
        compress_by_draco(packed, packed.primitive(), {.edgebreaker = edgebreaker});
        const Scene good = load(packed);
        const std::string element = "meshes[0].primitives[0]: its Draco data has other numbers";
        for (const std::size_t vertices : {24, 3, 1, 26})
            for (const std::size_t corners : {96, 93, 3, 99}) {
                if (vertices == 25 && corners == 96) continue;
                GltfBuilder other = packed;
                for (int a = 0; a < 3; ++a) other.json["accessors"][a]["count"] = vertices;
                other.json["accessors"][3]["count"] = corners;
                expect_tolerated(other, element, good);
            }

        // Normals that the data lacks are made, or are those of the accessor.
        Scene flat = good;
        GltfBuilder without = packed;
        without.attributes().erase("NORMAL");
        flat = load(without);
        const auto place = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression/attributes";
        for (const bool named : {false, true}) {
            GltfBuilder lacks = packed;
            lacks.json[Json::json_pointer(place)]["NORMAL"] = 1000;
            if (!named) lacks.json[Json::json_pointer(place)].erase("NORMAL");
            expect_tolerated(lacks, "meshes[0].primitives[0]: its Draco data has no NORMAL, which is left out", flat);
        }
        if (edgebreaker) continue;
        GltfBuilder beside = packed;
        std::vector<float> up;
        for (int i = 0; i < 25; ++i) up.insert(up.end(), {0, 0, 1});
        beside.json[Json::json_pointer(place)]["NORMAL"] = 1000;
        beside.json["accessors"][1]["bufferView"] = beside.view(up);
        const Scene scene = load(beside);
        EXPECT_EQ(scene.meshes.at(0).normals.at(7), vec3(0, 0, 1));
        expect_warnings(scene.report.warnings, {"meshes[0].primitives[0]: its Draco data has no NORMAL, the accessor"});
        beside.json[Json::json_pointer(place)]["POSITION"] = 1000;
        EXPECT_EQ(refusal(beside), "meshes[0].primitives[0]: its Draco data has no POSITION");
    }
}

TEST_F(GltfTolerance, Containers) {
    GltfBuilder b = used();
    const std::string glb = b.glb();
    const auto expect = [&](const std::string& bytes, const std::string& warning) {
        const auto path = write("scene.glb", bytes);
        const Scene scene = load_gltf(path);
        EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
        expect_warnings(scene.report.warnings, {warning});
        EXPECT_NE(error_message([&] { load_gltf(path, {.strict = true}); }), "");
    };
    expect(glb + "trailing", "GLB header: 8 bytes follow its end");
    std::string zeros = glb, longer = glb;
    std::uint32_t json = 0, length = 0;
    std::memcpy(&json, &glb[12], 4);
    std::memcpy(&length, &glb[8], 4);
    while (zeros[20 + json - 1] == ' ') --json;
    const std::size_t padding = (4 - json % 4) % 4;
    if (padding == 0) b.json["asset"]["generator"] = "a", zeros = b.glb();
    std::memcpy(&json, &zeros[12], 4);
    for (std::size_t i = 20 + json; zeros[--i] == ' ';) zeros[i] = '\0';
    expect(zeros, "JSON: is padded with zeros");
    longer += "abc";
    length += 3;
    std::memcpy(&longer[8], &length, 4);
    expect(longer, "GLB header: 3 bytes are no chunk");
}

/// Warnings of one kind differ in numbers, too.
TEST_F(GltfTolerance, WarningsOfAKindAreOneLine) {
    GltfBuilder b = used();
    b.json.erase("buffers");
    for (int i = 0; i < 20; ++i) {
        const int input = b.floats("SCALAR", {0, 1}), output = b.floats("VEC3", {0, 0, 0, 1, 1, 1});
        b.json["bufferViews"][b.json["accessors"][output]["bufferView"].get<int>()]["byteStride"] = 12;
        b.push("materials", {{"normalTexture", {{"index", 50 + i}}}});
        b.animate(0, "translation", input, output);
    }
    expect_warnings(load(b).report.warnings, {"materials[1].normalTexture.index: 50 is not an index"});
    EXPECT_TRUE(load(b).report.warnings[0].ends_with("; nothing uses it (and 19 more)"));
    GltfScene moving = open(b);
    expect_warnings(moving.animation_warnings(), {"animations[0].samplers[0]: has a byteStride in bufferViews["});
    EXPECT_TRUE(moving.animation_warnings()[0].ends_with(" (and 19 more)"));
    const auto path = write("scene.glb", b.glb());
    EXPECT_NE(error_message([&] { GltfScene(path, {.strict = true}).animations(); }), "");
}

}  // namespace
}  // namespace halflight
