// The parts of the program that can be asked without running it.
#include <gtest/gtest.h>

#include "tools/halflight/camera.h"
#include "tools/halflight/console.h"
#include "tools/halflight/progress.h"

namespace halflight {
namespace {

TEST(Progress, ClockText) {
    EXPECT_EQ(clock_text(-1), "0:00");
    EXPECT_EQ(clock_text(7.9), "0:07");
    EXPECT_EQ(clock_text(754), "12:34");
    EXPECT_EQ(clock_text(3723), "1:02:03");
}

TEST(Progress, RemainingFollowsThePace) {
    EXPECT_DOUBLE_EQ(seconds_remaining({16, 64, 4}, 0), 12);
    EXPECT_DOUBLE_EQ(seconds_remaining({64, 64, 4}, 0), 0);
    EXPECT_DOUBLE_EQ(seconds_remaining({0, 64, 4}, 0), 0);         // nothing is known yet
    EXPECT_DOUBLE_EQ(seconds_remaining({10, 1 << 24, 4}, 10), 6);  // the time decides
    EXPECT_EQ(progress_text({16, 64, 4}, 0), "16/64 samples, 0:04 elapsed, 0:12 remaining");
    EXPECT_EQ(progress_text({10, 1 << 24, 4}, 10), "10 samples, 0:04 elapsed, 0:06 remaining");
}

TEST(Console, OneLineWhateverIsQuoted) {
    EXPECT_EQ(one_line("a\nb\x1b[31m"), "a?b?[31m");
    EXPECT_EQ(one_line("größe"), "größe");
}

TEST(PictureSize, WhatIsNotGivenFollowsFromTheCamera) {
    Camera square;
    square.aspect = 1;
    const auto size = [](std::optional<int> width, std::optional<int> height, const Camera& camera) {
        RenderArguments arguments;
        arguments.width = width;
        arguments.height = height;
        return picture_size(arguments, camera);
    };
    EXPECT_EQ(size({}, {}, {}), ivec2(1280, 720));
    EXPECT_EQ(size({}, {}, square), ivec2(1280, 1280));
    EXPECT_EQ(size(640, {}, {}), ivec2(640, 360));
    EXPECT_EQ(size({}, 100, square), ivec2(100, 100));
    EXPECT_EQ(size(3, 7, square), ivec2(3, 7));
    Camera flat;
    flat.aspect = 1e9;
    EXPECT_EQ(size(640, {}, flat), ivec2(640, 1));
    EXPECT_EQ(size({}, 640, flat), ivec2(kMaxSide, 640));
}

TEST(WorldToClip, CornersOfTheView) {
    Camera camera;
    camera.vertical_fov = 1;
    camera.camera_to_world[3] = dvec4(1, 2, 3, 1);
    const double up = 10 * std::tan(0.5), right = 2 * up;
    const auto project = [&](const dvec3& p) {
        const dvec4 clip = standard_clip(camera, 2) * dvec4(p, 1);
        return dvec2(clip) / clip.w;
    };
    for (const double far_plane : {0.0, 100.0}) {
        camera.far_plane = far_plane;
        const dvec2 corner = project({1 + right, 2 + up, 3 - 10});
        EXPECT_NEAR(corner.x, 1, 1e-12);
        EXPECT_NEAR(corner.y, 1, 1e-12);
    }
    camera.orthographic = true;
    camera.ortho_height = 4;
    const dvec2 corner = project({1 - 4, 2 - 2, -50});
    EXPECT_NEAR(corner.x, -1, 1e-12);
    EXPECT_NEAR(corner.y, -1, 1e-12);
}

}  // namespace
}  // namespace halflight
