// Tests the conversion of sums per path to images.
#include "renderer/film.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "shaders/shared/pixel_order.h"
#include "shaders/shared/rays.h"

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
TraceTables two_triangles() {
    TraceTables t;
    t.origin = {1000, 0, -2};
    t.positions.assign(6, vec3(0));
    t.triangles = {uvec4(0, 1, 2, 3), uvec4(3, 4, 5, kTriangleAlpha | 4)};
    t.ranges = {{.mesh = 0, .instance = 5, .merged = true, .vertex_count = 3, .triangle_count = 1},
                {.mesh = 1,
                 .instance = 6,
                 .merged = true,
                 .first_vertex = 3,
                 .vertex_count = 3,
                 .first_triangle = 1,
                 .triangle_count = 1}};
    t.blocks = {{.first_triangle = 0, .triangle_count = 2, .bounds = {}}};
    t.instances = {{.block = 0, .identity = true}};
    return t;
}

/// Returns the two bands of a 37x40 image; the second one extends below it.
std::vector<Band> bands() {
    return {{{37, 40}, 0, 32}, {{37, 40}, 32, 32}};
}

const ExrLayer& layer(const RenderResult& result, const std::string& channel) {
    for (const ExrLayer& l : result.aovs)
        for (const std::string& c : l.channels)
            if (c == channel) return l;
    throw std::out_of_range(channel);
}

float tag(int x, int y, int what) {
    return static_cast<float>(x + 100 * y + 10000 * what);
}

TEST(Film, RequestsAovsByName) {
    const RenderSettings s = settings_of(1, 1, {"depth", "albedo"});
    EXPECT_TRUE(asked_for(s, "albedo"));
    EXPECT_FALSE(asked_for(s, "normal"));
    EXPECT_TRUE(asked_for(s, {LayerSource::count, LayerSource::features}));
    EXPECT_FALSE(asked_for(s, {LayerSource::count, LayerSource::debug}));
}

TEST(Film, EveryKnownAovHasADescriptionAndAnUnusedName) {
    std::vector<std::string> names;
    for (const AovInfo& a : known_aovs()) {
        EXPECT_FALSE(a.description.empty());
        EXPECT_EQ(std::count(names.begin(), names.end(), a.name), 0) << a.name;
        names.emplace_back(a.name);
    }
}

TEST(Film, SumsBecomeMeansPerPixel) {
    const TraceTables tables = two_triangles();
    Film film(settings_of(37, 40), tables);
    const int samples = 8;
    for (const Band& band : bands()) {
        const std::size_t paths = band.paths();
        const double nan = std::nan("");  // paths outside the picture are NaN
        Film::Sums sums{std::vector<double>(paths * 4, nan), std::vector<double>(paths * 6, nan),
                        std::vector<double>(paths * 6, nan), std::vector<double>(paths * 3, nan),
                        std::vector<double>(paths * 6, nan)};
        for (int y = band.y; y < std::min(40, band.y + band.rows); ++y) {
            for (int x = 0; x < 37; ++x) {
                const std::size_t path = shared::path_of_pixel(uvec2(x, y - band.y), band.tiles());
                for (int c = 0; c < 3; ++c) {
                    sums.emission[path * 4 + c] = samples * tag(x, y, c);
                    for (int half = 0; half < 2; ++half) {
                        const int at = 3 * half + c;
                        sums.direct[path * 6 + at] = samples * tag(x, y, 3 + at);
                        sums.indirect[path * 6 + at] = samples * tag(x, y, 9 + at);
                        sums.features[path * 6 + at] = samples * tag(x, y, 15 + at);
                    }
                }
            }
        }
        film.add_sums(band, samples, sums);
    }
    RenderResult result;
    film.take(result);
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
    const TraceTables tables = two_triangles();
    Film film(settings_of(3, 2, {"variance"}), tables);
    const Band band{{3, 2}, 0, 2};
    std::mt19937 random(3);
    std::normal_distribution<double> normal(5, 2);
    const int samples = 50;
    Film::Sums sums{std::vector<double>(256 * 4),
                    std::vector<double>(256 * 6),
                    std::vector<double>(256 * 6),
                    std::vector<double>(256 * 3),
                    {}};
    Image expected(3, 2, 3);
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 3; ++x) {
            const std::size_t path = shared::path_of_pixel(uvec2(x, y), band.tiles());
            for (int c = 0; c < 3; ++c) {
                std::vector<double> values;
                double mean = 0;
                for (int i = 0; i < samples; ++i) {
                    // The values are the parts of one sample in all five components.
                    const double emission = normal(random), direct = normal(random), glossy = normal(random),
                                 indirect = normal(random), last = normal(random);
                    sums.emission[path * 4 + c] += emission;
                    sums.direct[path * 6 + c] += direct;
                    sums.direct[path * 6 + 3 + c] += glossy;
                    sums.indirect[path * 6 + c] += indirect;
                    sums.indirect[path * 6 + 3 + c] += last;
                    values.push_back(emission + direct + glossy + indirect + last);
                    sums.squares[path * 3 + c] += values.back() * values.back();
                    mean += values.back() / samples;
                }
                double squares = 0;
                for (const double v : values) squares += (v - mean) * (v - mean);
                expected.at(x, y)[c] = static_cast<float>(squares / (samples - 1) / samples);
            }
        }
    }
    film.add_sums(band, samples, sums);
    RenderResult result;
    film.take(result);
    const Image& variance = layer(result, "variance.R").image;
    for (std::size_t i = 0; i < variance.pixels.size(); ++i)
        EXPECT_NEAR(variance.pixels[i], expected.pixels[i], 1e-6 * expected.pixels[i]);
}

TEST(Film, OmittedComponentsAreBlackAndOneSampleHasNoVariance) {
    const TraceTables tables = two_triangles();
    Film film(settings_of(3, 2, {"indirect_diffuse", "variance", "direct_glossy"}), tables);
    Film::Sums sums{.emission = std::vector<double>(256 * 4, 2),
                    .direct = {},
                    .indirect = {},
                    .squares = std::vector<double>(256 * 3, 4),
                    .features = {}};
    film.add_sums({{3, 2}, 0, 2}, 1, sums);
    RenderResult result;
    film.take(result);
    ASSERT_EQ(result.aovs.size(), 3u);
    for (const ExrLayer& l : result.aovs)
        for (const float v : l.image.pixels) EXPECT_EQ(v, 0);
}

TEST(Film, PicturesAreStackedByBand) {
    const TraceTables tables = two_triangles();
    RenderSettings settings = settings_of(37, 40, {});
    settings.want_view = true;
    Film film(settings, tables);
    for (const Band& band : bands()) {
        std::vector<float> beauty, view;
        for (int y = 0; y < band.rows; ++y) {
            for (int x = 0; x < 37; ++x) {
                for (int c = 0; c < 4; ++c) {
                    beauty.push_back(tag(x, band.y + y, c));
                    view.push_back(tag(x, band.y + y, 4 + c));
                }
            }
        }
        film.add_pictures(band, beauty, view);
    }
    RenderResult result;
    film.take(result);
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 37; ++x) {
            for (int c = 0; c < 4; ++c) {
                ASSERT_EQ(result.beauty.at(x, y)[c], tag(x, y, c));
                ASSERT_EQ(result.view.at(x, y)[c], tag(x, y, 4 + c));
            }
        }
    }
}

TEST(Film, NoViewUnlessRequested) {
    const TraceTables tables = two_triangles();
    Film film(settings_of(4, 4, {}), tables);
    film.add_pictures({{4, 4}, 0, 4}, std::vector<float>(64, 1), {});
    RenderResult result;
    film.take(result);
    EXPECT_TRUE(result.view.pixels.empty());
    EXPECT_TRUE(result.aovs.empty());
}

TEST(Film, DataGoesThroughTheTables) {
    const TraceTables tables = two_triangles();
    Film film(settings_of(2, 1, {"position", "depth", "motion", "ids"}), tables);
    std::vector<shared::AovRecord> records(256);
    records[shared::path_of_pixel({0, 0}, {1, 1})] = {
        .position = {1, 2, 3}, .depth = 7, .motion = {-1, 4}, .triangle = 1, .instance = 0};
    records[shared::path_of_pixel({1, 0}, {1, 1})] = {
        .position = vec3(0), .depth = shared::kNoDepth, .motion = vec2(0), .triangle = shared::kMiss, .instance = 0};
    film.add_data({{2, 1}, 0, 1}, records);
    RenderResult result;
    film.take(result);
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
    const TraceTables tables = two_triangles();
    Film film(settings_of(2, 1, {"culling", "nodes", "residency"}), tables);
    std::vector<shared::DebugRecord> records(256);
    records[shared::path_of_pixel({0, 0}, {1, 1})] = {
        .nodes = 17, .leaves = 5, .others = 2, .subtree = 9, .resident = 1};
    records[shared::path_of_pixel({1, 0}, {1, 1})] = {
        .nodes = 3, .leaves = 0, .others = 1, .subtree = 4, .resident = 0};
    film.add_debug({{2, 1}, 0, 1}, records);
    RenderResult result;
    film.take(result);
    using Values = std::vector<float>;
    EXPECT_EQ(layer(result, "nodes.Y").image.pixels, (Values{17, 3}));
    EXPECT_EQ(layer(result, "culling.leaves").image.pixels, (Values{5, 2, 0, 1}));
    EXPECT_EQ(layer(result, "culling.others").channels[1], "culling.others");
    EXPECT_EQ(layer(result, "residency.subtree").image.pixels, (Values{9, 1, 4, 0}));
}

TEST(Film, HalvesAreForColourOnly) {
    const TraceTables tables = two_triangles();
    RenderSettings settings = settings_of(1, 1);
    settings.half_color = true;
    Film film(settings, tables);
    RenderResult result;
    film.take(result);
    for (const char* name :
         {"emission.R", "direct_diffuse.R", "direct_glossy.R", "indirect_diffuse.R", "indirect_glossy.R", "albedo.R"})
        EXPECT_EQ(layer(result, name).type, ExrType::half) << name;
    for (const char* name :
         {"variance.R", "samples.Y", "normal.X", "position.X", "Z", "motion.X", "nodes.Y", "culling.leaves"})
        EXPECT_EQ(layer(result, name).type, ExrType::float32) << name;
    EXPECT_EQ(layer(result, "ids.instance").type, ExrType::uint32);
}

}  // namespace
}  // namespace halflight
