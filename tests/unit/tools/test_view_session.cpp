// Tests how a session reacts to mouse, keys and files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <thread>

#include "api/halflight/edit_text.h"
#include "engine/io/exr.h"
#include "engine/paging/pages.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/environment_variable.h"
#include "tests/support/error_message.h"
#include "tests/unit/tools/view_scenes.h"
#include "tools/view/navigation.h"
#include "tools/view/view_history.h"

namespace halflight::view {
namespace {

class ViewSession : public CornellSession {
  protected:
    double distance() const { return glm::length(session.pose().at - session.pose().from); }
    void steer(const Input& input) { navigation.steer(session, input, kSize); }
    /// Returns the surface that is visible at a pixel.
    auto picked(const dvec2& pixel) const {
        return Picker(session.shared_scene()).pick(ray_through(session.camera(), pixel, kSize));
    }

    Navigation navigation;
};

TEST_F(ViewSession, TheScenesCameraIsExactUntilItMoves) {
    ASSERT_EQ(session.scene_camera(), 0u);
    EXPECT_EQ(session.camera().camera_to_world, session.scene().cameras[0].camera_to_world);
    EXPECT_LT(glm::length(session.pose().at - picked({256, 256}).value().position), 1e-6) << "orbits the middle";
    const Request before = session.request(kSize);
    steer({});
    EXPECT_TRUE(session.request(kSize) == before) << "nothing has happened";
    EXPECT_EQ(std::get<std::string>(session.saved(kSize).camera), session.scene().cameras[0].name);
    steer({.drag = {0.1, 0}, .left = true});
    EXPECT_FALSE(session.scene_camera());
    EXPECT_FALSE(session.request(kSize) == before);
    EXPECT_EQ(std::get<CameraPose>(session.saved(kSize).camera), session.pose());
    session.reset_camera();
    EXPECT_TRUE(session.request(kSize) == before);
}

TEST_F(ViewSession, TheLensFocusesOnThePickedSurface) {
    const Camera pinhole = session.camera_with_lens();
    EXPECT_FALSE(pinhole.lens.blurs());
    const dvec3 point = picked({100, 300}).value().position;
    session.focus_lens({100, 300}, kSize);
    const Lens lens = session.request(kSize).camera.lens;
    const dmat4& m = pinhole.camera_to_world;
    EXPECT_EQ(lens.fstop, 2.8f);
    EXPECT_DOUBLE_EQ(lens.focus.distance, -glm::dot(point - dvec3(m[3]), dvec3(m[2])));
    EXPECT_TRUE(session.transform.metered()) << "depth of field leaves the exposure alone";
    // The lens stays when the camera moves, and the settings file holds it.
    steer({.drag = {0.1, 0}, .left = true});
    EXPECT_EQ(session.request(kSize).camera.lens, lens);
    EXPECT_EQ(session.saved(kSize).settings.view.camera.lens.focus, lens.focus);
    EXPECT_TRUE(session.saved(kSize).given.contains("focus"));
    // The ray beside the box meets nothing.
    CameraPose away = session.pose();
    away.at = away.from + (away.from - away.at);
    session.move(away);
    session.focus_lens({256, 256}, kSize);
    EXPECT_TRUE(std::isinf(session.request(kSize).camera.lens.focus.distance));
    // An orthographic camera has no focal length, so it shows a pinhole until it gets an aperture.
    away.orthographic = true;
    session.move(away);
    EXPECT_FALSE(session.request(kSize).camera.lens.blurs());
    session.focus_lens({256, 256}, kSize);
    EXPECT_TRUE(session.request(kSize).camera.lens.blurs());
}

TEST_F(ViewSession, DepthOfFieldLeavesTheExposureAndKeepsItsFocus) {
    session.set_depth_of_field(true);
    session.focus_lens({100, 300}, kSize);
    session.transform.camera.lens.fstop = 4;
    const PhysicalCamera before = session.transform.camera;
    session.set_depth_of_field(false);
    EXPECT_FALSE(session.request(kSize).camera.lens.blurs());
    EXPECT_FALSE(session.transform.camera.exposes()) << "the f-number has become an exposure";
    session.set_depth_of_field(true);
    EXPECT_EQ(session.transform.camera, before);
    // An f-number that sets the exposure still does so when depth of field is switched on and off.
    session.transform.camera = {};
    session.transform.camera.lens.fstop = 8;
    const float stops = session.transform.stops();
    for (const bool on : {true, false, true}) {
        session.set_depth_of_field(on);
        EXPECT_EQ(session.request(kSize).camera.lens.blurs(), on);
        EXPECT_EQ(session.transform.stops(), stops) << on;
    }
    session.set_physical_exposure(false);
    EXPECT_TRUE(session.request(kSize).camera.lens.blurs());
    EXPECT_FALSE(session.transform.camera.exposes());
    session.set_physical_exposure(true);
    EXPECT_EQ(session.transform.stops(), stops);
    session.set_depth_of_field(false);
    for (const bool on : {false, true}) session.set_physical_exposure(on);
    EXPECT_EQ(session.transform.stops(), stops) << "the f-number returns, also without a focus";
}

TEST_F(ViewSession, EachCameraOfTheSceneHasItsLens) {
    const TemporaryFolder folder;
    const PreviewArguments a = arguments_for(folder / "two.gltf");
    test::write_text(a.choice.scene, R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"camera": 0}, {"camera": 1}],
        "cameras": [{"name": "pinhole", "type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}},
                    {"name": "lens", "type": "perspective", "perspective": {"yfov": 1, "znear": 0.1},
                     "extras": {"aperture_fstop": 2, "focus_distance": 3}}]})");
    Session two(a, ColorConfig::load());
    EXPECT_FALSE(two.request(kSize).camera.lens.blurs());
    two.take_camera("lens");
    EXPECT_EQ(two.request(kSize).camera.lens.focus.distance, 3);
    two.move(orbit(two.pose(), {0.1, 0}));
    two.reset_camera();
    EXPECT_EQ(two.scene_camera(), 1u) << "the camera that was chosen last";
    two.take_camera("pinhole");
    EXPECT_FALSE(two.request(kSize).camera.lens.blurs());
    EXPECT_EQ(two.saved(kSize).settings.view.camera.lens, Lens());
    two.take_camera("lens");
    two.set_depth_of_field(false);
    two.take_camera("pinhole");
    two.set_depth_of_field(true);
    EXPECT_NE(two.request(kSize).camera.lens.focus.distance, 3) << "the focus of the other camera";
}

TEST_F(ViewSession, ScenesInPages) {
    const TemporaryFolder folder;
    std::filesystem::copy_file(cornell().choice.scene, folder / "cornell.glb");
    test::write_text(folder / "list.parts.json", R"({"parts": [{"uri": "cornell.glb"}]})");
    const test::EnvironmentVariable cache("XDG_CACHE_HOME", folder.path.string());
    PreviewArguments a = arguments_for(folder / "list.parts.json");
    Session paged(a, ColorConfig::load());
    const Request request = paged.request(kSize);
    ASSERT_TRUE(request.pages);
    EXPECT_FALSE(session.request(kSize).pages);
    EXPECT_GT(request.pages->index().triangles, 20u);
    EXPECT_EQ(paged.camera().camera_to_world, session.camera().camera_to_world);
    EXPECT_DOUBLE_EQ(paged.diagonal(), session.diagonal());
    paged.move(session.pose());
    EXPECT_FALSE(paged.focus({256, 256}, kSize)) << "nothing can be picked";
    paged.focus_lens({128, 256}, kSize);
    EXPECT_EQ(paged.request(kSize).camera.lens.focus,
              (Focus{.kind = Focus::Kind::point, .point = dvec2(128, 256) / dvec2(kSize)}));
    a.choice.edits.transforms[0] = dmat4(2);
    EXPECT_NE(error_message([&] { Session(a, ColorConfig::load()); }).find("transforms"), std::string::npos);
}

TEST_F(ViewSession, DragsOfEachButton) {
    const CameraPose start = session.pose();
    const double before = distance();
    const struct {
        Input input;
        CameraPose pose;
    } drags[] = {{{.drag = {0.1, 0.05}}, start},  // no button is held
                 {{.drag = {0.1, 0.05}, .left = true}, orbit(start, {kPi * 0.1, kPi * 0.05})},
                 {{.drag = {0.1, 0.05}, .middle = true}, pan(start, {0.1, 0.05})},
                 {{.drag = {0.1, 0.05}, .left = true, .shift = true}, pan(start, {0.1, 0.05})}};
    for (const auto& drag : drags) {
        steer(drag.input);
        EXPECT_EQ(session.pose(), drag.pose) << &drag - drags;
        session.reset_camera();
    }
    steer({.drag = {0, 0.5}, .right = true});
    EXPECT_NEAR(distance(), before * std::exp(1), 1e-9);
    session.reset_camera();
    steer({.wheel = 1});
    EXPECT_LT(distance(), before);
}

TEST_F(ViewSession, FlyingRotatesTheCamera) {
    navigation.mode = NavigationMode::fly;
    const CameraPose start = session.pose();
    steer({.drag = {0.1, 0}, .left = true});
    EXPECT_EQ(session.pose().from, start.from);
    EXPECT_NE(session.pose().at, start.at);
    session.reset_camera();
    steer({.wheel = 2});
    EXPECT_GT(navigation.speed, 1);
    EXPECT_EQ(session.pose(), start);

    navigation.speed = 1;
    steer({.movement = {0, 0, 1}, .seconds = 0.05});
    EXPECT_TRUE(navigation.moving());
    const double step = glm::length(session.pose().from - start.from);
    EXPECT_NEAR(step, 0.05, 1e-9) << "metres per second";
    session.reset_camera();
    steer({.fast = true, .movement = {0, 0, 1}, .seconds = 0.05});
    EXPECT_NEAR(glm::length(session.pose().from - start.from), 4 * step, 1e-9);
    session.reset_camera();
    navigation.suit(session);
    EXPECT_GT(distance() / double{navigation.speed}, 2) << "seconds to what the camera sees";
    EXPECT_LT(distance() / double{navigation.speed}, 10);
    navigation.speed = 1;
    steer({.movement = {0, 0, 1}, .seconds = 60});
    EXPECT_NEAR(glm::length(session.pose().from - start.from), 2 * step, 1e-9) << "a pause does not move the camera";
    steer({});
    EXPECT_FALSE(navigation.moving());
}

TEST_F(ViewSession, ADoubleClickAimsTheCamera) {
    const dvec3 there = picked({300, 400}).value().position;
    steer({.double_click = dvec2(300, 400)});
    EXPECT_LT(glm::length(session.pose().at - there), 1e-9);
    EXPECT_TRUE(session.frame_object({256, 256}, kSize));
    session.move(turn(session.pose(), {kPi, 0}));
    const CameraPose away = session.pose();
    EXPECT_FALSE(session.focus({256, 256}, kSize)) << "there is nothing";
    EXPECT_EQ(session.pose(), away);
}

TEST_F(ViewSession, FramesTheSelectedObject) {
    EXPECT_FALSE(session.frame_selection(kSize));
    WorldBounds block;
    const char* const names[] = {"node:short block", "node:tall block", "material:red", "camera:0"};
    for (const char* name : names) {
        session.select(name);
        block = session.selected_bounds();
        EXPECT_TRUE(session.frame_selection(kSize)) << name;
        EXPECT_LT(glm::length(session.pose().at - 0.5 * (block.lower + block.upper)), 1e-9) << name;
    }
    session.select("environment");
    EXPECT_FALSE(session.frame_selection(kSize)) << "it has no place";
    EXPECT_TRUE(session.frame_all(kSize));
    const WorldBounds box = world_bounds(session.scene());
    EXPECT_LT(glm::length(session.pose().at - 0.5 * (box.lower + box.upper)), 1e-6);
}

TEST_F(ViewSession, ViewsAreTakenBack) {
    ViewHistory history;
    history.start(session.view());
    std::vector<View> views = {session.view()};
    double time = 0;
    for (const double angle : {0.1, 0.2}) {
        for (int i = 0; i < 3; ++i) {
            steer({.drag = {angle, 0}, .left = true});
            history.record(session.view(), time += 0.1, i < 2);
        }
        history.record(session.view(), time += 1, false);
        views.push_back(session.view());
    }
    for (std::size_t i = 2; i-- > 0;) {
        EXPECT_EQ(history.back(session.view()), views[i]) << "a drag is one move";
        session.take_view(views[i]);
    }
    EXPECT_FALSE(history.back(session.view()));
    EXPECT_EQ(session.scene_camera(), 0u);
    EXPECT_EQ(history.forward(session.view()), views[1]);
    session.take_view(views[1]);
    steer({.drag = {0, 0.1}, .left = true});
    EXPECT_EQ(history.back(session.view()), views[1]) << "a move counts from its first frame on";
    EXPECT_TRUE(history.can_go_forward(views[1]));
    // No frame need be drawn between the end of a move and the next press.
    session.take_view(views[1]);
    history.start(session.view());
    for (int i = 0; i < 2; ++i) {
        steer({.drag = {0.1, 0}, .left = true});
        history.record(session.view(), time += 1, true);
        views[i] = session.view();
        history.record(session.view(), time += 0.1, false);
    }
    EXPECT_EQ(history.back(views[1]), views[0]);
    EXPECT_EQ(history.back(views[0]).has_value(), true);
}

/// An orbit about the surface ahead would leave a narrow room through its side.
TEST_F(ViewSession, OrbitsBeforeNearbyWalls) {
    Camera camera = session.camera();
    const Picker picker(session.shared_scene());
    const WorldBounds box = world_bounds(session.scene());
    EXPECT_EQ(orbit_distance(camera, picker, session.scene()), distance_ahead(camera, picker, session.scene()));
    const dvec3 middle = 0.5 * (box.lower + box.upper);
    const double aside = 0.2 * (box.upper.x - box.lower.x);  // from the left wall
    camera.camera_to_world[3] = dvec4(box.lower.x + aside, middle.y, box.upper.z, 1);
    const double distance = orbit_distance(camera, picker, session.scene());
    EXPECT_LT(distance, aside);
    EXPECT_GT(distance, 0.5 * aside);
}

TEST_F(ViewSession, BookmarksAreReplacedByName) {
    const CameraPose start = session.pose();
    session.bookmark("a");
    steer({.drag = {0.1, 0}, .left = true});
    session.bookmark("b");
    session.bookmark("a");
    ASSERT_EQ(session.bookmarks.size(), 2u);
    EXPECT_NE(session.bookmarks[0].pose, start);
    session.reset_camera();
    session.recall("b");
    EXPECT_NE(session.pose(), start);
    EXPECT_THROW(session.recall("c"), Error);
    // Bookmarks without a name replace none.
    session.bookmarks.clear();
    for (const char* name : {"", "", "view 4"}) *name == 0 ? session.bookmark() : session.bookmark(name);
    session.bookmarks.erase(session.bookmarks.begin());
    for (int i = 0; i < 3; ++i) session.bookmark();
    std::string names;
    for (const Bookmark& bookmark : session.bookmarks) names += bookmark.name + ", ";
    EXPECT_EQ(names, "view 2, view 4, view 1, view 3, view 5, ");
}

TEST_F(ViewSession, DegenerateViewsAreRefused) {
    const Request before = session.request(kSize);
    CameraPose flat = session.pose(), nowhere = session.pose();
    flat.vertical_fov = kPi;
    nowhere.at = nowhere.from;
    for (const CameraPose& bad : {flat, nowhere}) {
        EXPECT_THROW(session.move(bad), Error);
        EXPECT_TRUE(session.request(kSize) == before);
    }
    for (int i = 0; i < 100; ++i) steer({.wheel = 100});
    EXPECT_NO_THROW(session.camera());
    steer({.drag = {0.1, 0}, .left = true});
}

TEST_F(ViewSession, TheNeutralLightStaysWhileTheCameraTurns) {
    const TemporaryFolder folder;
    session.open(session.opening(test::copy_room(folder.path, false))());
    const Image light = session.scene().environment.map;
    const SavedSettings before = session.saved(kSize);
    ASSERT_TRUE(before.light_azimuth);
    steer({.drag = {0.3, 0}, .left = true});
    EXPECT_EQ(session.scene().environment.map.pixels, light.pixels);
    const SavedSettings after = session.saved(kSize);
    EXPECT_EQ(after.light_azimuth, before.light_azimuth) << "render --settings shows what the window shows";
    session.open(session.lighting(SkyPreset::neutral)());
    EXPECT_EQ(session.scene().environment.map.pixels, light.pixels);
    session.open(session.lighting(vec3(1))());
    EXPECT_FALSE(session.saved(kSize).light_azimuth);
}

TEST_F(ViewSession, AFailedOpenChangesNothing) {
    const Request before = session.request(kSize);
    for (const char* bad : {"no.glb", "no.exr", "README.md"}) {
        EXPECT_THROW(session.open(session.opening(bad)()), Error) << bad;
        EXPECT_TRUE(session.request(kSize) == before) << bad;
    }
    EXPECT_EQ(session.saved(kSize).environment, EnvironmentChoice());
    // The settings of the scene are those of another version.
    TemporaryFolder folder;
    const std::filesystem::path other = test::copy_room(folder.path);
    test::write_text(settings_file_of(other), R"({"halflight_settings": 2, "samples": 3})");
    EXPECT_TRUE(error_message([&] {
                    session.open(session.opening(other)());
                }).starts_with(settings_file_of(other).string() + ": halflight_settings: "));
    EXPECT_TRUE(session.request(kSize) == before);
    EXPECT_EQ(session.transform, ViewTransform());
    EXPECT_EQ(session.file(), cornell().choice.scene);
}

TEST_F(ViewSession, FilesAreReadOnAnyThreadAndOpenedLater) {
    TemporaryFolder folder;
    const std::filesystem::path other = test::copy_room(folder.path);
    std::optional<Request> before = session.request(kSize);
    const auto reading = session.opening(other);
    session.node_frame(0);
    const std::weak_ptr<const Scene> first = session.shared_scene();
    Session::Opened opened;
    std::thread([&] { opened = reading(); }).join();
    EXPECT_TRUE(session.request(kSize) == *before) << "it is not taken yet";
    session.open(std::move(opened));
    before.reset();
    EXPECT_TRUE(first.expired()) << "nothing keeps the closed scene";
    EXPECT_EQ(session.file(), other);
    EXPECT_EQ(session.camera().name, "front");

    // A new environment changes nothing else.
    ExrLayer sky{{"R", "G", "B"}, Image(2, 1, 3)};
    std::ranges::fill(sky.image.pixels, 0.5f);
    write_exr(folder / "sky.exr", {sky}, {});
    session.edits.clay = true;
    steer({.drag = {0.1, 0}, .left = true});
    const CameraPose pose = session.pose();
    session.open(session.opening(folder / "sky.exr")());
    EXPECT_EQ(session.pose(), pose);
    EXPECT_TRUE(session.edits.clay);
    EXPECT_EQ(session.scene().environment.map.width, 2);
    EXPECT_EQ(session.saved(kSize).environment, EnvironmentChoice(folder / "sky.exr"));

    // A settings file that is named meanwhile stays.
    const auto lighting = session.lighting(vec3(1));
    const std::string named = folder / "named.json";
    test::write_text(named, "{}");
    session.note_saved(named);
    session.open(lighting());
    EXPECT_EQ(session.settings_file(), named);
    EXPECT_FALSE(session.settings_changed());
}

TEST_F(ViewSession, ChangesOfTheSettingsFileAreNoticed) {
    TemporaryFolder folder;
    PreviewArguments a = arguments_for(test::copy_room(folder.path));
    take_settings(a);
    Session own(a, ColorConfig::load());
    EXPECT_FALSE(own.settings_changed()) << "there is no file";
    own.save(kSize);
    EXPECT_TRUE(own.settings_changed()) << "the file is new, and nobody has noted it";
    own.note_saved(own.settings_file());
    EXPECT_FALSE(own.settings_changed());
    test::write_text(own.settings_file(), "{}");
    EXPECT_TRUE(own.settings_changed());
    std::filesystem::remove(own.settings_file());
    EXPECT_FALSE(own.settings_changed()) << "a save loses nothing";
}

TEST_F(ViewSession, FramesAreOfTheScenesRateUnlessOneIsGiven) {
    TemporaryFolder folder;
    PreviewArguments a = arguments_for(test::write_sliding_light(folder.path, 30));  // an animation of 2 s
    a.choice.animation = "slide";
    a.settings.frame = 45;
    const Session own(a, ColorConfig::load());
    EXPECT_EQ(own.timeline().rate, (FrameRate{30, 1}));
    EXPECT_EQ(own.timeline().last, 60u);
    EXPECT_NEAR(own.scene().instances.at(0).object_to_world[3].x, 1, 1e-6);
    a.choice.frame_rate = FrameRate{45, 1};
    const Session given(a, ColorConfig::load());
    EXPECT_EQ(given.timeline().last, 90u);
    EXPECT_NEAR(given.scene().instances.at(0).object_to_world[3].x, 0, 1e-6);
}

TEST_F(ViewSession, TransformsMoveWhatIsPicked) {
    const Ray ahead = ray_through(session.camera(), {256, 256}, kSize);
    const auto still = picked({256, 256});
    dmat4 nearer = session.scene().instances[still->instance].object_to_world;
    nearer[3] -= dvec4(0.1 * ahead.direction, 0);
    PreviewArguments a = cornell();
    a.choice.edits.transforms[still->instance] = nearer;
    Session moved(a, ColorConfig::load());
    EXPECT_NEAR(glm::length(moved.pose().at - moved.pose().from), distance() - 0.1, 1e-6);
    ASSERT_TRUE(moved.focus({256, 256}, kSize));
    EXPECT_LT(glm::length(moved.pose().at - (still->position - 0.1 * ahead.direction)), 1e-6);
}

/// Motion compares the scenes of two requests.
TEST_F(ViewSession, TransformsHoldInAllPoses) {
    TemporaryFolder folder;
    PreviewArguments a = arguments_for(test::write_sliding_light(folder.path));
    a.choice.animation = "slide";
    a.choice.edits.transforms[0] = dmat4(dvec4(1, 0, 0, 0), dvec4(0, 1, 0, 0), dvec4(0, 0, 1, 0), dvec4(7, 0, 0, 1));
    Session moved(a, ColorConfig::load());
    for (const char* animation : {"slide", "none"}) {
        moved.open(moved.posing(animation, 24)());
        const Request r = moved.request(kSize);
        for (const auto& [scene, tree] : {std::pair(r.reference, r.reference_tree), std::pair(r.scene, r.tree)}) {
            Scene edited = *scene;
            apply(r.edits, edited, *tree);
            EXPECT_EQ(edited.instances.at(0).object_to_world, a.choice.edits.transforms[0]) << animation;
        }
    }
}

TEST_F(ViewSession, SavesSizeAndModes) {
    const PreviewModes modes{{.cache = true, .filter = true}, 2.5f};
    session.modes = modes;
    const SavedSettings saved = session.saved({640, 480});
    EXPECT_EQ(saved.size, ivec2(640, 480));
    EXPECT_EQ((PreviewModes{saved.settings.preview, saved.settings.clamp}), modes);
    EXPECT_FALSE(session.saved({0, 0}).size) << "of a window that is minimised";

    session.set_denoising(Denoising::always);
    EXPECT_TRUE(session.saved(kSize).settings.denoise);
    session.samples = 1;
    EXPECT_FALSE(session.saved(kSize).settings.denoise) << "`render` refuses the file";
    EXPECT_TRUE(session.document().settings.denoise) << "undo keeps it";
    session.set_denoising(Denoising::off);
    session.modes = modes;

    // A scene with settings replaces the current ones. A scene without settings leaves them unchanged.
    TemporaryFolder folder;
    const std::filesystem::path other = test::copy_room(folder.path);
    session.open(session.opening(other)());
    EXPECT_EQ(session.modes, modes);
    test::write_text(settings_file_of(other),
                     R"({"halflight_settings": 1, "size": [8, 80], "preview": "temporal", "clamp": 0})");
    session.open(session.opening(other)());
    EXPECT_EQ(session.modes, (PreviewModes{{.temporal = true}, 0}));

    // Denoising and preview modes exclude each other, so an entry of the file ends what the session has.
    session.set_denoising(Denoising::always);
    test::write_text(settings_file_of(other), R"({"halflight_settings": 1, "preview": "cache,filter"})");
    session.open(session.opening(other)());
    EXPECT_EQ(session.modes, (PreviewModes{{.cache = true, .filter = true}, 0}));
    test::write_text(settings_file_of(other), R"({"halflight_settings": 1, "denoise": true})");
    session.open(session.opening(other)());
    EXPECT_EQ(session.modes, (PreviewModes{.denoise = true}));
}

TEST_F(ViewSession, ComponentsAndErrorsNeedTheirAovs) {
    EXPECT_TRUE(session.request(kSize).aovs.empty());
    session.layer_view.components[1] = false;
    EXPECT_EQ(session.request(kSize).aovs.size(), kComponents.size());
    session.layer_view.layer = kError;
    EXPECT_EQ(session.request(kSize).aovs, std::vector<std::string>{"variance"});
}

TEST_F(ViewSession, ControlsShowMaterialEditsAsTheyWriteThem) {
    session.edits.emission = 2;
    material_edit(session.edits, "1")["emission"] = {3, 2, 1};
    session.edits.nodes = {{"short block", {.translate = dvec3(0.1, 0, 0)}}};
    EXPECT_EQ(session.edited_values().materials[1].emission, vec3(3, 2, 1)) << "without the factor on all";
}

TEST(ViewTimeline, ReachesTheLastKey) {
    for (const int rate : {24, 25, 30, 60})
        for (std::uint32_t n = 1; n <= 300; ++n)  // files store times as floats
            ASSERT_EQ(last_frame(double{static_cast<float>(double(n) / rate)}, {rate, 1}), n) << rate;
    EXPECT_EQ(last_frame(0, {}), 0u);
    EXPECT_EQ(last_frame(0.99, {}), 23u);
    EXPECT_EQ(last_frame(1e300, {}), 1000000u);
}

TEST(ViewTimeline, AnimationNamesAreUnambiguous) {
    std::vector<Animation> animations(5);
    animations[0].name = "run", animations[2].name = "run", animations[3].name = "all", animations[4].name = "walk";
    EXPECT_EQ(titles(animations), (std::vector<std::string>{"run", "1", "2", "3", "walk"}));
}

/// Without a camera in the file, every frame has the view that `render` chooses at 0 s.
TEST(ViewTimeline, DefaultCamerasAreThoseOfTheReference) {
    const TemporaryFolder folder;
    PreviewArguments a = arguments_for(write_hand(folder));
    a.choice.animation = "slide";
    Session first(a, ColorConfig::load());
    a.settings.frame = 24;
    Session later(a, ColorConfig::load());
    EXPECT_EQ(first.timeline().last, 48u);
    for (int column = 0; column < 4; ++column)
        EXPECT_LT(glm::length(first.camera().camera_to_world[column] - later.camera().camera_to_world[column]), 1e-12);
    EXPECT_NE(world_bounds(first.scene()).lower, world_bounds(later.scene()).lower);
    EXPECT_EQ(later.saved(kSize).moment->frame, 24u);
    first.open(first.posing("slide", 24)());
    EXPECT_EQ(world_bounds(first.scene()).lower, world_bounds(later.scene()).lower);
    first.open(first.posing("none", 5)());
    EXPECT_EQ(first.saved(kSize).moment->animation, "none") << "the frame number determines its noise";
    first.open(first.posing("none", 0)());
    EXPECT_FALSE(first.saved(kSize).moment);
}

/// Edits of lights that an environment brings go with it.
TEST(ViewTimeline, EditsOfTheSunGoWithItsSky) {
    const TemporaryFolder folder;
    PreviewArguments a = arguments_for(test::write_blinking_scene(folder.path));
    const std::string file = a.choice.scene.string() + ".halflight.json";
    test::write_text(file, R"({"halflight_settings": 1, "environment": {"sky": {"elevation": 40}},
        "lights": {"sun": {"factor": 0.5}}, "hide": ["light:sun"], "light_groups": {"key": ["light:sun"]},
        "materials": {"gone": {"roughness": 1}}})");
    take_settings(a);
    Session session(a, ColorConfig::load());
    EXPECT_NE(session.warning().find(": an entry is left out"), std::string::npos) << session.warning();
    EXPECT_EQ(session.edits.lights.size() + session.edits.hidden.size() + session.edits.light_groups.size(), 3u);
    session.open(session.lighting(vec3(1))());
    EXPECT_EQ(session.edits.lights.size() + session.edits.hidden.size() + session.edits.light_groups.size(), 0u);
    ASSERT_NO_THROW(session.open(session.posing("blink", 24)()));
    EXPECT_EQ(session.timeline().animation, "blink");
}

/// Settings that were saved for another state of the scene, or by another version.
TEST(ViewSettings, EntriesThatDoNotSuitAreLeftOutAndNamed) {
    const TemporaryFolder folder;
    PreviewArguments a = arguments_for(test::copy_room(folder.path));
    const std::string file = a.choice.scene.string() + ".halflight.json";
    const auto opened = [&](const std::string& entries) {
        test::write_text(file, R"({"halflight_settings": 1)" + entries + "}");
        PreviewArguments own = a;
        take_settings(own);
        return Session(own, ColorConfig::load());
    };
    EXPECT_EQ(opened(R"(, "camera": "above", "samples": 7)").warning(), "");

    const std::string text =
        R"(, "camera": "gone", "samples": 7, "size": [8, 8], "exposure": 1, "look": "none of it", "focus": "3", "haze": 2,
           "materials": {"gone": {"roughness": 0.5}, "0": {"roughness": 0.25, "gloss": 1}},
           "hide": ["node:gone"], "display": "nobody's",
           "transforms": {"2": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}, "animation": {"name": "gone", "frame": 3}, "variant": "gone",
           "environment": {"map": "gone.hdr"}, "emission": 2,
           "bookmarks": [{"name": "here", "camera": {"from": [0, 1, 2], "at": [0, 0, 0]}},
                         {"name": "there", "camera": {"from": [0, 0, 0], "at": [0, 0, 0]}}])";
    const Session session = opened(text);
    const std::string& warning = session.warning();
    EXPECT_TRUE(warning.starts_with(file + ": 13 entries are left out")) << warning;
    for (const char* named : {"camera: ", "size: ", "nobody's", "focus: ", "'haze'", "material 'gone'", "gloss", "hide",
                              "node 'gone'", "animation: ", "variant 'gone'", "gone.hdr", "bookmarks", "instance 2"})
        EXPECT_NE(warning.find(named), std::string::npos) << named << ": " << warning;
    EXPECT_EQ(std::ranges::count(warning, '\n'), 0);
    EXPECT_EQ(session.samples, 7);
    EXPECT_EQ(session.transform.exposure, 1);
    EXPECT_EQ(session.edits.emission, 2);
    EXPECT_EQ(session.edits.materials.size() + session.edits.hidden.size(), 0u);
    ASSERT_EQ(session.bookmarks.size(), 1u);
    EXPECT_EQ(session.bookmarks[0].name, "here");
    EXPECT_EQ(test::read_text(file), R"({"halflight_settings": 1)" + text + "}") << "opening writes nothing";

    // A wrong option is an error, although wrong entries of the file are not, and so is a file that is no JSON.
    a.view.camera = "nobody";
    EXPECT_NE(error_message([&] { opened(""); }).find("'nobody'"), std::string::npos);
    a.view.camera.reset();
    test::write_text(file, "{");
    EXPECT_TRUE(error_message([&] { take_settings(a); }).starts_with(file + ": "));
}

}  // namespace
}  // namespace halflight::view
