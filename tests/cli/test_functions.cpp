// Tests functions of the program without running it.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <functional>

#include "api/halflight/camera.h"
#include "api/halflight/frame_names.h"
#include "tools/cli/console.h"
#include "tools/halflight/progress.h"

namespace halflight {
namespace {

TEST(ProgressText, ClockText) {
    EXPECT_EQ(clock_text(-1), "0:00");
    EXPECT_EQ(clock_text(7.9), "0:07");
    EXPECT_EQ(clock_text(754), "12:34");
    EXPECT_EQ(clock_text(3723), "1:02:03");
}

TEST(ProgressText, RemainingFollowsThePace) {
    EXPECT_DOUBLE_EQ(seconds_remaining({16, 64, 4}, 0).value(), 12);
    EXPECT_DOUBLE_EQ(seconds_remaining({64, 64, 4}, 0).value(), 0);
    EXPECT_EQ(seconds_remaining({0, 64, 4}, 0), std::nullopt);             // nothing is known yet
    EXPECT_DOUBLE_EQ(seconds_remaining({10, 1 << 24, 4}, 10).value(), 6);  // the time limit decides
    EXPECT_EQ(progress_text({16, 64, 4}, 0), "16/64 samples, 0:04 elapsed, 0:12 remaining");
    EXPECT_EQ(progress_text({10, 1 << 24, 4}, 10), "10 samples, 0:04 elapsed, 0:06 remaining");
    EXPECT_EQ(progress_text({0, 64, 4}, 0), "0/64 samples, 0:04 elapsed");
}

TEST(ProgressText, EarlierRunsAddToTheShareAndNotToThePace) {
    const EarlierRuns earlier{32, 100};
    EXPECT_DOUBLE_EQ(seconds_remaining({48, 64, 4}, 0, earlier).value(), 4);
    EXPECT_EQ(seconds_remaining({32, 64, 4}, 0, earlier), std::nullopt);
    EXPECT_DOUBLE_EQ(seconds_remaining({64, 64, 0}, 0, {64, 100}).value(), 0);
    EXPECT_DOUBLE_EQ(seconds_remaining({48, 1 << 24, 4}, 110, earlier).value(), 6);
}

TEST(ProgressText, AsJson) {
    EXPECT_EQ(progress_json({0, 64, 2}, 0), R"("share": 0.0000, "samples": 0, "samples_total": 64, "seconds": 2.00, )"
                                            R"("seconds_remaining": null)");
    EXPECT_EQ(progress_json({48, 64, 4}, 0, {32, 100}),
              R"("share": 0.7500, "samples": 48, "samples_total": 64, "seconds": 4.00, "seconds_remaining": 4.00)");
}

/// Returns what a display of two frames has written.
std::string shown(double time_limit, const std::function<void(SequenceDisplay&)>& show) {
    std::FILE* const file = std::tmpfile();
    {
        SequenceDisplay display(file, ProgressForm::json, 2, time_limit);
        show(display);
    }
    std::string text(static_cast<std::size_t>(std::ftell(file)), ' ');
    std::rewind(file);
    EXPECT_EQ(std::fread(text.data(), 1, text.size(), file), text.size());
    std::fclose(file);
    return text;
}

TEST(ProgressText, OfFramesWithATimeLimit) {
    EXPECT_EQ(shown(10,
                    [](SequenceDisplay& d) {
                        d.show(1, {3, kMaxSamples, 4});
                    }),
              "{\"frame\": 1, \"share\": 0.4000, \"samples\": 3, \"samples_total\": null, \"seconds\": 4.00, "
              "\"seconds_remaining\": 6.00}\n");
}

TEST(ProgressText, CountsFramesOfOtherProcesses) {
    const std::string text = shown(0, [](SequenceDisplay& d) {
        d.found(1, 1, 2);
        d.made(2, 1, 0, 4);
    });
    EXPECT_EQ(text,
              "{\"frame\": 1, \"made\": 0, \"failed\": 0, \"found\": 1, \"frames\": 2, \"seconds\": 2.00}\n"
              "{\"frame\": 2, \"made\": 1, \"failed\": 0, \"found\": 1, \"frames\": 2, \"seconds\": 4.00}\n");
}

TEST(ProgressText, OfASequence) {
    EXPECT_EQ(sequence_text(0, 24, 0), "0/24 frames, 0.00 s/frame, 0:00 remaining");
    EXPECT_EQ(sequence_text(3, 24, 3.6), "3/24 frames, 1.20 s/frame, 0:26 remaining");
    EXPECT_EQ(sequence_text(24, 24, 48), "24/24 frames, 2.00 s/frame, 0:00 remaining");
}

TEST(FrameNames, PlaceholdersStandForNumbers) {
    const auto name = [](const char* pattern, FrameNumber frame) { return frame_path(pattern, frame).string(); };
    EXPECT_EQ(name("shot.####.exr", 7), "shot.0007.exr");
    EXPECT_EQ(name("shot.%04d.exr", 7), "shot.0007.exr");
    EXPECT_EQ(name("shot.%d.exr", 7), "shot.7.exr");
    EXPECT_EQ(name("#", 123), "123");
    EXPECT_EQ(name("##.png", 4294967295u), "4294967295.png");
    EXPECT_EQ(name("%012d", 1), "000000000001");
    EXPECT_EQ(name("shot.####.exr", -5), "shot.-0005.exr");
    EXPECT_EQ(name("shot.%04d.exr", -5), "shot.-005.exr");
    EXPECT_EQ(name("#", -123), "-123");
    EXPECT_EQ(name("a#b%c/f{}#.exr", 5), "a#b%c/f{}5.exr") << "folders stay as they are";
    EXPECT_EQ(name("/x/%%02d", 5), "/x/%05");
    for (const auto& [pattern, count] :
         {std::pair("a.exr", 0), {"a#/b.exr", 0}, {"%4d", 0}, {"%x", 0}, {"%d", 1}, {"#.#", 2}, {"####%d", 2}})
        EXPECT_EQ(count_placeholders(pattern), count) << pattern;
    EXPECT_EQ(count_placeholders(std::string(1 << 20, '#')), 1);
    EXPECT_EQ(count_placeholders(std::string(1 << 20, '%')), 0);
}

TEST(Console, OneLineForAnyText) {
    EXPECT_EQ(one_line("a\nb\x1b[31m \n"), "a b?[31m");
    EXPECT_EQ(one_line("größe"), "größe");
    EXPECT_EQ(one_line("a\xc2\x9b"
                       "31m \xc2\xa0"),
              "a?31m \xc2\xa0")
        << "C1 controls, but no-break spaces stay";
    for (const char* bad :
         {"\x9b", "\xe4", "\xe2\x82", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xff"})
        EXPECT_EQ(one_line("a" + std::string(bad) + "z"), "a" + std::string(std::strlen(bad), '?') + "z")
            << "is not UTF-8; a terminal of another encoding may obey it";
    for (const char* good : {"\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xef\xbf\xbd", "\xed\x9f\xbf", "\xf4\x8f\xbf\xbf"})
        EXPECT_EQ(one_line(good), good);
    std::string longest;
    for (int i = 0; i < 100000; ++i) longest += "ö";
    const std::string cut = one_line("x" + longest + "end");
    EXPECT_LE(cut.size(), kMostMessage);
    EXPECT_TRUE(cut.starts_with("xö") && cut.ends_with("öend") && cut.find("ö [...] ö") != std::string::npos) << cut;
    EXPECT_LE(std::string(Error(longest, longest).what()).size(), kMostMessage);
    EXPECT_EQ(Error("", "why").reason(), "why");
    EXPECT_EQ(Error("a: b\n", "why: so").reason(), "why: so");
    EXPECT_EQ(Error("a", "").reason(), "a:");
    EXPECT_TRUE(Error("a", longest).reason().starts_with("ö"));
    EXPECT_EQ(Error(longest, "why").reason(), Error(longest, "why").what());
}

TEST(PictureSize, MissingSizesFollowFromTheCamera) {
    Camera square;
    square.aspect = 1;
    const auto size = [](std::optional<int> width, std::optional<int> height, const Camera& camera) {
        return picture_size(width, height, 1280, camera);
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

TEST(PictureSize, BothEyesHaveWholePixels) {
    const auto size = [](Optics optics, std::optional<int> width, std::optional<int> height) {
        return picture_size(width, height, 1280, with_optics({}, optics));
    };
    EXPECT_EQ(size({.projection = Projection::panorama, .stereo = Stereo::views}, 101, {}), ivec2(101, 102));
    EXPECT_EQ(size({.projection = Projection::fisheye, .stereo = Stereo::side_by_side}, {}, 101), ivec2(202, 101));
    EXPECT_EQ(size({.stereo = Stereo::side_by_side}, {}, 99), ivec2(352, 99)) << "twice 176";
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
