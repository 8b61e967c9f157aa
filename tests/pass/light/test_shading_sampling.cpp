// Tests Sobol points: stratification, uniformity, and equal bits on CPU and GPU. Tests arctangents, too.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "shaders/shared/sobol.h"
#include "shaders/shared/word.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using shared::Sampler;
using shared::uint;

Sampler sampler(uint pixel, uint index, uint frame = 5) {
    return shared::make_sampler(pixel, 2 * pixel, index, frame);
}

/// Checks that every elementary interval of area 1/n contains one of any n = 2^k consecutive points that start at a
/// multiple of n.
TEST(Sobol, PointsAreZeroTwoNets) {
    for (const uint log_count : {4u, 8u, 11u}) {
        const uint count = 1u << log_count;
        for (uint pixel = 0; pixel < 8; ++pixel) {
            for (uint split = 0; split <= log_count; ++split) {
                std::set<std::pair<uint, uint>> cells;
                for (uint i = 0; i < count; ++i) {
                    const shared::SampleBits bits = shared::sample_2d_bits(sampler(pixel, i + 3 * count), pixel + 7);
                    const uint other = log_count - split;
                    cells.insert({split == 0 ? 0 : bits.x >> (32 - split), other == 0 ? 0 : bits.y >> (32 - other)});
                }
                EXPECT_EQ(cells.size(), count) << pixel << ' ' << split << ' ' << log_count;
            }
        }
    }
}

/// All points of an aligned square of pixels together form a net, and so do the points of each pixel.
TEST(Sobol, PixelsThatShareASequenceComplementEachOther) {
    for (const uint count : {1u, 4u, 16u}) {
        for (const uint size : {1u, 2u, 8u}) {
            const uint points = size * size * count, log_points = static_cast<uint>(std::countr_zero(points));
            for (const uint corner : {0u, 8u, 472u}) {
                for (uint split = 0; split <= log_points; ++split) {
                    std::set<std::uint64_t> cells;
                    for (uint i = 0; i < points; ++i) {
                        const uint pixel = i / count, x = corner + pixel % size, y = 64 + pixel / size;
                        const Sampler s = shared::make_shared_sampler(x, y, i % count, count, 5);
                        const shared::SampleBits bits = shared::sample_2d_bits(s, 7);
                        const std::uint64_t column = std::uint64_t{bits.x} >> (32 - split);
                        cells.insert(column << 32 | std::uint64_t{bits.y} >> (32 - (log_points - split)));
                    }
                    EXPECT_EQ(cells.size(), points) << count << ' ' << size << ' ' << corner << ' ' << split;
                }
            }
        }
    }
}

TEST(Sobol, OneDimensionIsStratified) {
    for (uint pixel = 0; pixel < 16; ++pixel) {
        std::set<uint> cells;
        for (uint i = 0; i < 256; ++i) cells.insert(shared::sample_1d_bits(sampler(pixel, i), 3) >> 24);
        EXPECT_EQ(cells.size(), 256u);
    }
}

/// For one sample number, the points of pairs of dimensions are uniform and independent across pixels.
TEST(Sobol, PixelsAndDimensionsAreIndependent) {
    constexpr int kBins = 16, kPixels = 1 << 16;
    for (uint dimension = 0; dimension < 4; ++dimension) {
        std::vector<double> of_pixel(kBins * kBins), of_neighbours = of_pixel, of_dimensions = of_pixel;
        const auto bin = [](uint x, uint y) { return static_cast<std::size_t>((x >> 28) * kBins + (y >> 28)); };
        for (uint pixel = 0; pixel < kPixels; ++pixel) {
            const shared::SampleBits here = shared::sample_2d_bits(sampler(pixel, 1), dimension);
            const shared::SampleBits next = shared::sample_2d_bits(sampler(pixel + 1, 1), dimension);
            const shared::SampleBits other = shared::sample_2d_bits(sampler(pixel, 1), dimension + 1);
            ++of_pixel[bin(here.x, here.y)];
            ++of_neighbours[bin(here.x, next.x)];
            ++of_dimensions[bin(here.y, other.y)];
        }
        const std::vector<double> expected(kBins * kBins, double(kPixels) / (kBins * kBins));
        for (const auto& bins : {of_pixel, of_neighbours, of_dimensions})
            EXPECT_GT(test::chi_square(bins, expected, 1).p_value(), 1e-6) << dimension;
    }
}

class ShadingSampling : public GpuTest {};

TEST_F(ShadingSampling, GpuEqualsTheCpu) {
    const ShadingScene scene{triangle_scene({})};
    const auto found = scene.run("#include \"shaders/lib/sobol.glsl\"", R"(
        Sampler s = make_sampler(i % 97u, 2u * (i % 97u), i, 5u);
        SampleBits bits = sample_2d_bits(s, i % 13u);
        // As words of shaders/shared/word.h, 29 bits each.
        uvec4 words = uvec4(bits.x >> 3, bits.y >> 3, sample_1d_bits(s, 40u) >> 3,
                            (bits.x ^ bits.y ^ sample_1d_bits(s, 41u)) & 0x1fffffffu);
        result[0] = uintBitsToFloat(words | 0x40000000u);
        result[1] = vec4(sample_2d(s, 3u), sample_1d(s, 4u), unit_float(0xffffffffu));
        Sampler joint = make_shared_sampler(i % 113u, i / 7u, i % 4u, 4u, 5u);
        result[2] = vec4(sample_2d(joint, 3u), sample_1d(joint, 4u), 0.0);
    )",
                                 1 << 14, 3);
    for (uint i = 0; i < 1u << 14; ++i) {
        const Sampler s = sampler(i % 97, i);
        const shared::SampleBits bits = shared::sample_2d_bits(s, i % 13);
        const auto word = [&](int k) { return shared::word_of_float(found[3 * i][k]); };
        ASSERT_EQ(word(0), bits.x >> 3);
        ASSERT_EQ(word(1), bits.y >> 3);
        ASSERT_EQ(word(2), shared::sample_1d_bits(s, 40) >> 3);
        ASSERT_EQ(word(3), (bits.x ^ bits.y ^ shared::sample_1d_bits(s, 41)) & 0x1fffffffu);
        const vec2 pair = shared::sample_2d(s, 3);
        ASSERT_EQ(found[3 * i + 1], vec4(pair, shared::sample_1d(s, 4), 0x1p0f - 0x1p-24f));
        const Sampler joint = shared::make_shared_sampler(i % 113, i / 7, i % 4, 4, 5);
        ASSERT_EQ(found[3 * i + 2], vec4(shared::sample_2d(joint, 3), shared::sample_1d(joint, 4), 0));
    }
}

/// The checksum is that of Mesa 22.3 and 25.0, whose own arctangents differ in last bits.
TEST_F(ShadingSampling, ArctangentsHaveTheSameBitsOnAllVersionsOfTheDriver) {
    const ShadingScene scene{triangle_scene({})};
    constexpr uint kCount = 1 << 14;
    const auto found = scene.run("#include \"shaders/shared/arctangent.h\"", R"(
        vec2 p = vec2(int(i * 37u % 1024u) - 512, int(i % 127u) - 63) / 64.0;
        result[0] = vec4(arctangent(p.y, p.x), p, 0.0);
    )",
                                 kCount);
    uint checksum = 0;
    for (const vec4& each : found) {
        EXPECT_NEAR(each.x, std::atan2(each.z, each.y), 4e-6);
        checksum = 31 * checksum + std::bit_cast<uint>(each.x);
    }
    if (test::test_device() == "software") {
        EXPECT_EQ(checksum, 1005750906u);
    }
}

TEST_F(ShadingSampling, MapsPreserveAreas) {
    const ShadingScene scene{triangle_scene({})};
    constexpr int kGrid = 256;
    const auto found = scene.run("#include \"shaders/lib/sampling.glsl\"\n#include \"shaders/lib/onb.glsl\"", R"(
        vec2 xi = (vec2(i % 256u, i / 256u) + 0.5) / 256.0;
        result[0] = vec4(sample_cosine(xi), 0.0);
        result[1] = vec4(sample_triangle(xi), 0.0, 0.0);
        vec3 n = sphere_direction(2.0 * xi.x - 1.0, xi.y);
        mat3 m = basis_around(n);
        mat3 unit = transpose(m) * m - mat3(1.0);
        result[2] = vec4(length(unit[0]) + length(unit[1]) + length(unit[2]), determinant(m), length(m[2] - n), 0.0);
        result[3] = vec4(power_heuristic(xi.x, 1e30 * xi.y), power_heuristic(1e30 * xi.y, xi.x),
                         power_heuristic(0.0, 0.0), power_heuristic(xi.x, xi.y) + power_heuristic(xi.y, xi.x));
    )",
                                 kGrid * kGrid, 4);
    dvec3 cosine(0);
    double squared = 0;
    dvec2 triangle(0), triangle_squared(0);
    for (std::size_t i = 0; i < found.size(); i += 4) {
        const dvec3 d(found[i]);
        EXPECT_NEAR(glm::length(d), 1, 1e-6);
        cosine += d / double(kGrid * kGrid);
        squared += d.z * d.z / double(kGrid * kGrid);
        const dvec2 t(found[i + 1]);
        EXPECT_TRUE(t.x >= 0 && t.y >= 0 && t.x + t.y <= 1);
        triangle += t / double(kGrid * kGrid);
        triangle_squared += t * t / double(kGrid * kGrid);
        EXPECT_LT(found[i + 2].x, context.software() ? 1e-6f : 2e-6f);  // inverse square roots may have 2 ulp
        EXPECT_NEAR(found[i + 2].y, 1, 1e-6);
        EXPECT_EQ(found[i + 2].z, 0);
        EXPECT_TRUE(found[i + 3].x >= 0 && found[i + 3].x < 1e-30f);
        EXPECT_EQ(found[i + 3].y, 1);
        EXPECT_EQ(found[i + 3].z, 0);
        EXPECT_NEAR(found[i + 3].w, 1, 1e-6);
    }
    EXPECT_NEAR(cosine.x, 0, 1e-5);
    EXPECT_NEAR(cosine.y, 0, 1e-5);
    EXPECT_NEAR(cosine.z, 2 / 3.0, 2e-4);  // E[cos] under cos / pi; the midpoint rule has an error at the rim
    EXPECT_NEAR(squared, 0.5, 1e-4);
    for (int k = 0; k < 2; ++k) {
        EXPECT_NEAR(triangle[k], 1 / 3.0, 1e-4);  // centroid and second moment of a triangle
        EXPECT_NEAR(triangle_squared[k], 1 / 6.0, 1e-4);
    }
}

}  // namespace
}  // namespace halflight
