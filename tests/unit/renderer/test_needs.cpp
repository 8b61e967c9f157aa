// Tests which parts of a frame are needed, given facts about scene and settings.
#include "renderer/needs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "renderer/settings_check.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

std::map<std::string, std::string> facts(const SceneNeeds& scene, const FrameOptions& options = {}) {
    std::map<std::string, std::string> facts;
    for (const LeftOut& part : left_out(scene, options, {10, 20, 256, 200})) facts[part.what] = part.fact;
    return facts;
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
    EXPECT_FALSE(plain.glossy);
    SceneNeeds unlit = plain_scene();
    unlit.area_lights = false;
    const FrameNeeds by_paths = frame_needs(unlit, {});
    EXPECT_FALSE(by_paths.shadow || by_paths.later_light);
    EXPECT_STREQ(by_paths.shadow.left_out, "there is no light to sample");
    EXPECT_TRUE(by_paths.diffuse && by_paths.continuation) << "paths may end at emissive surfaces";
    unlit.emission = false;
    EXPECT_STREQ(frame_needs(unlit, {}).continuation.left_out, "there is no light");
    SceneNeeds black = plain_scene();
    black.diffuse = false;
    EXPECT_STREQ(frame_needs(black, {}).shadow.left_out, "no material reflects light");
    EXPECT_FALSE(frame_needs(black, {}).camera_rays);
}

TEST(FrameNeeds, FollowFromTheSettings) {
    const FrameNeeds none = frame_needs(plain_scene(), {.bounces = 0, .kept = Kept::everything()});
    for (const FramePart& part : {none.shadow, none.diffuse, none.glossy, none.continuation, none.later_light})
        EXPECT_STREQ(part.left_out, "there are no bounces") << part.name;
    EXPECT_FALSE(frame_needs(plain_scene(), {.bounces = 1}).later_light);
    EXPECT_FALSE(frame_needs(plain_scene(), {}).reuse);
    EXPECT_TRUE(frame_needs(plain_scene(), {.group_size = 16}).reuse);
    EXPECT_STREQ(frame_needs(plain_scene(), {.bounces = 1, .group_size = 16}).reuse.left_out, "there is one bounce");
    EXPECT_FALSE(frame_needs(plain_scene(), {.kept = Kept::everything()}).radiance_cache);
    EXPECT_TRUE(frame_needs(plain_scene(), {.radiance_cache = true}).radiance_cache);
    EXPECT_STREQ(frame_needs(plain_scene(), {.bounces = 1, .radiance_cache = true}).radiance_cache.left_out,
                 "there is one bounce");
    EXPECT_STREQ(frame_needs(plain_scene(), {.kept = Kept::everything()}).reuse.left_out, "path reuse is off");
    SceneNeeds mirrors = plain_scene();
    mirrors.diffuse = false, mirrors.glossy = true;
    EXPECT_FALSE(frame_needs(mirrors, {.group_size = 16}).reuse);
    EXPECT_FALSE(frame_needs(plain_scene(), {}).squares);
    EXPECT_TRUE(frame_needs(plain_scene(), {.want_squares = true}).squares);
    EXPECT_FALSE(frame_needs(plain_scene(), {}).camera_hits);
    EXPECT_FALSE(frame_needs(plain_scene(), {.culling = rays::Culling::off}).tiles);
    EXPECT_FALSE(frame_needs(plain_scene(), {.runs = 4}).tiles);
    EXPECT_TRUE(frame_needs(plain_scene(), {.runs = 5}).tiles);
    EXPECT_FALSE(frame_needs(plain_scene(), {.runs = 64, .native = true}).tiles);
    EXPECT_TRUE(frame_needs(plain_scene(), {.runs = 65, .native = true}).tiles);
    EXPECT_TRUE(frame_needs(plain_scene(), {.culling = rays::Culling::compute, .runs = 4}).tiles);
}

TEST(FrameNeeds, ChainsNeedMirrorsAndTheDenoiser) {
    const char* name = "surfaces seen in mirrors";
    SceneNeeds mirrors = plain_scene();
    EXPECT_EQ(facts(mirrors, {.denoise = true})[name], "no lobe has a roughness of 0.1 or less");
    mirrors.glossy = mirrors.sharp = true;
    EXPECT_FALSE(facts(mirrors, {.denoise = true}).contains(name));
    EXPECT_EQ(facts(mirrors)[name], "no denoising was requested");
    EXPECT_EQ(facts(mirrors, {.bounces = 0, .denoise = true})[name], "there are no bounces");
    const FrameNeeds kept = frame_needs(plain_scene(), {.kept = Kept({name})});
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
                           .preview = {.temporal = true, .filter = true}};
    for (const FramePart& part : frame_needs({}, all).parts())
        EXPECT_NE(bool(part), part.name == std::string("radiance cache")) << part.name;
    EXPECT_EQ(facts({}, all),
              (std::map<std::string, std::string>{
                  {"environment map", "the environment is of one colour"},
                  {"every light", "there is one light or there are too many, or another choice was asked for"},
                  {"light tree", "there are no two lights for it, or another choice was asked for"},
                  {"radiance cache", "its preview mode is off"},
                  {"sun apart", "there is no directional light beside others, or another choice was asked for"},
                  {"double precision for slivers", "no triangle is more than 2000 times as long as high"},
                  {"mip levels", "no texture has any (--texture-lod)"},
                  {"shadow catchers", "no object is one"}}));
}

/// Returns the items that are needed in addition if one item is kept.
std::set<std::string> brought_along(const SceneNeeds& scene, const std::string& item) {
    const auto all = facts(scene, {.runs = 1}), rest = facts(scene, {.runs = 1, .kept = Kept({item})});
    EXPECT_TRUE(all.contains(item) && !rest.contains(item)) << item;
    std::set<std::string> names;
    for (const auto& [name, fact] : all)
        if (name != item && !rest.contains(name)) names.insert(name);
    return names;
}

TEST(LeftOut, ItemsAreKeptIndependently) {
    using Names = std::set<std::string>;
    const SceneNeeds lit = plain_scene();
    for (const char* alone : {"tile lists", "sums of squares", "clamp of indirect light", "vertex colours", "glossy",
                              "alpha tests", "instance transforms", "texture coordinates"})
        EXPECT_EQ(brought_along(lit, alone), Names{}) << alone;
    EXPECT_EQ(brought_along(lit, "glossy lobe"), Names{"glossy"});
    EXPECT_EQ(brought_along(lit, "tangents"), Names{"texture coordinates"});
    EXPECT_EQ(brought_along(lit, "coat normal maps"),
              (Names{"clearcoat", "glossy", "glossy lobe", "tangents", "texture coordinates"}));
    EXPECT_EQ(brought_along(lit, "spot cones"), Names{"punctual lights"});

    const SceneNeeds nothing;
    EXPECT_EQ(brought_along(nothing, "camera rays"), Names{});
    EXPECT_EQ(brought_along(nothing, "shadow"), Names{"camera rays"});
    EXPECT_EQ(brought_along(nothing, "tile lists"), (Names{"camera rays", "shadow"}));
    EXPECT_EQ(brought_along(nothing, "glossy"), (Names{"camera rays", "continuation"}));
    EXPECT_EQ(brought_along(nothing, "continuation"), (Names{"camera rays", "diffuse"}));
    EXPECT_EQ(brought_along(nothing, "light samples along paths"), (Names{"camera rays", "continuation", "diffuse"}));
}

TEST(LeftOut, ListsWhatCanBeKept) {
    std::set<std::string> expected;
    for (const auto& [name, fact] : facts({}, {.runs = 1})) expected.insert(name);
    for (const char* never :
         {"environment map", "light tree", "every light", "sun apart", "double precision for slivers", "mip levels",
          "path reuse", "radiance cache", "camera rays for light alone", "lens", "projections and eyes", "light groups",
          "temporal accumulation", "filter of noise", "adaptive sampling", "denoiser", "shadow catchers"})
        EXPECT_EQ(expected.erase(never), 1u);
    const std::vector<std::string> names = keepable_names();
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), expected);
    EXPECT_EQ(names.size(), expected.size()) << "no name stands for two items";
    EXPECT_EQ(facts({}, {.kept = Kept({"light tree"})}), facts({}));
    RenderSettings settings;
    settings.kept = Kept({names.begin(), names.end()});
    EXPECT_NO_THROW(check_settings(settings));
    settings.kept = Kept({"light tree", "shadow"});
    EXPECT_TRUE(error_message([&] {
                    check_settings(settings);
                }).starts_with("render settings: cannot keep 'light tree'; `halflight info SCENE --needs` lists "));
    EXPECT_EQ(Kept().text(), "nothing");
    EXPECT_EQ(Kept::everything().text(), "everything");
    EXPECT_EQ(Kept({"vertex colours", "alpha tests"}).text(), "alpha tests,vertex colours");
}

TEST(LeftOut, ListsFactsAndBytes) {
    const auto plain = facts(plain_scene());
    EXPECT_EQ(plain.at("glossy"), "no material has a specular, coat, sheen or transmission component");
    EXPECT_EQ(plain.at("alpha tests"), "alpha decides no hit");
    EXPECT_FALSE(plain.contains("shadow") || plain.contains("area lights"));
    const auto all = left_out(plain_scene(), {}, {10, 20, 256, 200});
    const auto bytes = [&](const std::string& what) {
        return std::find_if(all.begin(), all.end(), [&](const LeftOut& l) { return l.what == what; })->bytes;
    };
    EXPECT_EQ(bytes("vertex colours"), 10u * 16);
    EXPECT_EQ(bytes("texture coordinates"), 10u * 16);
    EXPECT_EQ(bytes("sums of squares"), 256u * 24);
    EXPECT_EQ(bytes("clearcoat"), 256u * 16);
    EXPECT_EQ(bytes("temporal accumulation"), 200u * 9 * 16);
    EXPECT_FALSE(facts(plain_scene(), {.preview = {.temporal = true}}).contains("temporal accumulation"));
    EXPECT_EQ(facts(plain_scene(), {.preview = {.temporal = true}})["filter of noise"], "its preview mode is off");
    const auto filtered = facts(plain_scene(), {.preview = {.filter = true}});
    EXPECT_FALSE(filtered.contains("filter of noise") || filtered.contains("sums of half the samples"));
    EXPECT_TRUE(filtered.contains("sums of squares") && filtered.contains("surfaces seen in mirrors"));
    EXPECT_EQ(plain.at("sums of squares"), "no variance was requested");
    EXPECT_EQ(plain.at("sums of albedo and normal"), "neither albedo nor normal was requested");
    EXPECT_EQ(plain.at("hits of camera rays"), "neither mattes nor light groups were requested");
    EXPECT_EQ(plain.at("camera rays for light alone"), "there is one camera ray per sample");
    EXPECT_EQ(plain.at("clamp of indirect light"), "no clamp is set");
    EXPECT_EQ(bytes("unlit surfaces"), 0u);
    EXPECT_EQ(plain.at("projections and eyes"), "neither another projection nor stereo was requested");
    EXPECT_FALSE(plain.contains("rasterization"));
    const auto curved = facts(plain_scene(), {.primary = PrimaryVisibility::traced, .optics = true});
    EXPECT_EQ(curved.at("rasterization"), "no rasterizer draws the projection or the eyes");
    EXPECT_FALSE(curved.contains("projections and eyes"));
}

}  // namespace
}  // namespace halflight
