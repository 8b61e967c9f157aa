// Tests which parts of a frame are needed, given facts about scene and settings.
#include "renderer/needs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "renderer/settings_check.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

std::map<std::string, std::string> facts(const SceneNeeds& scene, const FrameOptions& options = {}) {
    std::map<std::string, std::string> facts;
    for (const LeftOut& part : left_out(scene, options, {10, 20, 256, 200})) facts[part.what] = part.fact;
    return facts;
}

using NameSet = std::set<std::string>;

NameSet names(const std::map<std::string, std::string>& facts) {
    NameSet names;
    for (const auto& [name, fact] : facts) names.insert(name);
    return names;
}

SceneNeeds plain_scene() {
    SceneNeeds scene;
    scene.diffuse = scene.emission = scene.area_lights = true;
    return scene;
}

TEST(SceneNeeds, NamesFlagsAndMacrosAreUnique) {
    std::set<std::string> names, defines;
    std::set<const bool*> flags;
    SceneNeeds needs;
    for (const SceneNeed& need : known_scene_needs()) {
        EXPECT_TRUE(names.insert(need.name).second) << need.name;
        EXPECT_TRUE(defines.insert(need.define).second) << need.define;
        EXPECT_TRUE(flags.insert(&(needs.*need.flag)).second) << need.name;
    }
    EXPECT_EQ(flags.size(), sizeof(SceneNeeds)) << "every flag has a reason";
}

TEST(SceneNeeds, UnionsAreComplete) {
    SceneNeeds coat_map;
    coat_map.clearcoat_normal_texture = true;
    const SceneNeeds all = united(plain_scene(), coat_map);
    EXPECT_TRUE(all.diffuse && all.clearcoat && all.glossy && all.normal_maps && all.texture_coordinates);
    EXPECT_FALSE(all.transmission || all.environment);
    SceneNeeds brushed;
    brushed.anisotropy = true;
    EXPECT_TRUE(united({}, brushed).normal_maps && united({}, brushed).glossy);
    SceneNeeds tree;
    tree.light_tree = true;
    EXPECT_TRUE(united(plain_scene(), tree).light_choice);
    EXPECT_EQ(united(plain_scene(), {}), plain_scene());
    const SceneNeeds kept = kept_needs(Kept::everything());
    EXPECT_EQ(united(kept, plain_scene()), kept);
}

TEST(FrameNeeds, FollowFromTheScene) {
    const FrameNeeds plain = frame_needs(plain_scene(), {});
    EXPECT_TRUE(plain.shadow && plain.diffuse && plain.continuation && plain.later_light && plain.tiles);
    EXPECT_FALSE(plain.glossy || plain.reuse || plain.squares || plain.camera_hits);
    SceneNeeds unlit = plain_scene();
    unlit.area_lights = false;
    const FrameNeeds by_paths = frame_needs(unlit, {});
    EXPECT_FALSE(by_paths.shadow || by_paths.later_light);
    EXPECT_TRUE(by_paths.diffuse && by_paths.continuation) << "paths may end at emissive surfaces";
    unlit.emission = false;
    EXPECT_FALSE(frame_needs(unlit, {}).continuation) << "there is no light";
    SceneNeeds black = plain_scene();
    black.diffuse = false;
    EXPECT_FALSE(frame_needs(black, {}).shadow || frame_needs(black, {}).camera_rays) << "nothing reflects light";
}

TEST(FrameNeeds, FollowFromTheSettings) {
    const auto needs = [](const FrameOptions& options) { return frame_needs(plain_scene(), options); };
    const FrameNeeds none = needs({.bounces = 0, .kept = Kept::everything()});
    EXPECT_FALSE(none.shadow || none.diffuse || none.glossy || none.continuation || none.later_light);
    EXPECT_FALSE(needs({.bounces = 1}).later_light);
    EXPECT_TRUE(needs({.group_size = 16}).reuse);
    EXPECT_FALSE(needs({.bounces = 1, .group_size = 16}).reuse);
    EXPECT_FALSE(needs({.kept = Kept::everything()}).reuse || needs({.kept = Kept::everything()}).radiance_cache);
    EXPECT_TRUE(needs({.radiance_cache = true}).radiance_cache);
    EXPECT_FALSE(needs({.bounces = 1, .radiance_cache = true}).radiance_cache);
    SceneNeeds mirrors = plain_scene();
    mirrors.diffuse = false, mirrors.glossy = true;
    EXPECT_FALSE(frame_needs(mirrors, {.group_size = 16}).reuse);
    EXPECT_TRUE(needs({.want_squares = true}).squares);
    EXPECT_FALSE(needs({.culling = rays::Culling::off}).tiles);
    EXPECT_FALSE(needs({.runs = 4}).tiles);
    EXPECT_TRUE(needs({.runs = 5}).tiles);
    EXPECT_FALSE(needs({.runs = 64, .native = true}).tiles);
    EXPECT_TRUE(needs({.runs = 65, .native = true}).tiles);
    EXPECT_TRUE(needs({.culling = rays::Culling::compute, .runs = 4}).tiles);
    EXPECT_FALSE(needs({.show_lamps = true}).shown_lamps) << "no lamp has a size";
    SceneNeeds lamps = plain_scene();
    lamps.sized_suns = true;
    EXPECT_FALSE(frame_needs(lamps, {}).shown_lamps);
    const FrameNeeds shown = frame_needs(lamps, {.bounces = 0, .show_lamps = true});
    EXPECT_TRUE(shown.shown_lamps && shown.camera_rays && shown.camera_hits) << "they are seen without bounces, too";
}

TEST(FrameNeeds, ChainsNeedMirrorsAndTheDenoiser) {
    SceneNeeds mirrors = plain_scene();
    EXPECT_FALSE(frame_needs(mirrors, {.denoise = true}).chains) << "no lobe is sharp";
    mirrors.glossy = mirrors.sharp = true;
    EXPECT_TRUE(frame_needs(mirrors, {.denoise = true}).chains);
    EXPECT_FALSE(frame_needs(mirrors, {}).chains || frame_needs(mirrors, {.bounces = 0, .denoise = true}).chains);
    const FrameNeeds kept = frame_needs(plain_scene(), {.kept = Kept({"surfaces seen in mirrors"})});
    EXPECT_TRUE(kept.chains && kept.features && kept.halves);
    EXPECT_GT(kept.halves.path_bytes, frame_needs(plain_scene(), {.denoise = true}).halves.path_bytes);
}

TEST(FrameNeeds, EverythingCanBeKept) {
    const FrameOptions all{.denoise = true,
                           .adaptive = true,
                           .runs = 1,
                           .kept = Kept::everything(),
                           .light_groups = 2,
                           .group_size = 16,
                           .camera_rays = 4,
                           .lens = true,
                           .optics = true,
                           .show_lamps = true,
                           .preview = {.temporal = true, .filter = true}};
    for (const FramePart& part : frame_needs({}, all).parts())
        EXPECT_NE(bool(part), part.name == std::string("radiance cache")) << part.name;
    EXPECT_EQ(names(facts({}, all)),
              (NameSet{"environment map", "every light", "light tree", "radiance cache", "sun apart",
                       "double precision for slivers", "mip levels", "shadow catchers", "light straight through solids",
                       "light links", "shadow links"}));
}

/// Returns the items that are needed in addition if one item is kept.
NameSet brought_along(const SceneNeeds& scene, const std::string& item) {
    NameSet all = names(facts(scene, {.runs = 1}));
    const NameSet rest = names(facts(scene, {.runs = 1, .kept = Kept({item})}));
    EXPECT_TRUE(all.erase(item) == 1 && !rest.contains(item)) << item;
    std::erase_if(all, [&](const std::string& name) { return rest.contains(name); });
    return all;
}

TEST(LeftOut, ItemsAreKeptIndependently) {
    const SceneNeeds lit = plain_scene(), nothing;
    for (const char* alone : {"tile lists", "sums of squares", "clamp of indirect light", "vertex colours", "glossy",
                              "alpha tests", "instance transforms", "texture coordinates"})
        EXPECT_EQ(brought_along(lit, alone), NameSet{}) << alone;
    const std::tuple<SceneNeeds, const char*, NameSet> others[] = {
        {lit, "glossy lobe", {"glossy"}},
        {lit, "tangents", {"texture coordinates"}},
        {lit, "coat normal maps", {"clearcoat", "glossy", "glossy lobe", "tangents", "texture coordinates"}},
        {lit, "spot cones", {"punctual lights"}},
        {nothing, "camera rays", {}},
        {nothing, "shadow", {"camera rays"}},
        {nothing, "tile lists", {"camera rays", "shadow"}},
        {nothing, "glossy", {"camera rays", "continuation"}},
        {nothing, "continuation", {"camera rays", "diffuse"}},
        {nothing, "light samples along paths", {"camera rays", "continuation", "diffuse"}}};
    for (const auto& [scene, item, along] : others) EXPECT_EQ(brought_along(scene, item), along) << item;
}

TEST(LeftOut, ListsWhatCanBeKept) {
    const std::vector<std::string> list = keepable_names();
    const NameSet keepable(list.begin(), list.end()), all = names(facts({}, {.runs = 1}));
    EXPECT_EQ(list.size(), keepable.size()) << "no name stands for two items";
    EXPECT_TRUE(std::ranges::includes(all, keepable));
    for (const std::string& name : all)
        EXPECT_NE(facts({}, {.runs = 1, .kept = Kept({name})}).contains(name), keepable.contains(name)) << name;
    for (const char* never : {"environment map", "light tree", "path reuse", "denoiser", "shadow catchers"})
        EXPECT_TRUE(all.contains(never) && !keepable.contains(never)) << never;
    RenderSettings settings;
    settings.kept = Kept({list.begin(), list.end()});
    EXPECT_NO_THROW(check_settings(settings));
    settings.kept = Kept({"light tree", "shadow"});
    expect_refusal([&] { check_settings(settings); }, "render settings: cannot keep 'light tree'");
    EXPECT_EQ(Kept().text(), "nothing");
    EXPECT_EQ(Kept::everything().text(), "everything");
    EXPECT_EQ(Kept({"vertex colours", "alpha tests"}).text(), "alpha tests,vertex colours");
}

TEST(LeftOut, ListsFactsAndBytes) {
    const auto plain = facts(plain_scene());
    for (const char* name :
         {"glossy", "alpha tests", "sums of squares", "sums of albedo and normal", "hits of camera rays",
          "camera rays for light alone", "clamp of indirect light", "unlit surfaces", "projections and eyes"})
        EXPECT_NE(plain.at(name), "") << name;
    EXPECT_FALSE(plain.contains("shadow") || plain.contains("area lights") || plain.contains("rasterization"));
    std::map<std::string, std::size_t> bytes;
    for (const LeftOut& l : left_out(plain_scene(), {}, {10, 20, 256, 200})) bytes[l.what] = l.bytes;
    EXPECT_EQ(bytes.at("vertex colours"), 10u * 16);
    EXPECT_EQ(bytes.at("texture coordinates"), 10u * 16);
    EXPECT_EQ(bytes.at("sums of squares"), 256u * 24);
    EXPECT_EQ(bytes.at("clearcoat"), 256u * 16);
    EXPECT_EQ(bytes.at("temporal accumulation"), 200u * 9 * 16);
    const auto temporal = facts(plain_scene(), {.preview = {.temporal = true}});
    EXPECT_TRUE(!temporal.contains("temporal accumulation") && temporal.contains("filter of noise"));
    const auto filtered = facts(plain_scene(), {.preview = {.filter = true}});
    EXPECT_FALSE(filtered.contains("filter of noise") || filtered.contains("sums of half the samples"));
    EXPECT_TRUE(filtered.contains("sums of squares") && filtered.contains("surfaces seen in mirrors"));
    const auto curved = facts(plain_scene(), {.primary = PrimaryVisibility::traced, .optics = true});
    EXPECT_TRUE(curved.contains("rasterization") && !curved.contains("projections and eyes"));
}

}  // namespace
}  // namespace halflight
