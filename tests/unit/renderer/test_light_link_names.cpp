// Tests light links by name: which objects they have, their texts, and the tables of lights.
#include <gtest/gtest.h>

#include "api/halflight/edit_text.h"
#include "api/halflight/settings_file.h"
#include "engine/tables/lights.h"
#include "engine/tables/tables.h"
#include "shaders/shared/light_links.h"
#include "tests/support/scenes.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

/// Two lamps, one below a rig with a screen, a crate with a lid, and two floors of one name.
struct LinkStage {
    Scene scene;
    SceneTree tree;
    LinkStage() {
        scene.name = "stage";
        for (const char* name : {"glow", "wood"})
            scene.materials.emplace_back(test::diffuse_material(vec3(0.5f))).name = name;
        scene.materials[0].emission = vec3(2);
        tree.nodes = {{"rig", kNone},   {"lamp a", 0}, {"screen", 0},    {"lamp b", kNone},
                      {"crate", kNone}, {"lid", 4},    {"floor", kNone}, {"floor", kNone}};
        tree.light_nodes = {1, 3};
        const std::pair<const char*, int> objects[] = {
            {"screen", 2}, {"crate", 4}, {"lid", 5}, {"floor", 6}, {"floor", 7}};
        for (const auto& [name, node] : objects) {
            test::add_quad(scene, node == 2 ? 0 : 1, vec3(0), {1, 0, 0}, {0, 1, 0});
            scene.instances.back().name = scene.meshes.back().name = name;
            scene.instances.back().node = node;
        }
        for (const char* name : {"lamp a", "lamp b"}) scene.lights.emplace_back().name = name;
        scene.environment.color = vec3(1);
    }
    Scene with(std::initializer_list<const char*> lights, std::initializer_list<const char*> shadows = {},
               bool ground = false) const {
        SceneEdits edits;
        for (const char* link : lights) add_light_link(edits, "--light-link", link);
        for (const char* link : shadows) add_shadow_link(edits, "--shadow-link", link);
        edits.ground = ground;
        Scene edited = scene;
        apply(edits, edited, tree);
        return edited;
    }
};

/// Returns which instances are in a mask: "x" or "-" for each.
std::string objects_in(const Scene& scene, std::uint64_t mask) {
    std::string objects;
    for (const Instance& i : scene.instances) objects += ((mask >> i.link_class) & 1) != 0 ? "x" : "-";
    return objects;
}

TEST(LightLinkNames, FindObjectsInTheirOrder) {
    const LinkStage stage;
    const auto lit = [&](const char* link) {
        const Scene s = stage.with({link});
        return objects_in(s, s.lights[1].links.receivers);
    };
    EXPECT_EQ(lit("lamp b=crate"), "-xx--");
    EXPECT_EQ(lit("lamp b=-crate"), "x--xx");
    EXPECT_EQ(lit("lamp b=-node:crate,mesh:lid"), "x-xxx");
    EXPECT_EQ(lit("lamp b=crate,-lid"), "-x---");
    EXPECT_EQ(lit("lamp b=-lid,crate"), "xxxxx");
    EXPECT_EQ(lit("lamp b=floor"), "---xx") << "both of this name";
    EXPECT_EQ(lit("lamp b=node:7"), "----x");
    EXPECT_EQ(lit("lamp b=*,-s*,-l?d"), "-x-xx");
    EXPECT_EQ(lit("lamp a=screen"), "xxxxx") << "the other lamp is not linked";
}

TEST(LightLinkNames, FindLightsOfAllKinds) {
    const LinkStage stage;
    const Scene s = stage.with({"lamp*=-crate", "lamp b=-floor"}, {"rig=-screen", "environment=lid", "glow=crate"});
    EXPECT_EQ(objects_in(s, s.lights[0].links.receivers), "x--xx");
    EXPECT_EQ(objects_in(s, s.lights[1].links.receivers), "x----") << "objects that are in all links";
    EXPECT_EQ(objects_in(s, s.lights[0].links.blockers), "-xxxx");
    EXPECT_EQ(objects_in(s, s.lights[1].links.blockers), "xxxxx");
    EXPECT_EQ(objects_in(s, s.instances[0].links.blockers), "-xxxx");
    EXPECT_EQ(objects_in(s, s.materials[0].links.blockers), "-xx--");
    EXPECT_EQ(objects_in(s, s.environment.links.blockers), "--x--");
    EXPECT_EQ(objects_in(s, s.environment.links.receivers), "xxxxx");
    EXPECT_EQ(s.materials[1].links, LightLinks());
    EXPECT_EQ(passed_classes(stage.scene), 0u);
    EXPECT_EQ(objects_in(s, passed_classes(s)), "xx-xx");
    EXPECT_EQ(stage.with({"lamp a=*"}).lights[0].links, LightLinks()) << "a link that leaves nothing out is none";
}

TEST(LightLinkNames, HaveTheGround) {
    const LinkStage stage;
    const auto lit = [&](const char* link) {
        const Scene s = stage.with({link}, {}, true);
        return objects_in(s, s.lights[0].links.receivers);
    };
    EXPECT_EQ(lit("lamp a=-ground"), "xxxxx-");
    EXPECT_EQ(lit("lamp a=lid,ground"), "--x--x");
    EXPECT_EQ(lit("lamp a=lid"), "--x---");
    EXPECT_EQ(lit("lamp a=-lid"), "xx-xxx");
    expect_refusal([&] { stage.with({"lamp a=-ground"}); }, "'ground'", "--light-link: stage: ");
}

TEST(LightLinkNames, ReplaceEarlierOnesOfTheSameLight) {
    SceneEdits edits;
    add_light_link(edits, "", "lamp a=-crate");
    add_light_link(edits, "", "lamp a=lid,-node:x");
    ASSERT_EQ(edits.light_links.size(), 1u);
    EXPECT_EQ(edits.light_links[0].objects, (std::vector<std::string>{"lid", "-node:x"}));
    SavedSettings s;
    s.edits = edits;
    add_shadow_link(s.edits, "", "environment=-floor");
    const SceneEdits read = parse_settings(settings_text(s, ""), "file").edits;
    EXPECT_EQ(read, s.edits);
    EXPECT_EQ(read.light_links[0].source, "file: light_links");
}

TEST(LightLinkNames, RefusalsNameOptionAndElement) {
    const LinkStage stage;
    for (const char* text : {"lamp a", "=lid", "lamp a=", "lamp a=-", "lamp a=lid,", "lamp a=node:"}) {
        SceneEdits edits;
        expect_refusal([&] { add_light_link(edits, "--light-link", text); }, text, "--light-link: ");
    }
    const std::pair<const char*, const char*> wrong[] = {
        {"lamp c=lid", "'lamp c'"}, {"lamp a=-lyd", "'lyd'"}, {"lamp a=lamp b", "'lamp b' has no surface"}};
    for (const auto& [link, element] : wrong) {
        expect_refusal([&, &link = link] { stage.with({link}); }, element, "--light-link: stage: ");
        expect_refusal([&, &link = link] { stage.with({}, {link}); }, element, "--shadow-link: stage: ");
    }
    LinkStage many;
    SceneEdits edits;
    for (int i = 0; i < 70; ++i) {
        const std::string name = fmt::format("crate {}", i);
        test::add_quad(many.scene, 1, vec3(0), {1, 0, 0}, {0, 1, 0});
        many.scene.meshes.back().name = name;
        add_light_link(edits, "--light-link", fmt::format("light:{}=-{}", i % 2, name));
        edits.light_links.back().light = fmt::format("{}{}", "lamp ?", std::string(std::size_t(i), '*'));
    }
    expect_refusal([&] { apply(edits, many.scene, many.tree); }, "more than 64 classes", "--light-link: stage: ");
}

TEST(LightLinkNames, TablesHaveSetsAndClasses) {
    const Scene s = LinkStage().with({"lamp b=-crate"}, {"lamp b=-lid"});
    const TraceTables trace = build_trace_tables(s);
    const LightTables lights = build_lights(s, trace);
    EXPECT_TRUE(lights.needs.light_links && lights.needs.shadow_links);
    EXPECT_TRUE(trace.alpha_tested);
    ASSERT_EQ(lights.links[0].x, 3u) << "two sets";
    const std::size_t count = lights.groups.size();
    EXPECT_EQ(lights.groups[count - 3] >> shared::kLightGroupBits, 0u) << "lamp a";
    EXPECT_EQ(lights.groups[count - 2] >> shared::kLightGroupBits, 1u) << "lamp b";
    EXPECT_EQ(lights.groups[count - 1] >> shared::kLightGroupBits, 0u) << "environment";
    const auto class_at = [&](std::uint32_t t) {
        return (lights.links[3 + t / 16][int(t % 16 / 4)] >> (8 * (t % 4))) & 0xff;
    };
    for (const MeshRange& range : trace.ranges)
        for (std::uint32_t t = range.first_triangle; t < range.first_triangle + range.triangle_count; ++t) {
            EXPECT_EQ(class_at(t), s.instances[range.instance].link_class);
            EXPECT_EQ((trace.triangles[t].w & kTriangleAlpha) != 0, range.instance == 2) << "the lid lets light pass";
        }
    // Instances that share a mesh have classes of their own, and one that light passes marks the mesh.
    Scene sharing = s;
    sharing.instances[2].mesh = sharing.instances[1].mesh;
    const TraceTables shared = build_trace_tables(sharing);
    ASSERT_EQ(shared.instances.size(), 3u);
    const std::vector<uvec4> links = build_lights(sharing, shared).links;
    for (std::uint32_t i = 0; i < 3; ++i) {
        const auto at = static_cast<std::uint32_t>(shared.triangles.size()) + i;
        EXPECT_EQ((links[3 + at / 16][int(at % 16 / 4)] >> (8 * (at % 4))) & 0xff,
                  i == 0 ? 0u : sharing.instances[shared.instances[i].scene_instance].link_class);
    }
    const MeshRange& range = shared.ranges.back();
    EXPECT_TRUE(!range.merged && (shared.triangles[range.first_triangle].w & kTriangleAlpha) != 0);
    const LightTables none = build_lights(LinkStage().scene, build_trace_tables(LinkStage().scene));
    EXPECT_TRUE(none.links.empty() && none.groups.empty() && !none.needs.light_links);
}

}  // namespace
}  // namespace halflight
