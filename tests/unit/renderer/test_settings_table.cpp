// Tests the table of render settings: values as text, ranges, and its page in docs.
#include "engine/settings/settings_table.h"

#include <gtest/gtest.h>

#include <limits>
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
    s.transparent = s.show_lamps = true;
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
    s.backfaces = Backfaces::show;
    s.keep_noisy = true;
    s.estimator = {.lights = LightChoice::tree, .sampler = SamplePoints::blue_noise};
    s.preview = {.cache = true, .filter = true};
    s.kept = Kept({"shadow", "light samples along paths"});
    return s;
}

TEST(SettingsTable, TextsAreReadBack) {
    const RenderSettings from = unusual();
    RenderSettings to;
    std::set<std::string_view> names;
    for (const Setting& s : known_settings()) {
        EXPECT_TRUE(names.insert(s.name).second) << s.name;
        EXPECT_NE(s.get(from), s.get(to)) << s.name;
        copy_setting(s, from, to);
    }
    for (const Setting& s : known_settings()) EXPECT_EQ(s.get(from), s.get(to)) << s.name;
    EXPECT_EQ(to.clamp, from.clamp);
    EXPECT_EQ(to.filter, from.filter);
    EXPECT_EQ(to.view, from.view);
}

TEST(SettingsTable, ValuesOutOfRangeAreRefused) {
    const std::pair<const char*, std::vector<const char*>> refusals[] = {
        {"samples", {"0", "1.5", "16777217"}},
        {"clamp", {"1e-9", "-1"}},
        {"exposure", {"nan", "65"}},
        {"shutter-speed", {"1/0", "1/-5", "1/", "1/nan", "1/1e99"}},
        {"fstop", {"0.01"}},
        {"focus", {"0", "-1", "nan", "inf", "1e10", "1.5,0.5", "0.5,-0.1", "0.5,", ",0.5", "nan,0", "1,1,1", ""}},
        {"blades", {"1", "2", "65"}},
        {"aperture", {"-1"}},
        {"error", {"0.5 psnr"}},
        {"culling", {"cpu"}},
        {"denoise-frames", {"5"}},
        {"half", {"1"}},
        {"aov", {"depht"}}};
    RenderSettings s = unusual();
    for (const auto& [name, texts] : refusals)
        for (const char* text : texts) {
            const std::string before = setting(name).get(s), problem = setting(name).set(s, text);
            EXPECT_NE(problem, "") << name << " " << text;
            EXPECT_EQ(problem.find('\n'), std::string::npos) << problem;
            EXPECT_EQ(setting(name).get(s), before) << name << " " << text;
        }
    EXPECT_NO_THROW(check_setting_ranges(s));
    s.clamp = -1;
    EXPECT_TRUE(error_message([&] { check_setting_ranges(s); }).starts_with("render settings: clamp expects "));
}

TEST(SettingsTable, TextsHaveTheirMeaning) {
    RenderSettings s;
    const auto set = [&](const char* name, const char* text) { EXPECT_EQ(setting(name).set(s, text), "") << text; };
    set("clamp", "0");
    EXPECT_EQ(s.clamp, 0);
    set("exposure", "-2.5");
    EXPECT_EQ(s.view.exposure, Exposure(-2.5f));
    set("exposure", "auto");
    EXPECT_TRUE(s.view.metered());
    set("shutter-speed", "1/250");
    EXPECT_EQ(s.view.camera.shutter_speed.seconds, 0.004f);
    const Focus foci[] = {{.kind = Focus::Kind::point, .point = {0.25, 1}},
                          {.kind = Focus::Kind::distance, .distance = std::numeric_limits<double>::infinity()},
                          {.kind = Focus::Kind::none},
                          {.kind = Focus::Kind::distance, .distance = 2.5}};
    for (std::size_t i = 0; const char* text : {"0.25,1", "infinity", "none", "2.5"}) {
        set("focus", text);
        EXPECT_EQ(s.view.camera.lens.focus, foci[i++]) << text;
        EXPECT_EQ(setting("focus").get(s), text);
    }
    set("blades", "0");
    set("error", "0.5 mse");
    set("filter", "blackman-harris");
    EXPECT_EQ(s.filter.radius, 1.5) << "the usual one of the shape";
    set("denoise-frames", "0");
    EXPECT_EQ(s.denoise_frames, 0);
    set("denoise-frames", "auto");
    EXPECT_FALSE(s.denoise_frames);
    set("aov", "all");
    EXPECT_EQ(s.aovs.size() + 5, known_aovs().size()) << "all but three for debugging and two of the denoiser";
}

TEST(SettingsTable, PageInDocsIsUpToDate) {
    EXPECT_EQ(read_file(HALFLIGHT_SOURCE_DIR "/docs/settings.md", 1 << 20), settings_markdown())
        << "run: halflight info --list-settings > docs/settings.md";
}

}  // namespace
}  // namespace halflight
