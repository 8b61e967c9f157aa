// Tests the quadrature of the directional albedo against an independent one, and the table's interpolation against the
// quadrature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "engine/core/math.h"
#include "engine/core/statistics.h"
#include "engine/tables/albedo.h"
#include "shaders/shared/albedo_coordinates.h"

namespace halflight {
namespace {

/// Makes random numbers in [0, 1) that are equal on all platforms.
class Uniform {
  public:
    explicit Uniform(std::uint32_t seed) : random_(seed) {}
    double operator()() { return static_cast<double>(random_()) * 0x1p-32; }

  private:
    std::mt19937 random_;
};

/// Interpolates between the nodes around `at`, in a grid of `size` nodes per axis.
template <int N>
dvec2 interpolated(const glm::vec<N, float>& at, const glm::vec<N, int>& size,
                   const std::function<dvec2(const glm::vec<N, int>&)>& node) {
    const glm::vec<N, int> cell = glm::clamp(glm::vec<N, int>(at), glm::vec<N, int>(0), size - 2);
    const glm::vec<N, double> f = glm::vec<N, double>(at) - glm::vec<N, double>(cell);
    dvec2 sum(0);
    for (int corner = 0; corner < 1 << N; ++corner) {
        glm::vec<N, int> step(0);
        double weight = 1;
        for (int axis = 0; axis < N; ++axis) {
            step[axis] = corner >> axis & 1;
            weight *= step[axis] ? f[axis] : 1 - f[axis];
        }
        sum += weight * node(cell + step);
    }
    return sum;
}

const ivec2 kSquare(shared::kAlbedoTableSize);

/// Returns the table with all its parts: those of the isotropic lobe, the sheen, anisotropy and solids.
const Image& whole_table() {
    static const Image table = build_albedo_table({.sheen = true, .anisotropy = true, .solid = true});
    return table;
}

// First rows of the parts of whole_table().
constexpr int kSheenRow = shared::kAlbedoTableSize, kAnisotropyRow = kSheenRow + shared::kAlbedoTableSize,
              kSolidRow = kAnisotropyRow + shared::kAnisotropyTableRows;

void expect_near(const DirectionalAlbedo& found, const DirectionalAlbedo& expected, double tolerance) {
    EXPECT_NEAR(found.a, expected.a, tolerance);
    EXPECT_NEAR(found.b, expected.b, tolerance);
}

dvec2 first_two(const float* texel) {
    return {texel[0], texel[1]};
}

/// Evaluates the definition of SHADING.md by a midpoint rule over incident directions.
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

TEST(AlbedoTable, HasItsPartsInOrder) {
    const std::tuple<AlbedoParts, int, int> parts[] = {
        {{}, 0, shared::kAlbedoTableSize},
        {{.sheen = true}, kSheenRow, shared::kAlbedoTableSize},
        {{.anisotropy = true}, kAnisotropyRow, shared::kAnisotropyTableRows},
        {{.solid = true}, kSolidRow, shared::kSolidTableRows}};
    for (const auto& [part, row, rows] : parts) {
        const Image alone = build_albedo_table(part);
        ASSERT_EQ(alone.height, (row > 0 ? shared::kAlbedoTableSize : 0) + rows);
        const auto texels = std::ssize(alone.pixels) / alone.height * rows;
        EXPECT_TRUE(std::equal(alone.pixels.end() - texels, alone.pixels.end(), whole_table().at(0, row))) << row;
    }
    EXPECT_EQ(whole_table().height, kSolidRow + shared::kSolidTableRows);
}

TEST(DirectionalAlbedo, IsTheIntegralOfTheLobe) {
    for (const double alpha : {0.1, 0.4, 1.0})
        for (const double mu : {0.1, 0.5, 0.95})
            expect_near(ggx_albedo(mu, alpha), by_definition(direction(mu, 0), dvec2(alpha)), 2e-5);
}

TEST(DirectionalAlbedo, ApproachesTheMirrors) {
    for (const double mu : {0.05, 0.3, 1.0}) {
        const DirectionalAlbedo found = ggx_albedo(mu, 1e-4);
        EXPECT_NEAR(found.b, std::pow(1 - mu, 5), 1e-4) << mu;
        EXPECT_NEAR(found.a + found.b, 1, 1e-5) << mu;
    }
}

TEST(DirectionalAlbedo, QuadratureHasConverged) {
    for (const double alpha : {1e-4, 1e-2, 0.3, 1.0})
        for (const double mu : {0.0, 1e-6, 1e-3, 0.02, 0.4, 1.0})
            expect_near(ggx_albedo(mu, alpha), ggx_albedo(mu, alpha, 96), mu > alpha / 100 ? 3e-5 : 1e-4);
}

TEST(DirectionalAlbedo, TableInterpolatesWithinTolerance) {
    Uniform uniform(5);
    for (int k = 0; k < 4000; ++k) {
        const double roughness = 0.01 + 0.99 * uniform();
        const double alpha = roughness * roughness;
        const double mu = std::max(k % 2 == 0 ? uniform() : std::pow(10.0, -5 * uniform()), 1e-5);
        const vec2 at = shared::albedo_coordinates(static_cast<float>(mu), static_cast<float>(alpha));
        const dvec2 found = interpolated<2>(at * vec2(kSquare - 1), kSquare,
                                            [&](const ivec2& p) { return first_two(whole_table().at(p.x, p.y)); });
        const DirectionalAlbedo exact = ggx_albedo(mu, alpha, 32);
        const double whole = exact.a + exact.b, edge = found.x * (std::pow(1 - mu, 5) + found.y);
        EXPECT_NEAR(found.x / whole, 1, mu >= 1e-4 ? 1e-4 : 2e-4) << mu << ' ' << alpha;
        EXPECT_NEAR(edge / whole, exact.b / whole, alpha >= 0.01 ? 1e-4 : 4e-4) << mu << ' ' << alpha;
    }
}

TEST(AnisotropicAlbedo, IsTheIntegralOfTheLobe) {
    for (const dvec2 alpha : {dvec2(0.8, 0.1), dvec2(1, 0.4), dvec2(0.3, 0.15)})
        for (const double mu : {0.1, 0.5, 0.95})
            for (const double azimuth : {0.0, 0.8, 1.5, 2.0}) {
                const dvec3 wo = direction(mu, azimuth);
                expect_near(ggx_albedo(wo, alpha), by_definition(wo, alpha), 3e-4);
            }
    for (const double mu : {0.05, 0.6})  // the isotropic lobe is a limit
        expect_near(ggx_albedo(direction(mu, 0.4), dvec2(0.3), 32), ggx_albedo(mu, 0.3), 3e-5);
}

TEST(AnisotropicAlbedo, QuadratureHasConverged) {
    for (const dvec2 alpha : {dvec2(1, 1e-4), dvec2(0.5, 0.01), dvec2(0.02, 1e-4), dvec2(1, 0.5)})
        for (const double mu : {0.0, 1e-4, 1e-2, 0.2, 1.0})
            for (const double azimuth : {0.0, 0.7, 1.5, kPi / 2}) {
                const dvec3 wo = direction(mu, azimuth);
                expect_near(ggx_albedo(wo, alpha), ggx_albedo(wo, alpha, 96), 5e-4);
            }
}

TEST(AnisotropicAlbedo, TableInterpolatesWithinTolerance) {
    const ivec4 size(shared::kAnisotropyCosines, shared::kAnisotropyAngles, shared::kAnisotropyRoughnesses,
                     shared::kAnisotropyStrengths);
    Uniform uniform(7);
    std::vector<double> whole_errors, edge_errors;
    for (int k = 0; k < 4000; ++k) {
        const double roughness = 0.01 + 0.99 * uniform(), strength = uniform(), mu = std::max(uniform(), 1e-4);
        const double across = roughness * roughness;
        const dvec2 alpha(glm::mix(across, 1.0, strength * strength), across);
        const dvec3 wo = direction(mu, kPi / 2 * uniform());
        const dvec2 found = interpolated<4>(shared::anisotropy_coordinates(vec3(wo), vec2(alpha)) * vec4(size - 1),
                                            size, [&](const ivec4& node) {
                                                const ivec2 texel = shared::anisotropy_texel(node);
                                                return first_two(whole_table().at(texel.x, kAnisotropyRow + texel.y));
                                            });
        const DirectionalAlbedo exact = ggx_albedo(wo, alpha);
        const double whole = exact.a + exact.b;
        whole_errors.push_back(std::abs(found.x / whole - 1));
        edge_errors.push_back(std::abs(found.x * (std::pow(1 - mu, 5) + found.y) - exact.b) / whole);
    }
    for (std::vector<double>* errors : {&whole_errors, &edge_errors}) {
        EXPECT_LT(quantile(*errors, 0.99), 3e-3);
        EXPECT_LT(std::ranges::max(*errors), 0.02);
    }
}

TEST(SolidAlbedo, LosesNothingWhereNothingIsRough) {
    for (const double eta : {0.05, 1 / 1.5, 1.0, 1.5, 20.0})
        for (const double cosine : {0.01, 0.3, 1.0})
            EXPECT_NEAR(solid_albedo(cosine, 1e-4, eta, 64).whole, 1, 1e-3) << eta;
}

TEST(SolidAlbedo, TableInterpolatesWithinTolerance) {
    const ivec3 size(shared::kSolidTableSize, shared::kSolidTableSize, shared::kSolidTableSlices);
    Uniform uniform(7);
    double worst = 0, sum = 0;
    constexpr int kPoints = 500;
    for (int k = 0; k < kPoints; ++k) {
        const double mu = uniform(), roughness = 0.01 + 0.99 * uniform();
        const double reflectance = 0.9 * (2 * uniform() - 1), eta = (1 + reflectance) / (1 - reflectance);
        const auto alpha = static_cast<float>(roughness * roughness);
        const vec3 at = shared::solid_coordinates(static_cast<float>(mu), alpha, static_cast<float>(eta));
        const dvec2 found = interpolated<3>(at * vec3(size - 1), size, [&](const ivec3& node) {
            const ivec2 slice(node.z % shared::kSolidTableColumns, node.z / shared::kSolidTableColumns);
            const ivec2 texel = slice * shared::kSolidTableSize + ivec2(node);
            return first_two(whole_table().at(texel.x, kSolidRow + texel.y));
        });
        const SolidAlbedo exact = solid_albedo(mu, alpha, eta, 4096);
        // Only light from outside may find an interface that reflects less.
        const double off =
            std::max(std::abs(found.x - exact.whole), eta > 1.01 ? std::abs(found.y - exact.refracted) : 0.0);
        worst = std::max(worst, off);
        sum += off;
    }
    EXPECT_LT(worst, 0.01);
    EXPECT_LT(sum / kPoints, 1e-3);
}

TEST(SheenAlbedo, TableInterpolatesWithinTolerance) {
    Uniform uniform(6);
    for (int k = 0; k < 2000; ++k) {
        const double mu = std::pow(uniform(), 2);
        const double roughness = glm::mix<double>(shared::kLeastSheenRoughness, 1, std::pow(uniform(), 2));
        const vec2 at = shared::sheen_coordinates(static_cast<float>(mu), static_cast<float>(roughness));
        const dvec2 found = interpolated<2>(at * vec2(kSquare - 1), kSquare, [&](const ivec2& p) {
            return first_two(whole_table().at(p.x, kSheenRow + p.y));
        });
        const double exact = sheen_albedo(mu, roughness, 48);
        EXPECT_NEAR(found.x, exact, 1e-3 * std::max(exact, 1.0)) << mu << ' ' << roughness;
    }
}

}  // namespace
}  // namespace halflight
