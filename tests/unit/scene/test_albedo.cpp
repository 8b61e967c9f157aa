// Tests the quadrature of the directional albedo against an independent one, and the table's interpolation against the
// quadrature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

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

/// Evaluates the definition of the anisotropic lobe by a midpoint rule over incident directions.
DirectionalAlbedo by_definition(const dvec3& wo, const dvec2& alpha) {
    constexpr int kCosines = 800, kAzimuths = 800;
    const auto lambda = [&](const dvec3& w) {
        const double slope2 = (alpha.x * alpha.x * w.x * w.x + alpha.y * alpha.y * w.y * w.y) / (w.z * w.z);
        return 0.5 * (std::sqrt(1 + slope2) - 1);
    };
    DirectionalAlbedo sum;
    for (int i = 0; i < kCosines; ++i) {
        const double mu_i = (i + 0.5) / kCosines, sine_i = std::sqrt(1 - mu_i * mu_i);
        for (int j = 0; j < kAzimuths; ++j) {
            const double phi = 2 * kPi * (j + 0.5) / kAzimuths;
            const dvec3 wi(sine_i * std::cos(phi), sine_i * std::sin(phi), mu_i), h = glm::normalize(wo + wi);
            const double k = std::pow(h.x / alpha.x, 2) + std::pow(h.y / alpha.y, 2) + h.z * h.z;
            const double d = 1 / (kPi * alpha.x * alpha.y * k * k);
            const double value =
                d / (1 + lambda(wo) + lambda(wi)) / (4 * wo.z) * 2 * kPi / (double(kCosines) * kAzimuths);
            const double schlick = std::pow(1 - glm::dot(wo, h), 5);
            sum.a += value * (1 - schlick);
            sum.b += value * schlick;
        }
    }
    return sum;
}

dvec3 direction(double mu, double azimuth) {
    const double sine = std::sqrt(1 - mu * mu);
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), mu};
}

TEST(AnisotropicAlbedo, IsTheIntegralOfTheLobe) {
    for (const dvec2 alpha : {dvec2(0.8, 0.1), dvec2(1, 0.4), dvec2(0.3, 0.15)}) {
        for (const double mu : {0.1, 0.5, 0.95}) {
            for (const double azimuth : {0.0, 0.8, 1.5, 2.0}) {
                const dvec3 wo = direction(mu, azimuth);
                const DirectionalAlbedo expected = by_definition(wo, alpha), found = ggx_albedo(wo, alpha);
                EXPECT_NEAR(found.a, expected.a, 3e-4) << alpha.x << ' ' << alpha.y << ' ' << mu << ' ' << azimuth;
                EXPECT_NEAR(found.b, expected.b, 3e-4) << alpha.x << ' ' << alpha.y << ' ' << mu << ' ' << azimuth;
            }
        }
    }
    for (const double mu : {0.05, 0.6}) {  // the isotropic lobe is a limit
        const DirectionalAlbedo expected = ggx_albedo(mu, 0.3), found = ggx_albedo(direction(mu, 0.4), dvec2(0.3), 32);
        EXPECT_NEAR(found.a, expected.a, 3e-5);
        EXPECT_NEAR(found.b, expected.b, 3e-5);
    }
}

TEST(AnisotropicAlbedo, QuadratureHasConverged) {
    for (const dvec2 alpha : {dvec2(1, 1e-4), dvec2(0.5, 0.01), dvec2(0.02, 1e-4), dvec2(1, 0.5)}) {
        for (const double mu : {0.0, 1e-4, 1e-2, 0.2, 1.0}) {
            for (const double azimuth : {0.0, 0.7, 1.5, kPi / 2}) {
                const dvec3 wo = direction(mu, azimuth);
                const DirectionalAlbedo coarse = ggx_albedo(wo, alpha), fine = ggx_albedo(wo, alpha, 96);
                EXPECT_NEAR(coarse.a, fine.a, 5e-4) << alpha.x << ' ' << alpha.y << ' ' << mu << ' ' << azimuth;
                EXPECT_NEAR(coarse.b, fine.b, 5e-4) << alpha.x << ' ' << alpha.y << ' ' << mu << ' ' << azimuth;
            }
        }
    }
}

TEST(AnisotropicAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table({.anisotropy = true}), both = build_albedo_table({true, true});
    ASSERT_EQ(table.height, shared::kAlbedoTableSize + shared::kAnisotropyTableRows);
    EXPECT_TRUE(std::equal(table.pixels.rbegin(),
                           table.pixels.rend() - 2 * shared::kAlbedoTableSize * shared::kAlbedoTableSize,
                           both.pixels.rbegin()));
    std::mt19937 random(7);
    const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32; };
    const ivec4 last = ivec4(shared::kAnisotropyCosines, shared::kAnisotropyAngles, shared::kAnisotropyRoughnesses,
                             shared::kAnisotropyStrengths) -
                       1;
    std::vector<double> whole_errors, edge_errors;
    for (int k = 0; k < 4000; ++k) {
        const double roughness = 0.01 + 0.99 * uniform(), strength = uniform(), mu = std::max(uniform(), 1e-4);
        const double across = roughness * roughness;
        const dvec2 alpha(glm::mix(across, 1.0, strength * strength), across);
        const dvec3 wo = direction(mu, kPi / 2 * uniform());
        const vec4 at = shared::anisotropy_coordinates(vec3(wo), vec2(alpha)) * vec4(last);
        const ivec4 cell = glm::clamp(ivec4(at), ivec4(0), last - 1);
        const dvec4 f = dvec4(at) - dvec4(cell);
        dvec2 found(0);
        for (int corner = 0; corner < 16; ++corner) {
            const ivec4 step(corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3);
            double weight = 1;
            for (int axis = 0; axis < 4; ++axis) weight *= step[axis] ? f[axis] : 1 - f[axis];
            const ivec2 texel = shared::anisotropy_texel(cell + step) + ivec2(0, shared::kAlbedoTableSize);
            found += weight * dvec2(table.at(texel.x, texel.y)[0], table.at(texel.x, texel.y)[1]);
        }
        const DirectionalAlbedo exact = ggx_albedo(wo, alpha);
        const double whole = exact.a + exact.b;
        whole_errors.push_back(std::abs(found.x / whole - 1));
        edge_errors.push_back(std::abs(found.x * (std::pow(1 - mu, 5) + found.y) - exact.b) / whole);
        EXPECT_LT(whole_errors.back(), 0.02) << mu << ' ' << roughness << ' ' << strength << ' ' << wo.y;
        EXPECT_LT(edge_errors.back(), 0.02) << mu << ' ' << roughness << ' ' << strength << ' ' << wo.y;
    }
    std::ranges::sort(whole_errors);
    std::ranges::sort(edge_errors);
    std::printf("  99 %%: %.5f %.5f, worst: %.5f %.5f\n", whole_errors[3960], edge_errors[3960], whole_errors.back(),
                edge_errors.back());
    EXPECT_LT(whole_errors[3960], 3e-3);
    EXPECT_LT(edge_errors[3960], 3e-3);
}

TEST(SolidAlbedo, LosesNothingWhereNothingIsRough) {
    for (const double eta : {0.05, 1 / 1.5, 1.0, 1.5, 20.0})
        for (const double cosine : {0.01, 0.3, 1.0})
            EXPECT_NEAR(solid_albedo(cosine, 1e-4, eta, 64).whole, 1, 1e-3) << eta;
}

TEST(SolidAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table({.sheen = true, .solid = true}),
                without = build_albedo_table({.sheen = true});
    ASSERT_EQ(table.height, 2 * shared::kAlbedoTableSize + shared::kSolidTableRows);
    EXPECT_TRUE(std::equal(without.pixels.begin(), without.pixels.end(), table.pixels.begin()));
    const Image all = build_albedo_table({.sheen = true, .anisotropy = true, .solid = true});
    ASSERT_EQ(all.height, table.height + shared::kAnisotropyTableRows);
    EXPECT_TRUE(
        std::equal(table.pixels.rbegin(), table.pixels.rend() - std::ssize(without.pixels), all.pixels.rbegin()))
        << "solids follow anisotropy";
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
        dvec2 found(0);
        for (int i = 0; i < 8; ++i) {
            const ivec3 step(i & 1, i >> 1 & 1, i >> 2), node = cell + step;
            const vec3 weight = glm::mix(1.0f - f, f, vec3(step));
            const int x = node.z % shared::kSolidTableColumns * shared::kSolidTableSize + node.x;
            const int y = node.z / shared::kSolidTableColumns * shared::kSolidTableSize + node.y;
            const float* const texel = table.at(x, 2 * shared::kAlbedoTableSize + y);
            found += double(weight.x * weight.y * weight.z) * dvec2(texel[0], texel[1]);
        }
        const SolidAlbedo exact = solid_albedo(mu, alpha, eta, 4096);
        // Only light from outside may find an interface that reflects less.
        const double off =
            std::max(std::abs(found.x - exact.whole), eta > 1.01 ? std::abs(found.y - exact.refracted) : 0.0);
        worst = std::max(worst, off);
        sum += off;
    }
    EXPECT_LT(worst, 0.01);
    EXPECT_LT(sum / kPoints, 1e-3);
    RecordProperty("worst", std::to_string(worst));
}

TEST(SheenAlbedo, TableInterpolatesWithinTolerance) {
    const Image table = build_albedo_table({.sheen = true}), without = build_albedo_table();
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
