// Tests the table of render settings: values as text, ranges, and its page in docs.
#include "engine/settings/settings_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/settings/layers.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

/// Returns settings whose values all differ from the defaults.
RenderSettings unusual() {
    RenderSettings s;
    s.width = 3, s.height = 65536;
    s.filter = {PixelFilter::Shape::blackman_harris, 1.0 / 3};
    s.clamp = 0.1f;
    s.texture_lod = true;
    s.crop = PixelWindow{{-3, 4}, {50, 60}};
    s.overscan = 8;
    s.transparent = true;
    s.parts = 3;
    s.samples = 7;
    s.time_limit = 1e-3;
    s.error = ErrorTarget{ErrorMetric::mse, 0.1};
    s.seed = 4294967295u;
    s.frame = 12;
    s.adaptive = true;
    s.denoise = true;
    s.denoise_frames = 3;
    s.denoise_error = 16;
    s.aovs = {"albedo", "nodes"};
    s.half_color = true;
    s.bounces = 0;
    s.view = {"a display", "a view", "a look, -another", -0.7f, {200, {0.01f}, {}}};
    s.view.camera.lens = {2.8f, 5, 24, {.kind = Focus::Kind::distance, .distance = 0.1}, 7, -30};
    s.optics = {Projection::equisolid, 200, Stereo::views, 0.1, 7};
    s.culling = rays::Culling::raster;
    s.primary = PrimaryVisibility::traced;
    s.estimator = {.lights = LightChoice::tree, .sampler = SamplePoints::blue_noise};
    s.preview = {.cache = true, .filter = true};
    s.kept = Kept({"shadow", "light samples along paths"});
    return s;
}

TEST(SettingsTable, TextsAreReadBack) {
    const RenderSettings from = unusual();
    RenderSettings to;
    for (const Setting& s : known_settings()) {
        EXPECT_NE(s.get(from), s.get(to)) << s.name;
        copy_setting(s, from, to);
    }
    for (const Setting& s : known_settings()) EXPECT_EQ(s.get(from), s.get(to)) << s.name;
    EXPECT_EQ(to.clamp, from.clamp);
    EXPECT_EQ(to.filter, from.filter);
    EXPECT_EQ(to.error, from.error);
    EXPECT_EQ(to.aovs, from.aovs);
    EXPECT_EQ(to.view, from.view);
    EXPECT_EQ(to.kept, from.kept);
    EXPECT_EQ(to.crop, from.crop);
}

TEST(SettingsTable, NamesAreUnique) {
    std::set<std::string_view> names;
    for (const Setting& s : known_settings()) EXPECT_TRUE(names.insert(s.name).second) << s.name;
}

TEST(SettingsTable, ValuesOutOfRangeAreRefused) {
    RenderSettings s;
    const auto problem = [&](const char* name, const std::string& text) { return setting(name).set(s, text); };
    EXPECT_EQ(problem("samples", "16"), "");
    EXPECT_EQ(s.samples, 16);
    EXPECT_EQ(problem("samples", "0"), "expects a whole number from 1 to 16777216, not '0'");
    EXPECT_EQ(problem("samples", "1.5"), "expects a whole number from 1 to 16777216, not '1.5'");
    EXPECT_EQ(problem("clamp", "0"), "");
    EXPECT_EQ(problem("clamp", "1e-9"), "expects 0 or a number from 1e-06 to 1e+30, not '1e-9'");
    EXPECT_EQ(problem("exposure", "nan"), "expects auto or a number from -64 to 64, not 'nan'");
    EXPECT_EQ(problem("exposure", "-2.5"), "");
    EXPECT_EQ(s.view.exposure, Exposure(-2.5f));
    EXPECT_EQ(problem("exposure", "auto"), "");
    EXPECT_TRUE(s.view.metered());
    EXPECT_EQ(problem("shutter-speed", "1/250"), "");
    EXPECT_EQ(s.view.camera.shutter_speed.seconds, 0.004f);
    for (const char* text : {"1/0", "1/-5", "1/", "1/nan", "1/1e99"})
        EXPECT_EQ(problem("shutter-speed", text),
                  std::string("expects 0, a number from 1e-06 to 100000 or 1/N, not '") + text + "'");
    EXPECT_EQ(problem("fstop", "0.01"), "expects 0 or a number from 0.1 to 1000, not '0.01'");
    using Kind = Focus::Kind;
    const Focus& focus = s.view.camera.lens.focus;
    EXPECT_EQ(problem("focus", "0.25,1"), "");
    EXPECT_EQ(focus, (Focus{.kind = Kind::point, .point = {0.25, 1}}));
    EXPECT_EQ(setting("focus").get(s), "0.25,1");
    EXPECT_EQ(problem("focus", "infinity"), "");
    EXPECT_TRUE(std::isinf(focus.distance));
    EXPECT_EQ(setting("focus").get(s), "infinity");
    EXPECT_EQ(problem("focus", "none"), "");
    EXPECT_EQ(setting("focus").get(s), "none");
    EXPECT_EQ(problem("focus", "2.5"), "");
    for (const char* text :
         {"0", "-1", "nan", "inf", "1e10", "1.5,0.5", "0.5,-0.1", "0.5,", ",0.5", "nan,0", "1,1,1", ""})
        EXPECT_EQ(problem("focus", text), fmt::format("expects auto, none, infinity, a distance from 1e-06 to "
                                                      "1000000000, or X,Y from 0 to 1, not '{}'",
                                                      text));
    EXPECT_EQ(focus, (Focus{.kind = Kind::distance, .distance = 2.5})) << "unchanged";
    for (const char* text : {"1", "2", "65"})
        EXPECT_EQ(problem("blades", text), fmt::format("expects 0 or a whole number from 3 to 64, not '{}'", text));
    EXPECT_EQ(problem("blades", "0"), "");
    EXPECT_EQ(problem("aperture", "-1"), "expects 0 or a number from 1e-06 to 1000000, not '-1'");
    EXPECT_EQ(problem("error", "0.5 mse"), "");
    EXPECT_EQ(problem("error", "0.5 psnr"), "expects one of relmse, mse, not 'psnr'");
    EXPECT_EQ(problem("filter", "blackman-harris"), "");
    EXPECT_EQ(s.filter.radius, 1.5) << "the usual one of the shape";
    EXPECT_EQ(problem("culling", "cpu"), "expects one of auto, compute, raster, off, native, not 'cpu'");
    EXPECT_EQ(problem("denoise-frames", "5"), "expects auto or a whole number from 0 to 4, not '5'");
    EXPECT_EQ(problem("denoise-frames", "0"), "");
    EXPECT_EQ(s.denoise_frames, 0);
    EXPECT_EQ(problem("denoise-frames", "auto"), "");
    EXPECT_FALSE(s.denoise_frames);
    EXPECT_EQ(problem("half", "1"), "expects yes or no, not '1'");
    EXPECT_EQ(problem("aov", "all"), "");
    EXPECT_EQ(s.aovs.size() + 5, known_aovs().size()) << "all but three for debugging and two of the denoiser";
    EXPECT_TRUE(problem("aov", "depht").starts_with("has no layer 'depht'; known layers are: none, all, emission"));
    EXPECT_EQ(s.samples, 16) << "unchanged";

    RenderSettings wrong;
    wrong.clamp = -1;
    EXPECT_EQ(error_message([&] { check_setting_ranges(wrong); }),
              "render settings: clamp expects 0 or a number from 1e-06 to 1e+30, not '-1'");
    check_setting_ranges(unusual());
}

TEST(SettingsTable, PageInDocsIsUpToDate) {
    EXPECT_EQ(read_file(HALFLIGHT_SOURCE_DIR "/docs/settings.md", 1 << 20), settings_markdown())
        << "run: halflight info --list-settings > docs/settings.md";
}

}  // namespace
}  // namespace halflight
