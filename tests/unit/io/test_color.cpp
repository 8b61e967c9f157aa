// Tests colour management: the built-in config, display views against published curves, other configs, errors, and the
// GLSL code.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "engine/color/color.h"
#include "engine/color/ocio.h"
#include "engine/core/error.h"
#include "shaders/shared/tone_map.h"
#include "tests/support/error_message.h"
#include "tests/unit/core/environment_variable.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

const fs::path kConfigs = fs::path(HALFLIGHT_SHARED_DIR) / "assets/ocio";
const fs::path kCgConfig = kConfigs / "cg-config-v1.0.0_aces-v1.3_ocio-v2.1.ocio";

const ColorConfig& built_in() {
    static const ColorConfig config = [] {
        const test::EnvironmentVariable none("OCIO", nullptr);
        return ColorConfig::load();
    }();
    return config;
}

vec3 shown(const ViewProcessor& view, const vec3& colour) {
    Image image(1, 1, 3);
    for (int c = 0; c < 3; ++c) image.pixels[c] = colour[c];
    image = view.apply(image);
    return {image.pixels[0], image.pixels[1], image.pixels[2]};
}

/// Returns the sRGB signal of a linear value (IEC 61966-2-1).
double srgb_curve(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

TEST(Color, BuiltInConfigIsValid) {
    const fs::path file = fs::path(HALFLIGHT_SOURCE_DIR) / "engine/color/halflight.ocio";
    EXPECT_NO_THROW(ocio::Config::CreateFromFile(file.c_str())->validate());
    const ColorConfig& config = built_in();
    EXPECT_EQ(config.source(), "built-in");
    EXPECT_EQ(config.displays().size(), 4u);
    for (const std::string& display : config.displays()) {
        const std::optional<DisplayEncoding> encoding = config.view({display, "", "", 0}).encoding();
        ASSERT_TRUE(encoding) << display;
        if (encoding->is_hdr()) continue;
        EXPECT_EQ(config.views(display), (std::vector<std::string>{"ACES 1.0 - SDR Video", "Khronos PBR Neutral", "AgX",
                                                                   "Un-tone-mapped", "Raw"}));
        EXPECT_EQ(config.default_view(display), "ACES 1.0 - SDR Video");
    }
    EXPECT_EQ(config.default_display(), "sRGB - Display");
    EXPECT_TRUE(config.files().empty());
}

TEST(Color, UnToneMappedIsTheDisplaysCurve) {
    const ColorConfig& config = built_in();
    const ViewProcessor srgb = config.view({"sRGB - Display", "Un-tone-mapped", "", 0});
    const ViewProcessor rec1886 = config.view({"Rec.1886 Rec.709 - Display", "Un-tone-mapped", "", 0});
    const ViewProcessor display_p3 = config.view({"Display P3 - Display", "Un-tone-mapped", "", 0});
    const Chromaticities p3{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}};  // SMPTE EG 432-1
    for (double v : {0.0, 0.001, 0.0031308, 0.01, 0.18, 0.5, 0.9, 1.0}) {
        const vec3 colour(static_cast<float>(v), static_cast<float>(1 - v), 0.25f);
        const dvec3 in_p3 = rgb_conversion(kRec709, p3) * dvec3(colour);
        for (int c = 0; c < 3; ++c) {
            SCOPED_TRACE(fmt::format("channel {} of {}", c, v));
            EXPECT_NEAR(shown(srgb, colour)[c], srgb_curve(colour[c]), 1e-4);
            EXPECT_NEAR(shown(rec1886, colour)[c], std::pow(colour[c], 1 / 2.4), 1e-3);
            EXPECT_NEAR(shown(display_p3, colour)[c], srgb_curve(in_p3[c]), 1e-4);
        }
    }
}

/// The encodings of displays are measured, whatever their names.
TEST(Color, EncodingsOfDisplaysAreMeasured) {
    using enum TransferCurve;
    const TemporaryFolder folder;
    const std::pair<const char*, std::optional<DisplayEncoding>> displays[] = {
        {"sRGB", DisplayEncoding{1, srgb}},
        {"REC.1886-REC.709", DisplayEncoding{1, bt1886}},
        {"REC.1886-REC.2020", DisplayEncoding{9, bt1886}},
        {"G2.2-REC.709", DisplayEncoding{1, gamma22}},
        {"G2.6-P3-D65", DisplayEncoding{12, gamma26}},
        {"G2.6-P3-DCI-BFD", DisplayEncoding{11, gamma26}},
        {"G2.6-P3-D60-BFD", std::nullopt},
        {"REC.2100-PQ", DisplayEncoding{9, pq}},
        {"ST2084-P3-D65", DisplayEncoding{12, pq}},
        {"REC.2100-HLG-1000nit", DisplayEncoding{9, hlg}}};
    for (const auto& [style, expected] : displays) {
        std::ofstream(folder / "one.ocio")
            << "ocio_profile_version: 2.1\nroles: {default: ap0, aces_interchange: ap0, cie_xyz_d65_interchange: xyz}\n"
               "displays:\n  D:\n    - !<View> {name: V, view_transform: W, display_colorspace: E}\n"
               "view_transforms:\n  - !<ViewTransform> {name: W, from_scene_reference: !<BuiltinTransform> "
               "{style: UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD}}\n"
               "display_colorspaces:\n  - !<ColorSpace> {name: xyz}\n  - !<ColorSpace>\n    name: E\n"
               "    from_display_reference: !<BuiltinTransform> {style: DISPLAY - CIE-XYZ-D65_to_"
            << style << "}\ncolorspaces:\n  - !<ColorSpace> {name: ap0}\n";
        const auto encoding = ColorConfig::load(folder / "one.ocio").view({"", "", "", 0}).encoding();
        ASSERT_EQ(encoding.has_value(), expected.has_value()) << style;
        if (!encoding) continue;
        EXPECT_EQ(encoding->primaries, expected->primaries) << style;
        EXPECT_EQ(encoding->curve, expected->curve) << style;
    }
    EXPECT_EQ(built_in().view({"Display P3", "agx", "", 0}).encoding(), (DisplayEncoding{12, srgb}));
    EXPECT_FALSE(built_in().view({"", "Raw", "", 0}).encoding());
    // 1 is 100 nits, whose PQ value is 0.508.
    EXPECT_NEAR(shown(built_in().view({"rec.2100-pq", "un-tone-mapped", "", 0}), vec3(1)).y, 0.508, 1e-3);
}

TEST(Color, ExposureIsInStops) {
    const ColorConfig& config = built_in();
    const vec3 colour(0.1f, 0.2f, 0.4f);
    EXPECT_EQ(shown(config.view({"", "Raw", "", 0}), colour), colour);
    EXPECT_EQ(shown(config.view({"", "Raw", "", 1}), colour), 2.0f * colour);
    EXPECT_EQ(shown(config.view({"", "Raw", "", -2}), colour), colour / 4.0f);
    EXPECT_EQ(config.view({"", "Raw", "", 1}).exposure_scale(), 2.0f);
    EXPECT_THROW(config.view({"", "", "", std::numeric_limits<float>::quiet_NaN()}), Error);
}

TEST(Color, AcesViewIsPlausibleAndMonotonic) {
    const ViewProcessor view = built_in().view({});
    // ACES maps middle grey to about 10 of 100 nits. This is a signal of about 0.1^(1/2.4), below the 0.46 of the plain
    // sRGB curve.
    const vec3 grey = shown(view, vec3(0.18f));
    EXPECT_GT(grey.y, 0.3f);
    EXPECT_LT(grey.y, 0.45f);
    EXPECT_NEAR(grey.x, grey.y, 1e-3);
    EXPECT_NEAR(grey.z, grey.y, 1e-3);
    float last = -1;
    for (float v = 0; v < 16; v += 0.05f) {
        const float now = shown(view, vec3(v)).y;
        EXPECT_GE(now, last);
        last = now;
    }
    EXPECT_GT(last, 0.95f);
}

TEST(Color, AgreesWithTheAcesConfig) {
    if (!fs::exists(kCgConfig)) GTEST_SKIP() << kCgConfig << " is not there";
    const ColorConfig& ours = built_in();
    const ColorConfig aces = ColorConfig::load(kCgConfig);
    for (const char* view : {"ACES 1.0 - SDR Video", "Un-tone-mapped", "Raw"}) {
        for (const char* display : {"sRGB - Display", "Rec.1886 Rec.709 - Display"}) {
            for (const vec3& colour : {vec3(0.18f), vec3(0), vec3(5, 0.1f, 0.02f), vec3(0.01f, 0.5f, 2), vec3(100)}) {
                const vec3 a = shown(ours.view({display, view, "", 0}), colour);
                const vec3 b = shown(aces.view({display, view, "", 0}), colour);
                for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 1e-3) << display << ", " << view;
            }
        }
    }
}

/// Returns the result of Khronos PBR Neutral by its specification, which divides cases as written there.
dvec3 pbr_neutral(dvec3 in) {
    in = glm::max(in, dvec3(0));
    const double x = std::min({in.r, in.g, in.b}), f = x <= 0.08 ? x - x * x / 0.16 : 0.04;
    const double p = std::max({in.r - f, in.g - f, in.b - f});
    if (p <= 0.76) return in - f;
    const double pn = 1 - 0.24 * 0.24 / (p + 1 - 1.52), g = 1 / (0.15 * (p - pn) + 1);
    return (in - f) * (pn / p) * g + dvec3(pn) * (1 - g);
}

/// Returns the result of AgX, cut off at the edges of Rec.709. The curve is written as in sigmoid.py; `a` and `b` are
/// the columns of the matrices that three.js has.
dvec3 agx(const dvec3& in) {
    const dmat3 a(0.856627153315983, 0.137318972929847, 0.11189821299995, 0.0951212405381588, 0.761241990602591,
                  0.0767994186031903, 0.0482516061458583, 0.101439036467562, 0.811302368396859);
    const dmat3 b(1.1271005818144368, -0.1413297634984383, -0.14132976349843826, -0.11060664309660323,
                  1.157823702216272, -0.11060664309660294, -0.016493938717834573, -0.016493938717834257,
                  1.2519364065950405);
    const Chromaticities rec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kRec709.white};  // ITU-R BT.2020-2
    dvec3 c = a * (rgb_conversion(kRec709, rec2020) * in);
    for (int i = 0; i < 3; ++i) {
        const double x = std::clamp((std::log2(std::max(c[i], 1e-10)) + 12.47393) / (4.026069 + 12.47393), 0.0, 1.0);
        const double pivot = 10 / 16.5, to_end = x >= pivot ? 1 - pivot : pivot, power = x >= pivot ? 3.25 : 3;
        const double scale =
            (x >= pivot ? 1 : -1) *
            std::pow(std::pow(2 * to_end, -power) * (std::pow(2 * (to_end / 0.5), power) - 1), -1 / power);
        const double t = 2 * (x - pivot) / scale;
        c[i] = scale * t / std::pow(1 + std::pow(t, power), 1 / power) + 0.5;
    }
    return glm::clamp(rgb_conversion(rec2020, kRec709) * glm::pow(glm::max(b * c, dvec3(0)), dvec3(2.2)), 0.0, 1.0);
}

/// Returns greys, primaries and mixed colours of 2^-14 to 2^16, some with negative channels.
std::vector<vec3> patches() {
    std::vector<vec3> colours{vec3(0), vec3(-1), vec3(65504), {65504, -65504, 0}, {0.08f, 0.08f, 0.8f}};
    for (int stop = -14; stop <= 16; ++stop)
        for (int mix = 1; mix < 64; ++mix) {
            constexpr float kParts[] = {0, 0.07f, 0.6f, 1};
            colours.push_back(std::exp2f(float(stop)) * vec3(kParts[mix & 3], kParts[mix / 4 & 3], kParts[mix / 16]));
            if (mix % 4 == 0) colours.back().r = -0.05f * colours.back().b;
        }
    return colours;
}

TEST(Color, ToneMapsAreTheirFormulas) {
    const ViewProcessor neutral = built_in().view({"", "khronos pbr neutral", "", 0}),
                        soft = built_in().view({"", "AgX", "", 0});
    for (const vec3& colour : patches()) {
        const dvec3 in(colour), by_spec = pbr_neutral(in), by_agx = agx(in);
        const vec3 n = shown(neutral, colour), a = shown(soft, colour);
        for (int c = 0; c < 3; ++c) {
            ASSERT_NEAR(n[c], srgb_curve(by_spec[c]), 1e-4) << colour.r << ' ' << colour.g << ' ' << colour.b;
            ASSERT_NEAR(a[c], srgb_curve(by_agx[c]), 1e-4) << colour.r << ' ' << colour.g << ' ' << colour.b;
        }
        // PBR Neutral keeps the order of channels and hence the hue.
        for (int c = 0; c < 3; ++c) {
            const int next = (c + 1) % 3;
            EXPECT_TRUE(colour[c] >= colour[next] || n[c] <= n[next]);
        }
    }
    // Entries of AgX_Default_Contrast.spi1d, of 4096 (github.com/sobotka/AgX, commit 1ba3230).
    const std::pair<int, float> table[] = {
        {1, 0.0000142f}, {1024, 0.0390305f}, {2048, 0.2928964f}, {3072, 0.7776929f}, {4094, 0.9999292f}};
    for (const auto& [entry, signal] : table) EXPECT_NEAR(shared::agx_curve(float(entry) / 4095), signal, 3e-7);
    const ColorConfig copy = ColorConfig::load(fs::path(HALFLIGHT_SOURCE_DIR) / "engine/color/halflight.ocio");
    EXPECT_EQ(shown(copy.view({"", "AgX", "", 0}), vec3(0.3f, 2, 0.1f)), shown(soft, vec3(0.3f, 2, 0.1f)));
    EXPECT_NE(neutral.cache_id(), soft.cache_id());
    EXPECT_NE(neutral.cache_id(), built_in().view({"", "Un-tone-mapped", "", 0}).cache_id());
    EXPECT_NE(neutral.gpu_shader().cache_id, soft.gpu_shader().cache_id);
}

/// Returns CIE L*a*b* of a linear Rec.709 colour, relative to its white (CIE 15).
dvec3 lab(const dvec3& colour) {
    const dmat3 to_xyz = rgb_to_xyz(kRec709);
    const dvec3 ratio = to_xyz * colour / (to_xyz * dvec3(1));
    const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : t * 841 / 108 + 4.0 / 29; };
    return {116 * f(ratio.y) - 16, 500 * (f(ratio.x) - f(ratio.y)), 200 * (f(ratio.y) - f(ratio.z))};
}

// The table of docs/colour-and-layers.md, Views. A base colour b of glossy paint under white light of radiance 1 has
// the radiance b + 0.04 (specification of PBR Neutral, notes).
TEST(Color, ViewsDifferInBaseColoursAndHighlights) {
    struct Row {
        const char* view;
        double colours;     // mean difference between shown and base colour, CIE 1976 L*a*b*
        double highlights;  // L* between greys of radiance 1 and 8
        double hue;         // largest change of the hue of saturated colours of radiance 4, degrees
    };
    for (const Row& row : {Row{"ACES 1.0 - SDR Video", 9.59, 15.49, 5.99}, Row{"Khronos PBR Neutral", 0, 5, 3.92},
                           Row{"AgX", 21.96, 16.62, 13.52}, Row{"Un-tone-mapped", 4.63, 0, 6.76}}) {
        const ViewProcessor view = built_in().view({"", row.view, "", 0});
        const auto seen = [&](const vec3& colour) {
            dvec3 v(shown(view, colour));
            for (int c = 0; c < 3; ++c) v[c] = v[c] <= 0.04045 ? v[c] / 12.92 : std::pow((v[c] + 0.055) / 1.055, 2.4);
            return lab(v);
        };
        const float steps[] = {0.1f, 0.25f, 0.45f, 0.7f};
        double colours = 0, hue = 0;
        for (const float r : steps)
            for (const float g : steps)
                for (const float b : steps) {
                    const vec3 base(r, g, b);
                    colours += glm::distance(seen(base + 0.04f), lab(dvec3(base))) / 64;
                }
        for (int mix = 1; mix < 7; ++mix) {
            const vec3 colour = 0.2f + 0.8f * vec3(mix & 1, mix / 2 & 1, mix / 4);
            const auto angle = [](const dvec3& c) { return std::atan2(c.z, c.y) * 180 / kPi; };
            hue = std::max(hue, std::abs(std::remainder(angle(seen(4.0f * colour)) - angle(lab(dvec3(colour))), 360)));
        }
        const double highlights = seen(vec3(8)).x - seen(vec3(1)).x;
        EXPECT_NEAR(colours, row.colours, 0.1) << row.view;
        EXPECT_NEAR(highlights, row.highlights, 0.1) << row.view;
        EXPECT_NEAR(hue, row.hue, 0.5) << row.view;
    }
}

TEST(Color, LooksComeBeforeToneMaps) {
    const ColorConfig& config = built_in();
    const std::string look = config.looks().at(0);
    const vec3 blue(-0.1f, 0.1f, 0.9f);
    for (const char* name : {"Khronos PBR Neutral", "AgX"}) {
        const ViewProcessor plain = config.view({"", name, "", 0}), with = config.view({"", name, look, 0}),
                            undone = config.view({"", name, look + ", -" + look, 0});
        EXPECT_GT(glm::length(shown(plain, blue) - shown(with, blue)), 5e-3f) << name;
        EXPECT_LT(glm::length(shown(plain, vec3(0.02f, 0.9f, 0.02f)) - shown(undone, vec3(0.02f, 0.9f, 0.02f))), 1e-3f);
        EXPECT_NE(plain.cache_id(), with.cache_id());
        const std::string glsl = with.gpu_shader().glsl;
        EXPECT_LT(glsl.find("colour = ocio_looks("), glsl.find("colour = ocio_transform("));
    }
}

TEST(Color, NonFiniteNumbersAreDefined) {
    const float inf = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const ColorConfig& config = built_in();
    for (const std::string& name : config.views(config.default_display())) {
        const ViewProcessor view = config.view({"", name, "", 0});
        EXPECT_EQ(shown(view, vec3(nan)), shown(view, vec3(0)));
        EXPECT_GT(shown(view, vec3(inf)).y, 0.99f) << name;
        EXPECT_EQ(shown(view, vec3(-inf)), shown(view, vec3(-65504)));
        for (const vec3& colour : {vec3(inf, 0, nan), vec3(3e38f, -3e38f, 1), vec3(-1, 0.5f, 1e20f)}) {
            const vec3 result = shown(view, colour);
            EXPECT_TRUE(all_finite(result)) << name;
            for (int c = 0; c < 3; ++c) EXPECT_TRUE(result[c] >= 0 && result[c] <= 1) << name;
        }
    }
}

TEST(Color, AlphaPassesAndOtherChannelCountsAreRefused) {
    const ViewProcessor view = built_in().view({"", "Un-tone-mapped", "", 3});
    Image image(2, 1, 4);
    image.pixels = {0.1f, 0.1f, 0.1f, 0.25f, 1, 1, 1, 0.75f};
    const Image result = view.apply(image);
    EXPECT_EQ(result.pixels[3], 0.25f);
    EXPECT_EQ(result.pixels[7], 0.75f);
    EXPECT_THROW(view.apply(Image(1, 1, 2)), Error);
    EXPECT_TRUE(view.apply(Image(0, 0, 3)).pixels.empty());
}

TEST(Color, LookReplacesTheViewsOwnLooks) {
    const ColorConfig& config = built_in();
    const std::string look = config.looks().at(0);
    const ViewProcessor without = config.view({"", "Un-tone-mapped", "", 0});
    const ViewProcessor with = config.view({"", "Un-tone-mapped", look, 0});
    const ViewProcessor undone = config.view({"", "Un-tone-mapped", look + ", -" + look, 0});
    EXPECT_EQ(with.look(), look);
    const vec3 saturated(0.02f, 0.9f, 0.02f);
    const vec3 blue(-0.1f, 0.1f, 0.9f);  // gamut compression changes this colour
    EXPECT_GT(glm::length(shown(without, blue) - shown(with, blue)), 5e-3f);
    EXPECT_LT(glm::length(shown(without, saturated) - shown(undone, saturated)), 1e-3f);
}

TEST(Color, NamesAreCaseInsensitiveAndErrorsListThem) {
    const ColorConfig& config = built_in();
    EXPECT_EQ(config.view({"srgb", "un-tone-mapped", "", 0}).display(), "sRGB - Display");
    EXPECT_EQ(config.view({"DISPLAY P3", "RAW", "", 0}).view(), "Raw");
    const std::pair<ViewTransform, const char*> cases[] = {{{"CRT", "", "", 0}, "Display P3 - Display"},
                                                           {{"", "Filmic", "", 0}, "Un-tone-mapped, Raw"},
                                                           {{"", "", "teal", 0}, "Gamut Compression"}};
    for (const auto& [wanted, listed] : cases) {
        const std::string message = error_message([&] { config.view(wanted); });
        EXPECT_NE(message.find(listed), std::string::npos) << message;
    }
    for (const char* const name : {"Rec.9000", "ACEScct", "Raw"}) {
        const std::string message = error_message([&] { config.linear_space(name); });
        const std::string listed = message.substr(std::min(message.find("linear ones are: "), message.size()));
        EXPECT_NE(listed.find("ACEScg"), std::string::npos) << message;
        EXPECT_EQ(listed.find("sRGB - Texture"), std::string::npos) << message;
    }
}

TEST(Color, LinearSpaces) {
    const ColorConfig& config = built_in();
    EXPECT_EQ(config.linear_space("").from_rec709, mat3(1));
    const std::pair<const char*, Chromaticities> cases[] = {
        {"Linear Rec.709 (sRGB)", kRec709}, {"acescg", kAp1}, {"ACES2065-1", kAp0}};
    for (const auto& [name, expected] : cases) {
        const LinearSpace space = config.linear_space(name);
        const dmat3 matrix = rgb_conversion(kRec709, expected);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) EXPECT_NEAR(space.from_rec709[i][j], matrix[i][j], 1e-5) << name;
        ASSERT_TRUE(space.chromaticities) << name;
        EXPECT_EQ(space.chromaticities->green, expected.green) << name;
    }
    EXPECT_FALSE(config.linear_space("CIE-XYZ-D65").chromaticities) << "white is not (1, 1, 1) there";
    for (const char* name : {"sRGB - Texture", "ACEScct"}) EXPECT_THROW(config.linear_space(name), Error);
}

TEST(Color, BuiltInSpacesAreKnownWithAnyConfig) {
    const TemporaryFolder folder;
    for (const char* first : {"aces_interchange: ap0}", "scene_linear: Linear Rec.709}"}) {
        std::ofstream(folder / "other.ocio") << "ocio_profile_version: 2.1\nroles: {default: ap0, " << first << R"(
displays:
  D:
    - !<View> {name: V, colorspace: Linear Rec.709}
colorspaces:
  - !<ColorSpace> {name: ap0}
  - !<ColorSpace>
    name: Linear Rec.709
    to_scene_reference: !<GroupTransform>
      children:
        - !<BuiltinTransform> {style: UTILITY - ACES-AP1_to_LINEAR-REC709_BFD, direction: inverse}
        - !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
)";
        const ColorConfig config = ColorConfig::load(folder / "other.ocio");
        for (const char* name : {"acescg", "ACEScg", "lin_ap1", "aces2065-1", "lin_rec709", "Linear Rec.709 (sRGB)"}) {
            const LinearSpace space = config.linear_space(name), own = built_in().linear_space(name);
            EXPECT_EQ(space.name, own.name);
            EXPECT_EQ(space.from_rec709, own.from_rec709);
            EXPECT_TRUE(space.chromaticities && same_space(*space.chromaticities, *own.chromaticities));
        }
        EXPECT_TRUE(config.linear_space("ap0").chromaticities) << "the config's own spaces are known, too";
        for (const char* name : {"compositing_log", "color_picking", "matte_paint", "Rec.9000", "ACEScct", "Raw"})
            EXPECT_THROW(config.linear_space(name), Error) << name;
    }
    EXPECT_THROW(built_in().linear_space("Raw"), Error) << "data has no colours";
}

TEST(Color, EnvironmentVariableIsUsedOrAnError) {
    const fs::path own = fs::path(HALFLIGHT_SOURCE_DIR) / "engine/color/halflight.ocio";
    test::EnvironmentVariable ocio("OCIO", "/nonexistent/config.ocio");
    const std::string error = error_message([] { ColorConfig::load(); });
    EXPECT_TRUE(error.starts_with("$OCIO (/nonexistent/config.ocio): cannot be used")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
    EXPECT_EQ(ColorConfig::load(own).source(), own) << "a file that is given comes first";
    ocio.set(HALFLIGHT_SOURCE_DIR);
    EXPECT_TRUE(error_message([] { ColorConfig::load(); }).ends_with(": cannot read: Is a directory"));
    ocio.set("");
    EXPECT_EQ(ColorConfig::load().source(), "built-in");
    ocio.set(own.c_str());
    EXPECT_EQ(ColorConfig::load().source(), own);
    const TemporaryFolder folder;
    const fs::path bad = folder / "bad.ocio";
    EXPECT_TRUE(error_message([&] { ColorConfig::load(bad); }).starts_with(bad.string() + ": cannot"));
    for (const char* text : {"", "ocio_profile_version: 2\ndisplays: [", "\x01\x02 {", "ocio_profile_version: 2.1\n"}) {
        std::ofstream(bad) << text;
        const std::string refusal = error_message([&] { ColorConfig::load(bad); });
        EXPECT_TRUE(refusal.starts_with(bad.string() + ": cannot be used")) << refusal;
    }
#if OCIO_VERSION_HEX >= 0x02020000
    EXPECT_GT(ColorConfig::load("ocio://default").displays().size(), 0u);
#else
    const std::string refusal = error_message([] { ColorConfig::load("ocio://default"); });
    EXPECT_NE(refusal.find("exist since its version 2.2"), std::string::npos) << refusal;
#endif
}

TEST(Color, ConfigsOfOtherProjects) {
    if (!fs::exists(kConfigs)) GTEST_SKIP() << kConfigs << " is not there";
    int loaded = 0;
    for (const auto& entry : fs::directory_iterator(kConfigs)) {
        if (entry.path().extension() != ".ocio") continue;
        SCOPED_TRACE(entry.path());
        const std::string error = error_message([&] {
            const ColorConfig config = ColorConfig::load(entry.path());
            EXPECT_FALSE(config.displays().empty());
            for (const std::string& display : config.displays())
                for (const std::string& view : config.views(display)) {
                    const ViewProcessor processor = config.view({display, view, "", 0});
                    EXPECT_TRUE(all_finite(shown(processor, vec3(0.18f)))) << display << ", " << view;
                    EXPECT_NE(processor.gpu_shader().glsl.find("vec4 ocio_view(vec4 pixel)"), std::string::npos);
                }
            EXPECT_TRUE(config.linear_space("ACEScg").chromaticities);
            ++loaded;
        });
        // The library may be older than a config.
        EXPECT_TRUE(error.empty() || error.find("ocio-v2.3") != std::string::npos) << error;
    }
    EXPECT_GT(loaded, 0);
}

/// Returns a config with two LUT views: a 3D table swaps red and blue, and a 1D table halves values. Three more spaces
/// have matrices.
fs::path small_config(const fs::path& folder) {
    std::ofstream cube(folder / "swap.cube");
    cube << "LUT_3D_SIZE 2\n";
    for (int i = 0; i < 8; ++i) cube << (i >> 2) << " " << (i >> 1) % 2 << " " << i % 2 << "\n";
    std::ofstream curve(folder / "half.spi1d");
    curve << "Version 1\nFrom 0.0 1.0\nLength 8192\nComponents 1\n{\n";
    for (int i = 0; i < 8192; ++i) curve << 0.5 * i / 8191 << "\n";
    curve << "}\n";
    std::ofstream(folder / "config.ocio") << R"(ocio_profile_version: 1
search_path: "."
roles: {default: lin_srgb, scene_linear: lin_srgb}
displays:
  table:
    - !<View> {name: swap, colorspace: swap}
    - !<View> {name: half, colorspace: half}
colorspaces:
  - !<ColorSpace> {name: lin_srgb}
  - !<ColorSpace>
    name: swap
    from_reference: !<FileTransform> {src: swap.cube, interpolation: linear}
  - !<ColorSpace>
    name: half
    from_reference: !<FileTransform> {src: half.spi1d, interpolation: linear}
  - !<ColorSpace>
    name: rec2020
    from_reference: !<MatrixTransform> {matrix: [0.6274039, 0.329283, 0.0433131, 0, 0.0690973, 0.9195404, 0.0113623, 0, 0.0163914, 0.0880133, 0.8955953, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: bright
    from_reference: !<MatrixTransform> {matrix: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: grey
    from_reference: !<MatrixTransform> {matrix: [0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1]}
)";
    return folder / "config.ocio";
}

TEST(Color, TablesReachCpuAndGpuAndMatricesGivePrimaries) {
    const TemporaryFolder folder;
    const ColorConfig config = ColorConfig::load(small_config(folder.path));  // OCIO 1 without interchange roles
    const Chromaticities rec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kRec709.white};  // ITU-R BT.2020-2
    const auto found = config.linear_space("rec2020").chromaticities;
    EXPECT_TRUE(found && same_space(*found, rec2020));
    for (const char* name : {"bright", "grey"}) EXPECT_FALSE(config.linear_space(name).chromaticities) << name;
    const ViewProcessor swap = config.view({"", "swap", "", 0});
    const ViewProcessor half = config.view({"", "half", "", 0});
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(shown(swap, vec3(0.1f, 0.2f, 0.3f))[c], vec3(0.3f, 0.2f, 0.1f)[c], 1e-6);
        EXPECT_NEAR(shown(half, vec3(0.1f, 0.2f, 0.3f))[c], vec3(0.05f, 0.1f, 0.15f)[c], 1e-6);
    }
    std::vector<std::string> names;
    for (const VersionedFile& file : config.files()) names.push_back(file.path.filename().string());
    EXPECT_EQ(names, (std::vector<std::string>{"config.ocio", "half.spi1d", "swap.cube"}));
    for (const ViewProcessor& view : {swap, half}) {
        const GpuShader shader = view.gpu_shader();
        ASSERT_EQ(shader.luts.size(), 1u);
        const GpuLut& lut = shader.luts[0];
        const std::string declaration = fmt::format("uniform sampler{}D {};", lut.dimensions, lut.sampler);
        EXPECT_NE(shader.glsl.find(declaration), std::string::npos) << shader.glsl;
        EXPECT_EQ(lut.values.size(), static_cast<std::size_t>(lut.width * lut.height * lut.depth * lut.channels));
    }
    EXPECT_EQ(swap.gpu_shader().luts[0].depth, 2);
    const GpuLut curve = half.gpu_shader().luts[0];
    EXPECT_EQ(curve.dimensions, 2) << "8192 entries do not fit one row of the size that OpenGL promises";
    EXPECT_TRUE(curve.linear);
}

TEST(Color, GpuShaderDeclaresWhatItReturns) {
    const ColorConfig& config = built_in();
    const GpuShader shader = config.view({}).gpu_shader();
    EXPECT_NE(shader.glsl.find("vec4 ocio_view(vec4 pixel)"), std::string::npos);
    EXPECT_EQ(shader.glsl.find("#version"), std::string::npos);
    EXPECT_EQ(shader.glsl, config.view({}).gpu_shader().glsl);
    EXPECT_EQ(shader.cache_id, config.view({"", "", "", 1.5f}).gpu_shader().cache_id) << "exposure costs no new shader";
    EXPECT_NE(shader.cache_id, config.view({"", "Raw", "", 0}).gpu_shader().cache_id);
}

}  // namespace
}  // namespace halflight
