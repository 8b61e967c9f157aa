// Tests camera movements and picking in the viewer.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/support/scenes.h"
#include "tools/view/camera_control.h"
#include "tools/view/pick.h"

namespace halflight::view {
namespace {

void expect_near(const dvec3& a, const dvec3& b, double tolerance = 1e-12) {
    EXPECT_LT(glm::length(a - b), tolerance)
        << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y << " " << b.z;
}

/// Returns the pose of a camera at z = 2 that looks at the origin.
CameraPose front() {
    CameraPose pose;
    pose.from = {0, 0, 2};
    return pose;
}

CameraPose orthographic(CameraPose pose, double height) {
    pose.orthographic = true;
    pose.ortho_height = height;
    return pose;
}

TEST(CameraPose, EqualPosesGiveEqualCameras) {
    CameraPose pose = front();
    pose.from = {0.1, 0.7, 2.3};
    pose.vertical_fov = 0.7;
    const Camera camera = camera_of(pose);
    EXPECT_EQ(camera.camera_to_world, camera_of(pose).camera_to_world);
    const CameraPose again = pose_of(camera, glm::length(pose.from - pose.at));
    expect_near(again.from, pose.from);
    expect_near(again.at, pose.at);
    EXPECT_EQ(again.up, pose.up) << "it does not roll";
    EXPECT_EQ(again.vertical_fov, pose.vertical_fov);
}

TEST(CameraPose, RollAndLookingDownAreKept) {
    for (const dvec3& up : {dvec3(1, 1, 0), dvec3(0, -1, 0), dvec3(0.3, 1, 0.2)}) {
        CameraPose pose = front();
        pose.up = up;
        const Camera camera = camera_of(pose), again = camera_of(pose_of(camera, 5));
        for (int axis = 0; axis < 3; ++axis)
            expect_near(dvec3(again.camera_to_world[axis]), dvec3(camera.camera_to_world[axis]));
    }
    CameraPose down = front();
    down.from = {0, 3, 0};
    down.up = {1, 0, 0};
    expect_near(dvec3(camera_of(pose_of(camera_of(down), 3)).camera_to_world[1]), dvec3(1, 0, 0));
}

TEST(CameraPose, DegenerateViewsAreErrors) {
    CameraPose pose = front();
    pose.at = pose.from;
    EXPECT_THROW(camera_of(pose), Error);
    EXPECT_THROW(camera_of(orthographic(front(), 0)), Error);
}

TEST(CameraControl, TheSceneFollowsTheDrag) {
    const CameraPose right = orbit(front(), {kPi / 2, 0});
    expect_near(right.from, {-2, 0, 0});
    const CameraPose down = orbit(front(), {0, kPi / 4});
    expect_near(down.from, {0, std::sqrt(2), std::sqrt(2)});
    for (const double angle : {100.0, -100.0}) {
        const CameraPose pole = orbit(front(), {0, angle});
        EXPECT_NO_THROW(camera_of(pole)) << "short of the pole";
        EXPECT_NEAR(pole.from.y, std::copysign(2, angle), 1e-5);
        EXPECT_NEAR(glm::length(pole.from), 2, 1e-9);
    }
    // A drag over the whole height of the window moves the point `at` by the whole height of the view.
    CameraPose panned = pan(front(), {0, 1});
    EXPECT_NEAR(panned.from.y, 2 * 2 * std::tan(kPi / 8), 1e-12);
    EXPECT_EQ(panned.at.y, panned.from.y);
    EXPECT_LT(pan(front(), {0.1, 0}).from.x, 0);
    expect_near(dolly(front(), 0.5, 1).from, {0, 0, 1});
}

TEST(CameraControl, TurnAndFly) {
    expect_near(turn(front(), {kPi / 2, 0}).at, {2, 0, 2});
    const CameraPose down = turn(front(), {0, kPi / 4});
    expect_near(down.at, {0, -std::sqrt(2), 2 - std::sqrt(2)});
    EXPECT_EQ(down.from, front().from);
    const CameraPose flown = fly(front(), {1, 2, 0.5});
    expect_near(flown.from, {1, 2, 1.5});
    expect_near(flown.at, {1, 2, -0.5});
    // A walk is horizontal for any viewing direction.
    const CameraPose walked = walk(down, {1, 2, 0.5});
    expect_near(walked.from, {1, 2, 1.5});
    expect_near(walked.at - walked.from, down.at - down.from);
    CameraPose rolled = front();
    rolled.up = {0.3, 1, 0};
    expect_near(walk(rolled, {1, 0, 1}).from, {1, 0, 1});
}

TEST(CameraControl, SeesTheFocusFromEachSide) {
    for (const dvec3& side : {dvec3(1, 0, 0), dvec3(0, 0, -1), dvec3(0, 1, 0), dvec3(0, -1, 0)}) {
        const CameraPose seen = seen_from(front(), side);
        EXPECT_NO_THROW(camera_of(seen));
        EXPECT_EQ(seen.at, front().at);
        EXPECT_LT(glm::length(seen.from - 2.0 * side), 0.01);
    }
}

TEST(CameraControl, OrthographicViewsZoom) {
    const CameraPose pose = orthographic(front(), 4);
    EXPECT_EQ(dolly(pose, 0.5, 1), orthographic(front(), 2));
    EXPECT_NEAR(pan(pose, {0, 0.5}).from.y, 2, 1e-12);
}

TEST(CameraControl, ADollyKeepsAMinimumDistance) {
    for (const bool orthographic : {false, true}) {
        for (const dvec3& at : {dvec3(0), dvec3(1e6, -2e6, 3e6)}) {
            CameraPose pose = front();
            pose.from += at, pose.at += at, pose.orthographic = orthographic;
            for (int i = 0; i < 2000; ++i) pose = dolly(pose, 0.5, 10);
            EXPECT_NO_THROW(camera_of(pose));
            EXPECT_NO_THROW(camera_of(orbit(pose, {0.3, 0.2})));
            const auto distance = [&] { return orthographic ? pose.ortho_height : glm::length(pose.from - pose.at); };
            const double nearest = distance();
            EXPECT_LT(nearest, 0.01);
            pose = dolly(pose, 2, 10);
            EXPECT_NEAR(distance() / nearest, 2, 1e-3) << "it cannot move away";
        }
    }
    CameraPose near = front();
    near.from.z = 1e-12;
    EXPECT_EQ(dolly(near, 0.5, 10), near) << "it is pushed away";
}

TEST(CameraControl, LooksAtAPoint) {
    const CameraPose pose = look_at(front(), {1, 1, 0});
    EXPECT_EQ(pose.from, front().from);
    EXPECT_EQ(pose.at, dvec3(1, 1, 0));
    EXPECT_EQ(look_at(front(), front().from), front());
    for (const double y : {5.0, -5.0}) {
        const CameraPose above = look_at(front(), {0, y, 2});
        EXPECT_NO_THROW(camera_of(above));
        EXPECT_EQ(above.at, dvec3(0, y, 2));
        expect_near(above.from, front().from, 0.05);
    }
}

TEST(CameraControl, FramesTheWholeBox) {
    const WorldBounds tall{{2, 3, 4}, {4, 7, 5}}, wide{{-9, 1, 2}, {9, 2, 3}};
    for (const bool orthographic : {false, true}) {
        for (const auto& [box, aspect] : {std::pair{tall, 2.0}, {tall, 0.5}, {wide, 2.0}, {wide, 0.5}}) {
            CameraPose pose = orbit(front(), {0.3, 0.2});
            pose.orthographic = orthographic;
            pose = frame(pose, box, aspect);
            const dmat4 to_camera = glm::inverse(camera_of(pose).camera_to_world);
            double most = 0;
            for (int corner = 0; corner < 8; ++corner) {
                const dvec3 p(corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                              corner & 4 ? box.upper.z : box.lower.z);
                const dvec3 c(to_camera * dvec4(p, 1));
                const double half = orthographic ? pose.ortho_height / 2 : -c.z * std::tan(pose.vertical_fov / 2);
                most = std::max({most, std::abs(c.y) / half, std::abs(c.x) / (half * aspect)});
            }
            EXPECT_LE(most, 1.0) << "some of it is out of view";
            EXPECT_GT(most, 0.3) << "it is far away";
        }
    }
    EXPECT_EQ(frame(front(), {}, 1), front());
}

TEST(RayThrough, CornersAndCentre) {
    const CameraPose pose = front();
    expect_near(ray_through(camera_of(pose), {100, 50}, {200, 100}).direction, {0, 0, -1});
    const Ray corner = ray_through(camera_of(pose), {0, 0}, {200, 100});
    const double half = std::tan(kPi / 8);
    expect_near(corner.direction, glm::normalize(dvec3(-2 * half, half, -1)));
    const Ray edge = ray_through(camera_of(orthographic(pose, 2)), {200, 100}, {200, 100});
    expect_near(edge.origin, {2, -1, 2});
    expect_near(edge.direction, {0, 0, -1});
}

std::shared_ptr<Scene> boxes(int count) {
    auto scene = std::make_shared<Scene>();
    const int material = test::add_material(*scene, test::diffuse_material(vec3(0.5f)));
    for (int i = 0; i < count; ++i) test::add_box(*scene, material, vec3(-1), vec3(1));
    return scene;
}

TEST(Picker, SeesWhatIsBetweenThePlanesOfTheCamera) {
    const Picker picker(boxes(1));
    Camera camera = camera_of(front());
    camera.camera_to_world = dmat4(1);
    camera.camera_to_world[3] = {0, 0, 5, 1};
    const auto depth = [&](double near, double far) {
        camera.near_plane = near, camera.far_plane = far;
        // The ray is oblique, and planes have their distances along the axis.
        const auto picked = picker.pick(ray_through(camera, {80, 50}, {100, 100}));
        return picked ? 5 - picked->position.z : 0;
    };
    for (const bool orthographic : {false, true}) {
        camera.orthographic = orthographic, camera.ortho_height = 2;
        EXPECT_NEAR(depth(0, 0), 4, 1e-9);
        EXPECT_NEAR(depth(3.99, 0), 4, 1e-9);
        EXPECT_GT(depth(4.01, 0), 4.01);
        EXPECT_NEAR(depth(0, 4.01), 4, 1e-9);
        EXPECT_EQ(depth(0, 3.99), 0);
    }
}

TEST(Picker, FindsTheNearestSurface) {
    const std::shared_ptr<Scene> scene = boxes(2);
    // The second instance is flat, is further away and to the right, and is rotated by 45 degrees.
    scene->instances[1].object_to_world =
        dmat4(dvec4(0.5, 0, 0.5, 0), dvec4(0, 1, 0, 0), dvec4(-0.5, 0, 0.5, 0), dvec4(4, 0, -3, 1));
    const Picker picker(scene);
    const auto first = picker.pick({{0.25, 0.5, 9}, {0, 0, -1}});
    ASSERT_TRUE(first);
    EXPECT_EQ(first->instance, 0u);
    expect_near(first->position, {0.25, 0.5, 1});
    const auto second = picker.pick({{4.25, 0.5, 9}, {0, 0, -1}});
    ASSERT_TRUE(second);
    EXPECT_EQ(second->instance, 1u);
    expect_near(second->position, {4.25, 0.5, -3 + 0.75}, 1e-6);
    EXPECT_FALSE(picker.pick({{0, 2, 9}, {0, 0, -1}}));
    EXPECT_FALSE(picker.pick({{0, 0, 9}, {0, 0, 1}})) << "behind";
    const WorldBounds box = picker.bounds(1);
    expect_near(box.lower, {3, -1, -4});
    expect_near(box.upper, {5, 1, -2});
}

}  // namespace
}  // namespace halflight::view
