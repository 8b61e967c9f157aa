// Tests EXT_lights_ies: profiles by URI and buffer view, references of nodes, and damaged files.
#include "engine/core/memory_ledger.h"
#include "tests/support/ies_files.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfProfile = GltfTest;

GltfBuilder with_profiles(const Json& list, const Json& reference) {
    GltfBuilder b;
    b.add_triangle();
    b.json["extensions"]["EXT_lights_ies"]["lights"] = list;
    b.push("nodes", {{"name", "lamp"},
                     {"translation", {1, 2, 3}},
                     {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}},  // -Z becomes -Y
                     {"scale", {2, 2, 2}},
                     {"extensions", {{"EXT_lights_ies", reference}}}});
    b.require({"EXT_lights_ies"});
    return b;
}

TEST_F(GltfProfile, IsReadFromFilesAndBufferViews) {
    const std::string text = test::downlight().text();
    write("a lamp.ies", text);
    GltfBuilder b = with_profiles(Json::array(), {{"light", 1}, {"multiplier", 0.5}, {"color", {1, 0.5, 0}}});
    const int view = b.view(std::vector<char>(text.begin(), text.end()));
    b.json["extensions"]["EXT_lights_ies"]["lights"] = {
        {{"bufferView", view}, {"mimeType", "application/x-ies-lm-63"}, {"name", "inside"}}, {{"uri", "a%20lamp.ies"}}};
    b.push("nodes", {{"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}});
    const Scene scene = load(b);
    EXPECT_TRUE(scene.report.warnings.empty()) << scene.report.warnings[0];
    ASSERT_EQ(scene.lights.size(), 2u);
    ASSERT_EQ(scene.light_profiles.size(), 2u);
    EXPECT_EQ(scene.light_profiles[1].name, "a lamp.ies");
    EXPECT_EQ(scene.light_profiles[0].shares, scene.light_profiles[1].shares);
    const PunctualLight& lamp = scene.lights[0];
    EXPECT_EQ(lamp.name, "lamp");
    EXPECT_EQ(lamp.profile, 1);
    EXPECT_EQ(lamp.position, dvec3(1, 2, 3));
    EXPECT_LT(glm::distance(lamp.direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(glm::distance(lamp.right, vec3(1, 0, 0)), 1e-6f);
    EXPECT_LT(glm::distance(lamp.up, vec3(0, 0, -1)), 1e-6f);
    const float candela = scene.light_profiles[1].candela;
    EXPECT_FLOAT_EQ(candela, 40 + 3 * 810);
    EXPECT_LT(glm::distance(lamp.intensity, candela * vec3(0.5f, 0.25f, 0)), 1e-3f);
    EXPECT_EQ(scene.lights[1].name, "inside");
}

TEST_F(GltfProfile, TurnsAndMirrorsWithItsNode) {
    write("a.ies", test::washer().text());
    GltfBuilder b = with_profiles({{{"uri", "a.ies"}}}, {{"light", 0}});
    b.json["nodes"][1]["scale"] = {1, -1, 1};
    const Scene scene = load(b);
    EXPECT_LT(glm::distance(scene.lights[0].direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(glm::distance(scene.lights[0].right, vec3(1, 0, 0)), 1e-6f);
    EXPECT_LT(glm::distance(scene.lights[0].up, vec3(0, 0, 1)), 1e-6f);
}

TEST_F(GltfProfile, ReplacesTheLightOfItsNode) {
    write("a.ies", test::downlight().text());
    GltfBuilder b = with_profiles({{{"uri", "a.ies"}}}, {{"light", 0}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.json["nodes"][1]["extensions"]["KHR_lights_punctual"] = {{"light", 0}};
    b.require({"EXT_lights_ies", "KHR_lights_punctual"});
    const Scene scene = load(b);
    ASSERT_EQ(scene.lights.size(), 1u);
    EXPECT_EQ(scene.lights[0].profile, 0);
    expect_warnings(scene.report.warnings, {"nodes[1]: is a light twice"});
}

TEST_F(GltfProfile, IsSharedByElementsOfOneFile) {
    write("a.ies", test::downlight().text());
    GltfBuilder b = with_profiles({{{"uri", "a.ies"}}, {{"uri", "a.ies"}, {"name", "second"}}}, {{"light", 0}});
    b.push("nodes", {{"extensions", {{"EXT_lights_ies", {{"light", 1}}}}}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.light_profiles.size(), 1u);
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(scene.lights[0].profile, 0);
    EXPECT_EQ(scene.lights[1].profile, 0);
    EXPECT_EQ(scene.lights[1].name, "second");

    // Profiles count as memory.
    constexpr std::size_t kLarge = std::size_t{8} << 20;
    write("a.ies", test::downlight().text() + std::string(kLarge, ' '));
    MemoryLedger& memory = MemoryLedger::process();
    const std::size_t limit = memory.limit();
    memory.set_limit(limit - memory.free() + kLarge);
    const std::string message = refusal(b);
    memory.set_limit(limit);
    EXPECT_TRUE(message.starts_with("extensions.EXT_lights_ies.lights[0]: needs ")) << message;
}

TEST_F(GltfProfile, WithoutLightWarns) {
    test::IesFile file = test::downlight();
    file.candela = [](double, double) { return 0; };
    write("a.ies", file.text());
    const Scene scene = load(with_profiles({{{"uri", "a.ies"}}}, {{"light", 0}}));
    ASSERT_EQ(scene.lights.size(), 1u);
    EXPECT_EQ(scene.lights[0].intensity, vec3(0));
    expect_warnings(scene.report.warnings, {"extensions.EXT_lights_ies.lights[0]: has no light"});
}

TEST_F(GltfProfile, DamagedIsOneLine) {
    write("a.ies", test::downlight().text());
    const std::string text = test::downlight().text();
    write("cut.ies", text.substr(0, text.size() - 20));
    const GltfBuilder b = with_profiles({{{"uri", "a.ies"}}}, {{"light", 0}});
    const std::string lights = "extensions.EXT_lights_ies.lights[0]";
    expect_refused(b, {{"/extensions/EXT_lights_ies/lights/0/uri", "none.ies", lights},
                       {"/extensions/EXT_lights_ies/lights/0/uri", "cut.ies", lights + ": ends before candela value"},
                       {"/extensions/EXT_lights_ies/lights/0/uri", "../a.ies", lights},
                       {"/extensions/EXT_lights_ies/lights/0/uri", "data:,x", lights},
                       {"/extensions/EXT_lights_ies/lights/0/uri", kRemoved, lights + ": needs either"},
                       {"/extensions/EXT_lights_ies/lights/0/bufferView", 0, lights + ": needs either"},
                       {"/extensions/EXT_lights_ies/lights/0/bufferView", 9, lights + ".bufferView: 9"},
                       {"/nodes/1/extensions/EXT_lights_ies/light", 1, "nodes[1].extensions.EXT_lights_ies.light: 1"},
                       {"/nodes/1/extensions/EXT_lights_ies/color", {1, 1}, "nodes[1].extensions.EXT_lights_ies.color"},
                       {"/nodes/1/extensions/EXT_lights_ies/light", kRemoved, "nodes[1].extensions.EXT_lights_ies"}});
    GltfBuilder unused = b;  // of what nothing uses, nothing is read
    unused.json["extensions"]["EXT_lights_ies"]["lights"].push_back({{"uri", "none.ies"}});
    EXPECT_EQ(load(unused).lights.size(), 1u);
    GltfBuilder bright = b;
    bright.json["nodes"][1]["extensions"]["EXT_lights_ies"].update({{"multiplier", -1}, {"color", {2, 0, 0}}});
    const Scene scene = load(bright);
    EXPECT_EQ(scene.lights[0].intensity, vec3(0));
    expect_warnings(scene.report.warnings, {"nodes[1].extensions.EXT_lights_ies: multiplier"});
}

}  // namespace
}  // namespace halflight
