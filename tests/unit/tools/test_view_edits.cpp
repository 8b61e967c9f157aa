// Tests editing in the viewer's session: undo and redo, selection, outlines, environments, variants.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "api/halflight/edit_text.h"
#include "tests/support/error_message.h"
#include "tests/unit/tools/view_scenes.h"
#include "tools/view/edit_history.h"
#include "tools/view/gizmo.h"
#include "tools/view/outline.h"
#include "tools/view/outliner.h"

namespace halflight::view {
namespace {

class ViewEdits : public CornellSession {
  protected:
    ViewEdits() { history.start(session.document()); }
    void edit(void (*add)(SceneEdits&, const std::string&, const std::string&), const char* text) {
        SceneEdits edits = session.edits;
        add(edits, "test", text);
        session.edit(edits);
    }
    void record(bool busy = false) { history.record(session.document(), busy); }
    void set_emission(float factor, bool busy) {
        session.edits.emission = factor;
        record(busy);
    }

    EditHistory history;
};

TEST_F(ViewEdits, UndoAndRedoRestoreEachEdit) {
    session.transform.exposure = 0.5f;  // a value that metering has found
    history.start(session.document());
    std::vector<SavedSettings> states = {session.document()};
    const auto done = [&] {
        record();
        states.push_back(session.document());
    };
    edit(add_material_edit, "white.roughness=0.25");
    done();
    edit(add_node_edit, "tall block=translate:0.1,0,0");
    done();
    session.transform.exposure = 2.0f;
    done();
    session.bounces = 3;
    done();
    session.bookmark();
    done();
    EXPECT_TRUE(history.unsaved());
    for (std::size_t i = states.size() - 1; i-- > 0;) {
        ASSERT_TRUE(history.can_undo());
        EXPECT_FALSE(session.restore(*history.undo())) << "neither environment nor variant changes";
        EXPECT_EQ(session.document(), states[i]) << i;
        record();  // a restored state is no edit
    }
    EXPECT_FALSE(history.can_undo());
    EXPECT_FALSE(history.undo());
    EXPECT_FALSE(history.unsaved());
    for (std::size_t i = 1; i < states.size(); ++i) {
        ASSERT_TRUE(history.can_redo());
        session.restore(*history.redo());
        EXPECT_EQ(session.document(), states[i]) << i;
    }
    EXPECT_FALSE(history.redo());
    history.mark_saved(session.document());
    EXPECT_FALSE(history.unsaved());
    session.restore(*history.undo());
    EXPECT_TRUE(history.unsaved());
    edit(add_hidden, "light");
    record();
    EXPECT_FALSE(history.can_redo()) << "another edit ends the undone ones";
}

TEST_F(ViewEdits, DragsAreOneEditAndCamerasAreNone) {
    for (const float factor : {1.5f, 2.0f, 2.5f}) set_emission(factor, true);
    EXPECT_FALSE(history.can_undo()) << "the mouse is still held";
    record();
    session.move(orbit(session.pose(), {0.3, 0.1}));
    record();
    session.restore(*history.undo());
    EXPECT_EQ(session.edits.emission, 1);
    EXPECT_FALSE(history.can_undo());
}

TEST_F(ViewEdits, AControlThatTakesItsChangeBackLeavesNoStep) {
    set_emission(2, false);
    set_emission(7, false);  // the first click on a slider
    set_emission(2, true);   // the second click opens its text
    set_emission(3, true);
    set_emission(3, false);
    session.restore(*history.undo());
    EXPECT_EQ(session.edits.emission, 2);
    session.restore(*history.undo());
    EXPECT_EQ(session.edits.emission, 1);
    EXPECT_FALSE(history.can_undo());
}

TEST_F(ViewEdits, MeteringIsNoEdit) {
    session.transform.exposure = {};
    history.start(session.document());
    const auto meter = [&](float stops) {
        session.transform.exposure = stops;
        history.meter(stops);
        record();
    };
    meter(-3);
    EXPECT_FALSE(history.can_undo());
    EXPECT_FALSE(history.unsaved());
    session.transform.exposure = 1.0f;
    record();
    EXPECT_TRUE(history.can_undo());
    session.transform.exposure.automatic = true;
    record();
    meter(1);
    session.restore(*history.undo());
    EXPECT_EQ(session.transform.exposure, Exposure(-3.0f)) << "metering that changes nothing has left a step";
}

TEST_F(ViewEdits, AnExposureSetBeforeMeteringIsAnEdit) {
    session.transform.exposure = {};
    history.start(session.document());
    session.transform.exposure = 1.0f;
    record();
    session.bounces = 3;
    record();
    EXPECT_TRUE(history.unsaved());
    session.restore(*history.undo());
    session.restore(*history.undo());
    EXPECT_TRUE(session.transform.metered());
    EXPECT_FALSE(history.unsaved());
}

TEST_F(ViewEdits, InvalidEditsChangeNothing) {
    const SavedSettings before = session.document();
    SceneEdits edits;
    add_node_edit(edits, "test", "tal block=scale:2");
    EXPECT_NE(error_message([&] { session.edit(edits); }).find("'tall block'"), std::string::npos);
    EXPECT_EQ(session.document(), before);
}

TEST_F(ViewEdits, ClicksSelectTheNodeOfASurface) {
    Outline outline;
    session.select(dvec2(256, 130), kSize);
    ASSERT_EQ(session.selection.kind, ObjectKind::node);
    EXPECT_EQ(session.tree().nodes[session.selection.index].name, "back wall");
    EXPECT_EQ(outline.lines(session, kSize).size(), 4u) << "the diagonal is no edge of the outline";
    edit(add_hidden, "back wall");
    EXPECT_TRUE(outline.lines(session, kSize).empty());
    session.select(dvec2(256, 130), kSize);
    EXPECT_EQ(session.selection, Selection()) << "hidden surfaces are not picked";
    session.select("node:back wall");
    EXPECT_TRUE(session.selected_instances().empty()) << "they have no outline";
    EXPECT_EQ(session.meshes_of_node().size(), 1u) << "but their materials can be edited";
    session.select("node:tall block");
    EXPECT_EQ(session.name_of(session.selection), "node tall block");
    session.select("material:red");
    EXPECT_EQ(session.selection, (Selection{ObjectKind::material, 1}));
    EXPECT_TRUE(outline.lines(session, kSize).empty());
    for (const char* unknown : {"node:nobody", "red"}) EXPECT_THROW(session.select(unknown), Error);
}

TEST_F(ViewEdits, OutlinesFollowEdits) {
    Outline outline;
    session.select("node:tall block");
    const auto before = outline.lines(session, kSize);
    edit(add_node_edit, "tall block=translate:0,0.1,0");
    const auto after = outline.lines(session, kSize);
    ASSERT_EQ(before.size(), after.size());
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LT(after[i][0].y, before[i][0].y) << "higher in the picture";
}

/// An outline leaves out edges that are in front of other faces of the same object.
TEST(ViewOutline, LeavesOutEdgesInside) {
    Mesh squares;
    for (const double half : {1.0, 0.5})
        for (const dvec2 corner : {dvec2(-1, -1), dvec2(1, -1), dvec2(1, 1), dvec2(-1, 1)})
            squares.positions.emplace_back(half * corner.x, half * corner.y, half < 1 ? 0.5 : 0);
    squares.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    Camera camera;
    camera.camera_to_world = glm::translate(dmat4(1), dvec3(0, 0, 4));
    camera.vertical_fov = kPi / 2;
    const ivec2 size(400, 200);
    const auto outline = [&](const dvec3& moved) {
        const Projection projection(camera, size);
        const MeshEdges edges(squares);
        const dmat4 to_world = glm::translate(dmat4(1), moved);
        Coverage coverage(size);
        edges.add_faces(to_world, projection, coverage);
        std::vector<PictureLine> all, lines;
        edges.add_outline(to_world, projection, all);
        EXPECT_EQ(all.size(), moved == dvec3(0) ? 8u : 4u);
        for (const PictureLine& line : all) coverage.add_outer_parts(line, lines);
        return lines;
    };
    const auto lines = outline({});
    ASSERT_EQ(lines.size(), 4u);
    for (const auto& line : lines)
        for (const dvec2& p : line) EXPECT_NEAR(glm::length(p - dvec2(200, 100)), 25 * std::sqrt(2), 1e-6);
    EXPECT_GT(outline({0, 0, 3.7}).size(), 0u) << "the small square is behind the camera";
}

/// A square of 2 x 2 at distance 4, seen with a vertical field of view of 90 degrees, is 2 of 8 units high.
TEST(ViewOutline, IsWhereTheCameraSeesIt) {
    Mesh square;
    square.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    Camera camera;
    camera.camera_to_world = glm::translate(dmat4(1), dvec3(0, 0, 4));
    camera.vertical_fov = kPi / 2;
    const MeshEdges edges(square);
    std::vector<PictureLine> lines;
    edges.add_outline(dmat4(1), Projection(camera, {400, 200}), lines);
    ASSERT_EQ(lines.size(), 4u);
    dvec2 lower(1e9), upper(-1e9);
    for (const auto& line : lines)
        for (const dvec2& p : line) lower = glm::min(lower, p), upper = glm::max(upper, p);
    EXPECT_LT(glm::length(lower - dvec2(175, 75)), 1e-9);
    EXPECT_LT(glm::length(upper - dvec2(225, 125)), 1e-9);
    lines.clear();
    edges.add_outline(glm::translate(dmat4(1), dvec3(0, 0, 9)), Projection(camera, {400, 200}), lines);
    EXPECT_TRUE(lines.empty()) << "it is behind the camera";
    const dvec2 pixel(310, 40);
    const Ray ray = ray_through(camera, pixel, {400, 200});
    EXPECT_LT(glm::length(*Projection(camera, {400, 200}).pixel(ray.origin + 3.0 * ray.direction) - pixel), 1e-9);
}

TEST_F(ViewEdits, TheListHasAllObjectsAndCanBeSearched) {
    Outliner outliner;
    const auto& rows = outliner.rows(session);
    const auto has = [&](ObjectKind kind, const char* label) {
        return std::ranges::any_of(rows, [&](const auto& r) { return r.object.kind == kind && r.label == label; });
    };
    EXPECT_TRUE(has(ObjectKind::environment, "environment"));
    EXPECT_TRUE(has(ObjectKind::node, "tall block"));
    EXPECT_TRUE(has(ObjectKind::material, "red"));
    std::ranges::copy(std::string_view("TALL"), outliner.search.begin());
    for (const auto& row : outliner.rows(session)) EXPECT_NE(row.label.find("tall"), std::string::npos);
    EXPECT_FALSE(outliner.rows(session).empty());
}

TEST_F(ViewEdits, ObjectsAreHiddenOneByOne) {
    edit(add_hidden, "node:*block");
    const auto hidden = [&](const char* name) {
        session.select(name);
        return HiddenObjects(session).contains(session.selection);
    };
    EXPECT_TRUE(hidden("node:tall block"));
    EXPECT_TRUE(hidden("node:short block"));
    set_shown(session, session.selection, true);
    EXPECT_FALSE(hidden("node:short block"));
    EXPECT_TRUE(hidden("node:tall block")) << "a pattern is divided";
    EXPECT_EQ(session.edits.hidden, (std::vector<ObjectName>{{"node:tall block"}}));
    set_shown(session, session.selection, true);
    EXPECT_EQ(session.edits, SceneEdits());
}

TEST_F(ViewEdits, HandlesChangeTheEditsOfTheCommandLine) {
    constexpr double kLength = 60;
    Gizmo gizmo;
    session.select("node:tall block");
    EXPECT_TRUE(gizmo.handles(session, kSize, kLength).empty()) << "the mode is none";
    const auto end_of = [&](int axis) {
        for (const auto& handle : gizmo.handles(session, kSize, kLength))
            if (handle.axis == axis) return handle.lines.back()[1];
        return dvec2(-1);
    };
    const auto drag = [&](int axis, const dvec2& from, const dvec2& to) {
        const auto handles = gizmo.handles(session, kSize, kLength);
        EXPECT_EQ(Gizmo::axis_at(handles, from, 2), axis);
        gizmo.begin(session, kSize, kLength, axis, from);
        gizmo.drag(session, to);
        gizmo.end(session);
        return session.edits.nodes.empty() ? NodeEdit() : session.edits.nodes[0].edit;
    };
    gizmo.mode = GizmoMode::move;
    ASSERT_EQ(gizmo.handles(session, kSize, kLength).size(), 3u) << "Z points at the camera";
    const dvec2 x = end_of(0);
    NodeEdit moved = drag(0, x, x + dvec2(30, 0));
    EXPECT_NE(moved.translate.x, 0);
    EXPECT_EQ(moved, (NodeEdit{.translate = {moved.translate.x, 0, 0}})) << "one number has changed";
    EXPECT_LT(glm::length(end_of(0) - x - dvec2(30, 0)), 3) << "the handle follows the mouse";
    EXPECT_LT(drag(1, end_of(1), end_of(1) + dvec2(0, 20)).translate.y, 0);

    session.edits = {};
    gizmo.mode = GizmoMode::scale;
    const dvec2 y = end_of(1);
    const NodeEdit scaled = drag(1, y, y - dvec2(0, 30));
    EXPECT_NEAR(scaled.scale.y, 1.5, 0.02) << "the handle is 60 pixels long";
    EXPECT_EQ(scaled.scale.x, 1);
    const auto middle = [&] {
        const WorldBounds box = session.selected_bounds();
        return 0.5 * (box.lower + box.upper);
    };
    session.edits = {};
    const dvec3 centre = middle();
    const auto square = gizmo.handles(session, kSize, kLength).back().lines;
    const dvec2 inside = 0.5 * (square[0][0] + square[2][0]);
    const NodeEdit all = drag(Gizmo::kAll, inside, inside + dvec2(37, 0));
    EXPECT_NEAR(all.scale.x, std::exp(37 / kLength), 1e-9);
    EXPECT_EQ(all.scale, dvec3(all.scale.x)) << "the middle scales along all axes";
    EXPECT_LT(glm::length(middle() - centre), 1e-6) << "the object stays where it is";
    session.edits = {};
    EXPECT_EQ(drag(Gizmo::kAll, inside, inside + dvec2(100 * kLength, 0)).scale, dvec3(100)) << "the limit of a drag";
    session.edits = {};
    session.pivots_on_origin = true;
    EXPECT_EQ(drag(1, end_of(1), end_of(1) - dvec2(0, 30)).translate, dvec3(0));
    session.pivots_on_origin = false;

    session.edits = {};
    gizmo.mode = GizmoMode::rotate;
    const Gizmo::Handle ring = gizmo.handles(session, kSize, kLength)[2];
    ASSERT_EQ(ring.lines.size(), 64u);
    const NodeEdit turned = drag(2, ring.lines[8][0], ring.lines[24][0]);
    EXPECT_NEAR(turned.rotate.z, 90, 1e-3) << "a quarter of the ring";
    EXPECT_EQ(turned.rotate.x, 0);

    EXPECT_EQ(gizmo_mode("scale"), GizmoMode::scale);
    EXPECT_THROW(gizmo_mode("turn"), Error);
}

/// Writes a triangle under a lamp and a sun that shines down, 5 m before a camera.
std::filesystem::path write_lamp(const TemporaryFolder& folder) {
    std::string text = test::read_text(write_hand(folder).string());
    const auto replace = [&](const std::string& from, const std::string& to) {
        text.replace(text.find(from), from.size(), to);
    };
    replace(R"("scene": 0)",
            R"("scene": 0, "extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [
            {"name": "lamp", "type": "point"}, {"name": "sun", "type": "directional"}]}},
            "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}])");
    replace(R"("nodes": [0])", R"("nodes": [0, 2, 3, 4])");
    replace(R"("mesh": 0})", R"("mesh": 0},
        {"translation": [0.5, 0.5, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"rotation": [-0.7071068, 0, 0, 0.7071068], "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"translation": [0, 0, 5], "camera": 0})");
    test::write_text((folder / "lamp.gltf").string(), text);
    return folder / "lamp.gltf";
}

TEST(ViewLights, SizesArePulledOutOfLamps) {
    constexpr double kLength = 60;
    const TemporaryFolder folder;
    Session session(arguments_for(write_lamp(folder)), ColorConfig::load());
    Gizmo gizmo;
    const auto lines = [&] { return gizmo.handles(session, kSize, kLength).back().lines; };
    const auto square = [&] { return 0.5 * ((lines().end() - 4)->at(0) + (lines().end() - 2)->at(0)); };
    const auto drag = [&](const dvec2& from, const dvec2& to) {
        EXPECT_EQ(Gizmo::axis_at(gizmo.handles(session, kSize, kLength), from, 9), Gizmo::kSize);
        gizmo.begin(session, kSize, kLength, Gizmo::kSize, from);
        gizmo.drag(session, to);
        gizmo.end(session);
        return session.edits.lights.empty() ? LightEdit() : session.edits.lights[0].edit;
    };
    session.select("light:lamp");
    ASSERT_EQ(gizmo.handles(session, kSize, kLength).size(), 1u) << "a size can be dragged in every mode";
    ASSERT_EQ(lines().size(), 4u) << "a lamp of radius 0 has the square alone";
    const dvec2 middle = *Projection(session.camera(), kSize).pixel({0.5, 0.5, 0});
    const dvec2 out = glm::normalize(dvec2(1, 1)), start = square();
    const LightEdit pulled = drag(start, start + 80.0 * out);
    ASSERT_TRUE(pulled.radius);
    EXPECT_EQ(pulled, LightEdit{.radius = pulled.radius}) << "one number has changed";
    const double metres = 80 / *Projection(session.camera(), kSize).pixels_per_unit({0.5, 0.5, 0});
    EXPECT_NEAR(double(*pulled.radius), metres, 0.05 * metres);
    EXPECT_LT(glm::length(square() - start - 80.0 * out), 5) << "the square follows the mouse";
    ASSERT_EQ(lines().size(), 68u);
    // The ring is the outline of the ball: its rays touch the ball.
    for (const std::size_t i : {0u, 13u, 40u}) {
        const Ray ray = ray_through(session.camera(), lines()[i][0], kSize);
        EXPECT_NEAR(glm::length(glm::cross(ray.direction, dvec3(0.5, 0.5, 0) - ray.origin)), double(*pulled.radius),
                    1e-6);
    }
    const dvec2 ring = lines()[30][0];
    EXPECT_LT(*drag(ring, 0.5 * (ring + middle)).radius, *pulled.radius);
    EXPECT_EQ(drag(square(), middle).radius, 0.0f);
    gizmo.mode = GizmoMode::move;
    EXPECT_GT(gizmo.handles(session, kSize, kLength).size(), 2u);
    gizmo.mode = GizmoMode::none;

    session.edits = {};
    session.select("light:sun");
    const dvec2 beside = square();
    const LightEdit wide = drag(beside, beside + dvec2(0.5 * kLength, 0));
    EXPECT_EQ(wide, LightEdit{.angle = wide.angle});
    EXPECT_NEAR(double(wide.angle.value_or(0)), 45, 1);
    EXPECT_LT(glm::length(square() - beside - dvec2(0.5 * kLength, 0)), 2);
    EXPECT_EQ(drag(square(), square() + dvec2(20 * kLength, 0)).angle, 179.0f);
    EXPECT_EQ(drag(square(), square() - dvec2(20 * kLength, 0)).angle, 0.0f);
    EXPECT_NEAR(double(drag(square(), square() + dvec2(0.05 * kLength, 0)).angle.value_or(0)), 0.45, 0.02)
        << "small angles can be set";
}

TEST_F(ViewEdits, LampsAreAddedDuplicatedAndDeleted) {
    const auto name = [&] { return session.name_of(session.selection); };
    const dvec2 middle = 0.5 * dvec2(kSize);
    session.add_lamp(LampKind::spot, middle, kSize);
    EXPECT_EQ(name(), "light spot");
    const LightEdit spot = session.edits.added_lights.at(0).edit;
    const dvec3 lit = session.picker().pick(ray_through(session.camera(), middle, kSize))->position;
    const dvec3 way = lit - *spot.position;
    EXPECT_GT(glm::dot(glm::normalize(way), *spot.direction), 0.999) << "it shines on the surface in the middle";
    EXPECT_NEAR(double(*spot.intensity), kPi* glm::dot(way, way), 0.02 * kPi * glm::dot(way, way));
    session.duplicate_lamp();
    EXPECT_EQ(name(), "light spot 2");
    EXPECT_NE(session.edits.added_lights.at(1).edit.position, spot.position);
    session.add_lamp(LampKind::rectangle, middle, kSize);
    ASSERT_EQ(session.lights().size(), session.scene().lights.size() + 3);
    const AreaLamp panel = session.area_lamp(session.selection.index).value();
    const Camera camera = session.camera();
    session.selection = {};
    session.select(*Projection(camera, kSize).pixel(panel.light.position), kSize);
    EXPECT_EQ(name(), "light rectangle") << "its surface is picked";
    session.select("light:spot");
    set_shown(session, session.selection, false);
    EXPECT_TRUE(session.edits.lights.empty());
    EXPECT_TRUE(HiddenObjects(session).contains(session.selection));
    set_shown(session, session.selection, true);
    EXPECT_EQ(session.edits.added_lights.at(0).edit, spot);
    const SavedSettings before = session.document();
    EXPECT_TRUE(session.remove_lamp());
    EXPECT_EQ(session.edits.added_lights.size(), 2u);
    EXPECT_FALSE(session.remove_lamp()) << "nothing is selected";
    session.select("light:rectangle");
    session.restore(before);
    EXPECT_EQ(name(), "light rectangle") << "undo keeps the selection";
    session.restore(SavedSettings());
    EXPECT_EQ(session.selection, Selection());
    EXPECT_EQ(session.references().lights.size(), session.scene().lights.size());
}

/// A copy has the same light as its source, although the pattern of an edit matches both.
TEST(ViewLights, CopiesDoNotTakePatternsTwice) {
    const TemporaryFolder folder;
    Session session(arguments_for(write_lamp(folder)), ColorConfig::load());
    add_light_edit(session.edits, "test", "lam*=factor:0.5");
    session.select("light:lamp");
    session.duplicate_lamp();
    const Scene values = session.edited_values();
    ASSERT_EQ(values.lights.size(), 3u);
    EXPECT_EQ(values.lights[2].intensity, values.lights[0].intensity);
}

TEST(ViewKeys, OfALampGoWithItAndComeBackWithUndo) {
    using Of = EditTrack::Of;
    PreviewArguments a = arguments_for(HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb");
    add_new_light(a.choice.edits, "test", "rim=kind:rectangle,position:0.5,0.5,0.5,direction:0,0,1,size:0.2,0.2");
    a.choice.keys.tracks = {{.of = Of::lights, .name = "rim", .key = "size", .keys = {{0, "0.2,0.2"}, {10, "0.4,0.4"}}},
                            {.of = Of::hide, .name = "light:rim", .keys = {{0, "false"}, {9, "true"}}},
                            {.of = Of::scene, .key = "emission", .keys = {{0, "1"}, {4, "2"}}}};
    Session session(a, ColorConfig::load());
    session.open(session.posing("none", 5)());
    session.select("light:rim");
    EXPECT_NEAR(session.area_lamp(session.selection.index)->size.x, 0.3f, 1e-6f) << "the mark is where the lamp is";
    const SavedSettings before = session.document();
    EXPECT_TRUE(session.remove_lamp());
    EXPECT_EQ(session.saved(kSize).keys.tracks.size(), 1u);
    EXPECT_EQ(session.timeline().last, 4u);
    session.restore(before);
    EXPECT_EQ(session.saved(kSize).keys, before.keys);
    EXPECT_EQ(session.timeline().last, 10u);
}

/// Values between valid keys can be invalid. Such a frame is an error of posing(), and the session goes on.
TEST(ViewKeys, WithoutAValueAtAFrameAreAnErrorOfPosing) {
    using Of = EditTrack::Of;
    PreviewArguments a = arguments_for(HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb");
    a.view.pose = CameraPose{.from = {0, 0, 5}, .at = {0, 0, 0}};
    const auto fails_at_5 = [&](const EditTrack& track) {
        a.choice.keys.tracks = {track};
        Session session(a, ColorConfig::load());
        EXPECT_NE(error_message([&] { session.open(session.posing("none", 5)()); }), "");
        EXPECT_EQ(session.timeline().frame, 0u);
        session.open(session.posing("none", 4)());
        // Keys can also become invalid at the frame that is shown.
        SavedSettings other = session.document();
        for (EditTrack::Key& key : other.keys.tracks[0].keys) key.frame = key.frame == 0 ? -1 : 9;
        const auto opening = session.restore(other);
        ASSERT_TRUE(opening);
        EXPECT_THROW((*opening)(), Error);
        EXPECT_NO_THROW(session.camera());
        EXPECT_EQ(session.edits_now(), session.edits);
    };
    fails_at_5({.of = Of::nodes, .name = "tall block", .key = "scale", .keys = {{0, "1,1,1"}, {10, "-1,1,1"}}});
    fails_at_5({.of = Of::camera, .key = "from", .keys = {{0, "0,0,5"}, {10, "0,0,-5"}}});
}

TEST_F(ViewEdits, HandlesAimSpotsAndSetTheirCones) {
    constexpr double kLength = 60;
    edit(add_new_light, "spot=kind:spot,position:0.5,0.9,0.5,direction:0,-1,0,inner:20,outer:30");
    session.select("light:spot");
    Gizmo gizmo;
    const auto square = [&](LightHandle which) {
        for (const auto& handle : gizmo.handles(session, kSize, kLength))
            if (handle.axis == Gizmo::kLight + static_cast<int>(which))
                return 0.5 * ((handle.lines.end() - 4)->at(0) + (handle.lines.end() - 2)->at(0));
        return dvec2(-1);
    };
    const auto drag = [&](LightHandle which, const dvec2& by) {
        const int axis = Gizmo::kLight + static_cast<int>(which);
        const dvec2 from = square(which);
        EXPECT_EQ(Gizmo::axis_at(gizmo.handles(session, kSize, kLength), from, 9), axis);
        gizmo.begin(session, kSize, kLength, axis, from);
        gizmo.drag(session, from + by);
        gizmo.end(session);
        EXPECT_LT(glm::length(square(which) - from - by), 6) << "the square follows the mouse";
        return session.edits.added_lights.at(0).edit;
    };
    const dvec2 middle = *Projection(session.camera(), kSize).pixel({0.5, 0.9, 0.5});
    const double side = square(LightHandle::outer).x < middle.x ? -1 : 1;
    EXPECT_NEAR(std::abs(square(LightHandle::outer).x - middle.x), 0.5 * kLength, 1) << "sine of 30 degrees";
    const LightEdit wide = drag(LightHandle::outer, dvec2(10 * side, -8));
    EXPECT_GT(*wide.outer, 35.0f);
    EXPECT_NEAR(*wide.inner, 20.0f, 1e-4f);
    const LightEdit soft = drag(LightHandle::inner, dvec2(10 * side, 0));
    EXPECT_LT(*soft.inner, 15.0f);
    EXPECT_NEAR(*soft.outer, *wide.outer, 1e-4f);
    const LightEdit aimed = drag(LightHandle::aim, dvec2(30, 0));
    EXPECT_GT(glm::dot(*aimed.direction, dvec3(session.camera().camera_to_world[0])), 0.2) << "to the right";
    edit(add_new_light, "panel=kind:rectangle,position:0.5,0.5,0.5,direction:0,0,1,size:0.4,0.2");
    session.select("light:panel");
    session.edits.added_lights.erase(session.edits.added_lights.begin());
    session.select("light:panel");
    const LightEdit broad = drag(LightHandle::width, dvec2(square(LightHandle::width).x < middle.x ? -20 : 20, 0));
    EXPECT_GT(broad.size->x, 0.41f);
    EXPECT_FLOAT_EQ(broad.size->y, 0.2f);
}

/// Edits of the nodes above turn the axes along which the edit of a node counts, and the handles follow these axes.
TEST(ViewNodes, FollowThoseAbove) {
    const TemporaryFolder folder;
    Session session(arguments_for(write_hand(folder)), ColorConfig::load());
    node_edit(session.edits, "arm").rotate = {0, 0, 90};
    session.select("node:hand");
    const NodeFrame frame = session.node_frame(session.selection.index);
    EXPECT_EQ(frame.origin, dvec3(1, 0, 0));
    EXPECT_LT(glm::length(dvec3(frame.above * dvec4(1, 0, 0, 0)) - dvec3(0, 1, 0)), 1e-12);
    Gizmo gizmo;
    gizmo.mode = GizmoMode::move;
    const auto handles = gizmo.handles(session, kSize, 60);
    ASSERT_EQ(handles.size(), 4u);
    const Projection projection(session.camera(), kSize);
    const dvec2 origin = *projection.pixel({0, 1, 0}), up = *projection.pixel({0, 1.01, 0});
    const dvec2 along = handles[0].lines[0][1] - origin;
    EXPECT_GT(glm::dot(glm::normalize(along), glm::normalize(up - origin)), 0.99) << "X of the hand is the world's Y";
    gizmo.begin(session, kSize, 60, 0, origin + along);
    gizmo.drag(session, origin + 1.5 * along);
    gizmo.end(session);
    const NodeEdit edit = node_edit(session.edits, "hand");
    EXPECT_GT(edit.translate.x, 0);
    EXPECT_EQ(edit.translate.y, 0);
    session.select(*projection.pixel(dvec3(0, 1 + edit.translate.x, 0)), kSize);
    EXPECT_EQ(session.name_of(session.selection), "node hand") << "it is picked where it is";
}

TEST_F(ViewEdits, EnvironmentsAreChosenAndUndone) {
    const Environment own = session.scene().environment;
    session.open(session.lighting(SkyPreset::studio)());
    EXPECT_GT(session.scene().environment.map.width, 0);
    EXPECT_EQ(session.environment(), EnvironmentChoice(SkyPreset::studio));
    record();
    const CameraPose pose = session.pose();
    session.open(session.lighting(ClearSky{30, 120})());
    EXPECT_EQ(session.scene().lights.size(), 1u) << "the sun";
    record();
    auto undone = session.restore(*history.undo());
    ASSERT_TRUE(undone);
    session.open((*undone)());
    EXPECT_EQ(session.environment(), EnvironmentChoice(SkyPreset::studio));
    EXPECT_TRUE(session.scene().lights.empty());
    undone = session.restore(*history.undo());
    ASSERT_TRUE(undone);
    session.open((*undone)());
    EXPECT_EQ(session.scene().environment.color, own.color);
    EXPECT_EQ(session.scene().environment.map.width, own.map.width);
    EXPECT_EQ(session.pose(), pose);
}

}  // namespace
}  // namespace halflight::view
