// Tests the conversion of sums per path to images.
#include "renderer/film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <set>
#include <string_view>

#include "engine/core/statistics.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

/// Returns the names of all layers.
std::vector<std::string> all_layers() {
    std::vector<std::string> names;
    for (const AovInfo& a : known_aovs()) names.emplace_back(a.name);
    return names;
}

RenderSettings settings_of(int width, int height, std::vector<std::string> aovs = all_layers()) {
    RenderSettings s;
    s.width = width, s.height = height;
    s.aovs = std::move(aovs);
    return s;
}

/// Returns two merged instances of one triangle each, with materials 3 and 4, 1000 units away from the world's origin.
const TraceTables& two_triangles() {
    static const TraceTables tables = [] {
        TraceTables t;
        t.origin = {1000, 0, -2};
        t.positions.assign(6, vec3(0));
        t.triangles = {uvec4(0, 1, 2, 3), uvec4(3, 4, 5, kTriangleAlpha | 4)};
        MeshRange range{.mesh = 0, .instance = 5, .merged = true, .vertex_count = 3, .triangle_count = 1};
        t.ranges = {range, range};
        t.ranges[1].mesh = 1, t.ranges[1].instance = 6;
        t.ranges[1].first_vertex = 3, t.ranges[1].first_triangle = 1;
        t.blocks = {{.first_triangle = 0, .triangle_count = 2, .bounds = {}}};
        t.instances = {{.block = 0, .identity = true}};
        return t;
    }();
    return tables;
}

/// Returns sums of all components for so many paths.
Film::Sums sums_of(std::size_t paths, double value) {
    const auto values = [&](std::size_t count) { return std::vector<double>(paths * count, value); };
    return {values(4), values(6), values(6), values(3), values(6)};
}

/// Returns the two bands of a 37x40 image; the second one extends below it.
std::vector<Band> bands() {
    return {{{37, 40}, 0, 32}, {{37, 40}, 32, 32}};
}

const ExrLayer& layer(const RenderResult& result, std::string_view channel) {
    for (const ExrLayer& l : result.aovs)
        if (std::ranges::count(l.channels, channel) > 0) return l;
    throw std::out_of_range(std::string(channel));
}

float tag(int x, int y, int what) {
    return static_cast<float>(x + 100 * y + 10000 * what);
}

RenderResult taken(Film& film) {
    RenderResult result;
    film.take(result);
    return result;
}

TEST(Film, RequestsAovsByName) {
    const RenderSettings s = settings_of(1, 1, {"depth", "albedo"});
    EXPECT_TRUE(asked_for(s, "albedo"));
    EXPECT_FALSE(asked_for(s, "normal"));
    EXPECT_TRUE(asked_for(s, {LayerSource::count, LayerSource::features}));
    EXPECT_FALSE(asked_for(s, {LayerSource::count, LayerSource::debug}));
    const std::vector<std::string> all = all_layers();
    EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), all.size()) << "names are unique";
}

TEST(Film, SumsBecomeMeansPerPixel) {
    Film film(settings_of(37, 40), two_triangles());
    const int samples = 8;
    for (const Band& band : bands()) {
        Film::Sums sums = sums_of(band.paths(), std::nan(""));  // paths outside the picture stay NaN
        for (int y = band.y; y < std::min(40, band.y + band.rows); ++y)
            for (int x = 0; x < 37; ++x) {
                const std::size_t path = shared::path_of_pixel(uvec2(x, y - band.y), band.tiles());
                for (int c = 0; c < 3; ++c) sums.emission[path * 4 + c] = samples * tag(x, y, c);
                for (int at = 0; at < 6; ++at) {
                    sums.direct[path * 6 + at] = samples * tag(x, y, 3 + at);
                    sums.indirect[path * 6 + at] = samples * tag(x, y, 9 + at);
                    sums.features[path * 6 + at] = samples * tag(x, y, 15 + at);
                }
            }
        film.add_sums(band, samples, sums);
    }
    const RenderResult result = taken(film);
    ASSERT_EQ(result.aovs.size(), known_aovs().size());
    const struct {
        const char* aov;
        const char* channels;
        int first_tag;
    } expected[] = {{"emission", "RGB", 0},         {"direct_diffuse", "RGB", 3},   {"direct_glossy", "RGB", 6},
                    {"indirect_diffuse", "RGB", 9}, {"indirect_glossy", "RGB", 12}, {"albedo", "RGB", 15},
                    {"normal", "XYZ", 18}};
    for (const auto& e : expected) {
        const ExrLayer& l = layer(result, std::string(e.aov) + "." + e.channels[0]);
        ASSERT_EQ(l.channels.size(), 3u);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(l.channels[c], std::string(e.aov) + "." + e.channels[c]);
        EXPECT_EQ(l.type, ExrType::float32);
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 37; ++x)
                for (int c = 0; c < 3; ++c) ASSERT_EQ(l.image.at(x, y)[c], tag(x, y, e.first_tag + c)) << e.aov;
    }
    for (const float count : layer(result, "samples.Y").image.pixels) ASSERT_EQ(count, 8);
}

TEST(Film, VarianceIsOfTheMean) {
    Film film(settings_of(3, 2, {"variance"}), two_triangles());
    const Band band{{3, 2}, 0, 2};
    std::mt19937 random(3);
    std::normal_distribution<double> normal(5, 2);
    const int samples = 50;
    Film::Sums sums = sums_of(256, 0);
    sums.features.clear();
    std::vector<double> expected;
    for (int i = 0; i < 3 * 2 * 3; ++i) {
        const std::size_t path = shared::path_of_pixel(uvec2(i / 3 % 3, i / 9), band.tiles()), c = i % 3;
        RunningMoments moments;
        for (int sample = 0; sample < samples; ++sample) {
            double value = 0;  // sum of the sample's parts in all five components
            for (double* part :
                 {&sums.emission[path * 4 + c], &sums.direct[path * 6 + c], &sums.direct[path * 6 + 3 + c],
                  &sums.indirect[path * 6 + c], &sums.indirect[path * 6 + 3 + c]}) {
                const double v = normal(random);
                *part += v, value += v;
            }
            sums.squares[path * 3 + c] += value * value;
            moments.add(value);
        }
        expected.push_back(moments.standard_error() * moments.standard_error());
    }
    film.add_sums(band, samples, sums);
    const RenderResult result = taken(film);
    const Image& variance = layer(result, "variance.R").image;
    ASSERT_EQ(variance.pixels.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(variance.pixels[i], expected[i], 1e-6 * expected[i]);
}

TEST(Film, OmittedComponentsAreBlackAndOneSampleHasNoVariance) {
    Film film(settings_of(3, 2, {"indirect_diffuse", "variance", "direct_glossy"}), two_triangles());
    Film::Sums sums = sums_of(256, 2);
    sums.direct.clear(), sums.indirect.clear(), sums.features.clear();
    film.add_sums({{3, 2}, 0, 2}, 1, sums);
    const RenderResult result = taken(film);
    ASSERT_EQ(result.aovs.size(), 3u);
    for (const ExrLayer& l : result.aovs)
        for (const float v : l.image.pixels) EXPECT_EQ(v, 0);
}

TEST(Film, PicturesAreStackedByBand) {
    RenderSettings settings = settings_of(37, 40, {});
    settings.want_view = true;
    Film film(settings, two_triangles());
    for (const Band& band : bands()) {
        std::vector<float> beauty, view;
        for (int i = 0; i < band.rows * 37 * 4; ++i) {
            beauty.push_back(tag(i / 4 % 37, band.y + i / 4 / 37, i % 4));
            view.push_back(tag(i / 4 % 37, band.y + i / 4 / 37, 4 + i % 4));
        }
        film.add_pictures(band, beauty, view);
    }
    const RenderResult result = taken(film);
    for (int i = 0; i < 40 * 37 * 4; ++i) {
        const int x = i / 4 % 37, y = i / 4 / 37, c = i % 4;
        ASSERT_EQ(result.beauty.at(x, y)[c], tag(x, y, c));
        ASSERT_EQ(result.view.at(x, y)[c], tag(x, y, 4 + c));
    }
}

TEST(Film, NoViewUnlessRequested) {
    Film film(settings_of(4, 4, {}), two_triangles());
    film.add_pictures({{4, 4}, 0, 4}, std::vector<float>(64, 1), {});
    const RenderResult result = taken(film);
    EXPECT_TRUE(result.view.pixels.empty() && result.aovs.empty());
}

TEST(Film, DataGoesThroughTheTables) {
    Film film(settings_of(2, 1, {"position", "depth", "motion", "ids"}), two_triangles());
    std::vector<shared::AovRecord> records(256);
    records[shared::path_of_pixel({0, 0}, {1, 1})] = {
        .position = {1, 2, 3}, .depth = 7, .motion = {-1, 4}, .triangle = 1, .instance = 0};
    records[shared::path_of_pixel({1, 0}, {1, 1})] = {
        .position = vec3(0), .depth = shared::kNoDepth, .motion = vec2(0), .triangle = shared::kMiss, .instance = 0};
    film.add_data({{2, 1}, 0, 1}, records);
    const RenderResult result = taken(film);
    using Values = std::vector<float>;
    EXPECT_EQ(layer(result, "position.X").image.pixels, (Values{1001, 2, 1, 0, 0, 0}));
    EXPECT_EQ(layer(result, "position.X").channels[2], "position.Z");
    EXPECT_EQ(layer(result, "Z").image.pixels, (Values{7, shared::kNoDepth}));
    EXPECT_EQ(layer(result, "motion.X").image.pixels, (Values{-1, 4, 0, 0}));
    const ExrLayer& ids = layer(result, "ids.instance");
    EXPECT_EQ(ids.channels, (std::vector<std::string>{"ids.instance", "ids.primitive", "ids.material"}));
    EXPECT_EQ(ids.type, ExrType::uint32);
    std::vector<std::uint32_t> bits;
    for (const float v : ids.image.pixels) bits.push_back(std::bit_cast<std::uint32_t>(v));
    EXPECT_EQ(bits, (std::vector<std::uint32_t>{6, 0, 4, ~0u, ~0u, ~0u}));
}

TEST(Film, TracingCostIsCounted) {
    Film film(settings_of(2, 1, {"culling", "nodes", "residency"}), two_triangles());
    std::vector<shared::DebugRecord> records(256);
    records[shared::path_of_pixel({0, 0}, {1, 1})] = {
        .nodes = 17, .leaves = 5, .others = 2, .subtree = 9, .resident = 1};
    records[shared::path_of_pixel({1, 0}, {1, 1})] = {
        .nodes = 3, .leaves = 0, .others = 1, .subtree = 4, .resident = 0};
    film.add_debug({{2, 1}, 0, 1}, records);
    const RenderResult result = taken(film);
    using Values = std::vector<float>;
    EXPECT_EQ(layer(result, "nodes.Y").image.pixels, (Values{17, 3}));
    EXPECT_EQ(layer(result, "culling.leaves").image.pixels, (Values{5, 2, 0, 1}));
    EXPECT_EQ(layer(result, "culling.others").channels[1], "culling.others");
    EXPECT_EQ(layer(result, "residency.subtree").image.pixels, (Values{9, 1, 4, 0}));
}

TEST(Film, HalvesAreForColourOnly) {
    RenderSettings settings = settings_of(1, 1);
    settings.half_color = true;
    Film film(settings, two_triangles());
    const std::set<std::string> colors{"emission.R",        "direct_diffuse.R", "direct_glossy.R", "indirect_diffuse.R",
                                       "indirect_glossy.R", "albedo.R",         "noisy.R"};
    const RenderResult result = taken(film);
    for (const ExrLayer& l : result.aovs) {
        const bool ids = l.channels[0] == "ids.instance", color = colors.contains(l.channels[0]);
        EXPECT_EQ(l.type, ids ? ExrType::uint32 : color ? ExrType::half : ExrType::float32) << l.channels[0];
    }
}

}  // namespace
}  // namespace halflight
