// Tests the quadrature of the directional albedo against an independent one, and the table's interpolation against the
// quadrature.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/core/math.h"
#include "engine/tables/albedo.h"
#include "shaders/shared/albedo.h"

namespace halflight {
namespace {

/// Evaluates the definition of SHADING.md by a midpoint rule over incident directions.
DirectionalAlbedo by_definition(double mu, double alpha) {
    constexpr int kCosines = 1000, kAzimuths = 1000;
    const double sine = std::sqrt(1 - mu * mu);
    const auto lambda = [&](double c) { return 0.5 * (std::sqrt(1 + alpha * alpha * (1 / (c * c) - 1)) - 1); };
    DirectionalAlbedo sum;
    for (int i = 0; i < kCosines; ++i) {
        const double mu_i = (i + 0.5) / kCosines;
        const double sine_i = std::sqrt(1 - mu_i * mu_i);
        const double g2 = 1 / (1 + lambda(mu) + lambda(mu_i));
        for (int j = 0; j < kAzimuths; ++j) {
            const double phi = kPi * (j + 0.5) / kAzimuths;
            const dvec3 wo(sine, 0, mu), wi(sine_i * std::cos(phi), sine_i * std::sin(phi), mu_i);
            const dvec3 h = glm::normalize(wo + wi);
            const double k = h.z * h.z * (alpha * alpha - 1) + 1;
            const double d = alpha * alpha / (kPi * k * k);
            const double value = d * g2 / (4 * mu) * 2 * kPi / (double(kCosines) * kAzimuths);
            const double schlick = std::pow(1 - glm::dot(wo, h), 5);
            sum.a += value * (1 - schlick);
            sum.b += value * schlick;
        }
    }
    return sum;
}

TEST(DirectionalAlbedo, IsTheIntegralOfTheLobe) {
    for (const double alpha : {0.1, 0.4, 1.0}) {
        for (const double mu : {0.1, 0.5, 0.95}) {
            const DirectionalAlbedo expected = by_definition(mu, alpha);
            const DirectionalAlbedo found = ggx_albedo(mu, alpha);
            EXPECT_NEAR(found.a, expected.a, 2e-5) << alpha << ' ' << mu;
            EXPECT_NEAR(found.b, expected.b, 2e-5) << alpha << ' ' << mu;
        }
    }
}

TEST(DirectionalAlbedo, ApproachesTheMirrors) {
    for (const double mu : {0.05, 0.3, 1.0}) {
        const DirectionalAlbedo found = ggx_albedo(mu, 1e-4);
        EXPECT_NEAR(found.b, std::pow(1 - mu, 5), 1e-4) << mu;
        EXPECT_NEAR(found.a + found.b, 1, 1e-5) << mu;
    }
}

TEST(DirectionalAlbedo, QuadratureHasConverged) {
    for (const double alpha : {1e-4, 1e-2, 0.3, 1.0}) {
        for (const double mu : {0.0, 1e-6, 1e-3, 0.02, 0.4, 1.0}) {
            const DirectionalAlbedo coarse = ggx_albedo(mu, alpha), fine = ggx_albedo(mu, alpha, 96);
            const double bound = mu > alpha / 100 ? 3e-5 : 1e-4;
            EXPECT_NEAR(coarse.a, fine.a, bound) << alpha << ' ' << mu;
            EXPECT_NEAR(coarse.b, fine.b, bound) << alpha << ' ' << mu;
        }
    }
}

TEST(DirectionalAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table();
    std::mt19937 random(5);
    const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
    for (int k = 0; k < 4000; ++k) {
        const double roughness = 0.01 + 0.99 * uniform();
        const double alpha = roughness * roughness;
        const double mu = std::max(k % 2 == 0 ? uniform() : std::pow(10.0, -5 * uniform()), 1e-5);
        const vec2 at = shared::albedo_coordinates(static_cast<float>(mu), static_cast<float>(alpha)) *
                        static_cast<float>(shared::kAlbedoTableSize - 1);
        const ivec2 cell = glm::clamp(ivec2(at), 0, shared::kAlbedoTableSize - 2);
        const dvec2 f = dvec2(at) - dvec2(cell);
        const auto blend = [&](int channel) {
            const auto texel = [&](int x, int y) -> double { return table.at(cell.x + x, cell.y + y)[channel]; };
            return glm::mix(glm::mix(texel(0, 0), texel(1, 0), f.x), glm::mix(texel(0, 1), texel(1, 1), f.x), f.y);
        };
        const DirectionalAlbedo exact = ggx_albedo(mu, alpha, 32);
        const double whole = exact.a + exact.b;
        EXPECT_NEAR(blend(0) / whole, 1, mu >= 1e-4 ? 1e-4 : 2e-4) << mu << ' ' << alpha;
        const double edge = blend(0) * (std::pow(1 - mu, 5) + blend(1));
        EXPECT_NEAR(edge / whole, exact.b / whole, alpha >= 0.01 ? 1e-4 : 4e-4) << mu << ' ' << alpha;
    }
}

TEST(SolidAlbedo, LosesNothingWhereNothingIsRough) {
    for (const double eta : {0.05, 1 / 1.5, 1.0, 1.5, 20.0})
        for (const double cosine : {0.01, 0.3, 1.0}) EXPECT_NEAR(solid_albedo(cosine, 1e-4, eta, 64), 1, 1e-3) << eta;
}

TEST(SolidAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table(true, true), without = build_albedo_table(true);
    ASSERT_EQ(table.height, 2 * shared::kAlbedoTableSize + shared::kSolidTableRows);
    EXPECT_TRUE(std::equal(without.pixels.begin(), without.pixels.end(), table.pixels.begin()));
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
    double worst = 0, sum = 0;
    constexpr int kPoints = 500;
    for (int k = 0; k < kPoints; ++k) {
        const double mu = uniform(), roughness = 0.01 + 0.99 * uniform();
        const double reflectance = 0.9 * (2 * uniform() - 1), eta = (1 + reflectance) / (1 - reflectance);
        const auto alpha = static_cast<float>(roughness * roughness);
        const vec3 size(shared::kSolidTableSize, shared::kSolidTableSize, shared::kSolidTableSlices);
        const vec3 at =
            shared::solid_coordinates(static_cast<float>(mu), alpha, static_cast<float>(eta)) * (size - 1.0f);
        const ivec3 cell = glm::min(ivec3(at), ivec3(size) - 2);
        const vec3 f = at - vec3(cell);
        double found = 0;
        for (int i = 0; i < 8; ++i) {
            const ivec3 step(i & 1, i >> 1 & 1, i >> 2), node = cell + step;
            const vec3 weight = glm::mix(1.0f - f, f, vec3(step));
            const int x = node.z % shared::kSolidTableColumns * shared::kSolidTableSize + node.x;
            const int y = node.z / shared::kSolidTableColumns * shared::kSolidTableSize + node.y;
            found += weight.x * weight.y * weight.z * table.at(x, 2 * shared::kAlbedoTableSize + y)[0];
        }
        const double off = std::abs(found - solid_albedo(mu, alpha, eta, 4096));
        worst = std::max(worst, off);
        sum += off;
    }
    EXPECT_LT(worst, 0.015);
    EXPECT_LT(sum / kPoints, 1.5e-3);
    RecordProperty("worst", std::to_string(worst));
}

TEST(SheenAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table(true), without = build_albedo_table();
    ASSERT_EQ(table.height, 2 * shared::kAlbedoTableSize);
    EXPECT_TRUE(std::equal(without.pixels.begin(), without.pixels.end(), table.pixels.begin()));
    std::mt19937 random(6);
    const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
    for (int k = 0; k < 2000; ++k) {
        const double mu = std::pow(uniform(), 2);
        const double roughness = glm::mix<double>(shared::kLeastSheenRoughness, 1, std::pow(uniform(), 2));
        const vec2 at = shared::sheen_coordinates(static_cast<float>(mu), static_cast<float>(roughness)) *
                        static_cast<float>(shared::kAlbedoTableSize - 1);
        const ivec2 cell = glm::clamp(ivec2(at), 0, shared::kAlbedoTableSize - 2);
        const dvec2 f = dvec2(at) - dvec2(cell);
        const auto texel = [&](int x, int y) -> double {
            return table.at(cell.x + x, shared::kAlbedoTableSize + cell.y + y)[0];
        };
        const double found =
            glm::mix(glm::mix(texel(0, 0), texel(1, 0), f.x), glm::mix(texel(0, 1), texel(1, 1), f.x), f.y);
        const double exact = sheen_albedo(mu, roughness, 48);
        EXPECT_NEAR(found, exact, 1e-3 * std::max(exact, 1.0)) << mu << ' ' << roughness;
    }
}

}  // namespace
}  // namespace halflight
