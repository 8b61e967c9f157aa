// Tests the oracle's material and its albedo tables without a scene.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>
#include <vector>

#include "engine/core/statistics.h"
#include "engine/reference/bsdf.h"
#include "engine/reference/random.h"
#include "engine/reference/sheen.h"
#include "tests/support/image_tests.h"

namespace halflight::reference {
namespace {

dvec3 direction_at(double mu, double phi = 0) {
    const double s = std::sqrt(1 - mu * mu);
    return {s * std::cos(phi), s * std::sin(phi), mu};
}

const dvec3 kUp{0, 0, 1};

struct Case {
    const char* name;
    BsdfParameters parameters;
};

BsdfParameters coated(BsdfParameters p, double clearcoat, double roughness) {
    p.clearcoat = clearcoat, p.clearcoat_roughness = roughness;
    return p;
}

BsdfParameters with_sheen(BsdfParameters p, double color, double roughness) {
    p.sheen_color = dvec3(color), p.sheen_roughness = roughness;
    return p;
}

BsdfParameters brushed(BsdfParameters p, double strength, double phi) {
    p.anisotropy = strength, p.rough_direction = direction_at(0, phi);
    return p;
}

BsdfParameters solid(BsdfParameters p, bool front = true) {
    p.inside.thickness = 1, p.front = front;
    return p;
}

/// Returns white materials of every kind, whose albedo is 1 (SHADING.md, "White furnace").
std::vector<Case> white_materials() {
    std::vector<Case> cases;
    const auto add = [&](const char* name, const BsdfParameters& p) { cases.push_back({name, p}); };
    for (const double r : {0.0, 0.1, 0.5, 1.0}) {
        add("metal", {.roughness = r});
        for (const double ior : {1.0, 1.5, 2.5}) add("dielectric", {.metallic = 0, .roughness = r, .ior = ior});
        add("half metal", {.metallic = 0.5, .roughness = r});
        add("specular 0.5", {.metallic = 0, .roughness = r, .specular = 0.5});
        add("specular colour", {.metallic = 0, .roughness = r, .specular_color = dvec3(30)});
        add("transmission", {.metallic = 0, .roughness = r, .transmission = 0.7});
        for (const double coat : {0.0, 0.3, 1.0}) add("coated", coated({.metallic = 0, .roughness = r}, 0.8, coat));
        add("sheen", with_sheen({.metallic = 0}, 1, r));
        add("coated sheen over metal", with_sheen(coated({.roughness = 0.4}, 0.5, 0.3), 0.7, r));
        for (const double t : {0.4, 1.0}) {
            add("leaf", {.metallic = 0, .roughness = r, .diffuse_transmission = t});
            const BsdfParameters leaf{.metallic = 0.5, .roughness = r, .transmission = 0.5, .diffuse_transmission = t};
            add("coated half metallic leaf that transmits", with_sheen(coated(leaf, 0.5, 0.3), 0.5, 0.5));
        }
        for (const double strength : {0.3, 0.8}) {
            add("brushed metal", brushed({.roughness = r}, strength, 1 - strength));
            add("brushed transmission",
                brushed({.metallic = 0.2, .roughness = r, .transmission = 0.6}, strength, 1 - strength));
        }
        for (const double ior : {1.0, 1.33, 2.4, 20.0}) {
            for (const bool front : {true, false})
                add("solid", solid({.metallic = 0, .roughness = r, .ior = ior, .transmission = 1}, front));
        }
        for (const double specular : {0.0, 0.4}) {
            add("solid of little specular",
                solid({.metallic = 0, .roughness = r, .specular = specular, .ior = 2, .transmission = 1}));
        }
        const BsdfParameters half{.metallic = 0.3, .roughness = r, .transmission = 0.6};
        add("coated half solid", solid(coated(half, 0.5, 0.3)));
        add("brushed half solid", solid(brushed(half, 0.7, 1)));
        add("candle", solid({.metallic = 0, .roughness = r, .transmission = 0.3, .diffuse_transmission = 0.6}, false));
    }
    return cases;
}

/// Compares the quadrature of an albedo with `kSamples` sampled directions.
template <class Alpha>
void expect_albedo(const Albedo& albedo, const dvec3& wo, const Alpha& alpha, double tolerance, Random& random) {
    constexpr int kSamples = 40000;
    const auto visibility = [&](const dvec3& wi) {
        if constexpr (std::is_same_v<Alpha, double>) {
            return ggx_visibility(wo.z, wi.z, alpha);
        } else {
            return ggx_visibility(wo, wi, alpha);
        }
    };
    RunningMoments one, b;
    for (int i = 0; i < kSamples; ++i) {
        const double u1 = random.uniform(), u2 = random.uniform();
        const dvec3 h = sample_visible_normal(wo, alpha, u1, u2);
        const dvec3 wi = 2 * dot(wo, h) * h - wo;
        const double f = wi.z <= 0 ? 0 : visibility(wi) * ggx_distribution(h, alpha) * wi.z;
        const double value = f / reflection_pdf(wo, h, alpha);
        one.add(value);
        b.add(value * schlick(dot(wo, h)));
    }
    EXPECT_NEAR(albedo.one(), one.mean(), 4 * one.standard_error() + tolerance) << wo.z;
    EXPECT_NEAR(albedo.b, b.mean(), 4 * b.standard_error() + tolerance) << wo.z;
}

TEST(ReferenceAlbedo, QuadratureAgreesWithMonteCarlo) {
    Random random(1);
    // The error of values that are almost always 1 or 0 is not normal. The tolerance adds one sample.
    for (const double alpha : {0.001, 0.01, 0.1, 0.4, 1.0}) {
        for (const double mu : {0.01, 0.1, 0.5, 1.0})
            expect_albedo(integrate_albedo(mu, alpha), direction_at(mu), alpha, 3e-5, random);
    }
    for (const dvec2 alpha : {dvec2(0.9, 0.01), dvec2(0.5, 0.2), dvec2(0.2, 1e-4)}) {
        for (const double mu : {0.02, 0.3, 1.0}) {
            for (const double phi : {0.0, 0.9, 1.5}) {
                const dvec3 wo = direction_at(mu, phi);
                expect_albedo(integrate_albedo(wo, alpha), wo, alpha, 1e-3, random);
            }
        }
    }
}

TEST(ReferenceAlbedo, TableAgreesWithQuadrature) {
    Random random(2);
    RunningMoments error;
    for (int i = 0; i < 1000; ++i) {
        const double mu = 0.02 + 0.98 * random.uniform(), roughness = 0.03 + 0.97 * random.uniform();
        const Albedo exact = integrate_albedo(mu, roughness * roughness);
        const Albedo table = directional_albedo(mu, roughness * roughness);
        EXPECT_NEAR(table.one(), exact.one(), 2e-4) << mu << ' ' << roughness;
        EXPECT_NEAR(table.b, exact.b, 2e-4) << mu << ' ' << roughness;
        error.add(std::abs(table.one() - exact.one()));
    }
    EXPECT_LT(error.mean(), 5e-6);
}

TEST(ReferenceAlbedo, AnisotropicTableAgreesWithQuadrature) {
    Random random(8);
    RunningMoments error;
    for (int i = 0; i < 2000; ++i) {
        const double roughness = 0.03 + 0.97 * random.uniform(), strength = random.uniform();
        const dvec2 alpha(glm::mix(roughness * roughness, 1.0, strength * strength), roughness * roughness);
        const double z = 0.02 + 0.98 * random.uniform(), phi = 2 * kPi * random.uniform();
        const Albedo exact = integrate_albedo(direction_at(z, phi), alpha);
        const Albedo table = directional_albedo(direction_at(z, phi), alpha);
        EXPECT_NEAR(table.one(), exact.one(), 0.03) << z << ' ' << phi << ' ' << roughness << ' ' << strength;
        error.add(std::abs(table.one() - exact.one()));
    }
    EXPECT_LT(error.mean(), 1e-3);
}

TEST(ReferenceAlbedo, LimitsAreKnown) {
    EXPECT_DOUBLE_EQ(directional_albedo(0.3, 0).one(), 1);
    EXPECT_DOUBLE_EQ(directional_albedo(0.3, 0).b, std::pow(0.7, 5));
    EXPECT_NEAR(integrate_albedo(0.5, 2 * kMirrorAlpha).one(), 1, 1e-5);
    EXPECT_NEAR(integrate_albedo(0, 0.5).one(), 1, 1e-5);  // all visible microfacets are lit at grazing angles
}

TEST(ReferenceAlbedo, SheenAgreesWithMonteCarloAndItsTable) {
    Random random(6);
    for (const double roughness : {0.0, 0.1, 0.4, 1.0}) {
        for (const double mu : {0.0, 0.05, 0.3, 1.0}) {
            RunningMoments albedo;
            for (int i = 0; i < 100000; ++i) {
                const double z = random.uniform(), phi = 2 * kPi * random.uniform();
                albedo.add(2 * kPi * sheen_value(direction_at(mu), direction_at(z, phi), roughness));
            }
            const double exact = integrate_sheen_albedo(mu, roughness);
            EXPECT_NEAR(exact, albedo.mean(), 4 * albedo.standard_error()) << mu << ' ' << roughness;
            EXPECT_NEAR(sheen_albedo(mu, roughness), exact, 3e-4 * std::max(exact, 1.0)) << mu << ' ' << roughness;
        }
    }
    for (int i = 0; i < 1000; ++i) {
        const double mu = random.uniform(), roughness = random.uniform();
        const double exact = integrate_sheen_albedo(mu, roughness);
        EXPECT_NEAR(sheen_albedo(mu, roughness), exact, 3e-4 * std::max(exact, 1.0)) << mu << ' ' << roughness;
    }
}

TEST(ReferenceBsdf, WhiteMaterialsLoseNoEnergyAndColouredOnesGainNone) {
    Random random(3);
    for (const Case& c : white_materials()) {
        const double table = c.parameters.is_solid() ? 5e-3 : c.parameters.anisotropy > 0 ? 3e-3 : 2e-4;
        BsdfParameters coloured = c.parameters;
        coloured.base_color = {0.9, 0.5, 0.1};
        for (const double mu : {0.05, 0.4, 0.95}) {
            SCOPED_TRACE(fmt::format("{} roughness {} mu {}", c.name, c.parameters.roughness, mu));
            const auto weight = [&](const BsdfParameters& parameters, int samples) {
                const Bsdf bsdf(parameters, direction_at(mu), kUp, kUp, kUp);
                RunningMoments moments;
                for (int i = 0; i < samples; ++i) {
                    const double u = random.uniform(), u1 = random.uniform(), u2 = random.uniform();
                    const auto s = bsdf.sample(u, u1, u2);
                    moments.add(s ? std::max({s->weight.x, s->weight.y, s->weight.z}) : 0);
                }
                return moments;
            };
            const RunningMoments white = weight(c.parameters, 20000), dim = weight(coloured, 5000);
            EXPECT_NEAR(white.mean(), 1, 4 * white.standard_error() + table);
            EXPECT_LT(white.standard_error(), 0.01);
            EXPECT_LT(dim.mean(), 1 + table + 4 * dim.standard_error());
        }
    }
}

TEST(ReferenceBsdf, ThinFilmsStayWithinEnergy) {
    Random random(9);
    for (const double metallic : {0.0, 1.0}) {
        for (const double roughness : {0.0, 0.2, 0.8}) {
            for (const ThinFilm film : {ThinFilm{1, 400}, ThinFilm{1.3, 0}, ThinFilm{1.3, 300}, ThinFilm{2, 900},
                                        ThinFilm{20, 200}, ThinFilm{1.5, 1e6}}) {
                for (const double mu : {0.05, 0.4, 0.95}) {
                    const BsdfParameters p{
                        .metallic = metallic, .roughness = roughness, .iridescence = 1, .film = film};
                    const Bsdf bsdf(p, direction_at(mu), kUp, kUp, kUp);
                    dvec3 sum(0);
                    for (int i = 0; i < 4000; ++i) {
                        const double u = random.uniform(), u1 = random.uniform(), u2 = random.uniform();
                        if (const auto sample = bsdf.sample(u, u1, u2)) sum += sample->weight / 4000.0;
                    }
                    const double largest = std::max({sum.x, sum.y, sum.z});
                    EXPECT_LT(largest, 1.05)
                        << metallic << ' ' << roughness << ' ' << film.ior << ' ' << film.thickness << ' ' << mu;
                    EXPECT_GT(largest, 0.5);
                }
            }
        }
    }
}

TEST(ReferenceThinFilm, LimitsAreKnown) {
    for (const double x : {0.0, 0.1, 0.5, 1.0}) {
        const dvec3 f0(0.04, 0.3, 0.9), bare = f0 + (1.0 - f0) * schlick(x);
        EXPECT_LT(length(thin_film_reflectance({2, 0}, f0, x) - bare), 1e-9) << "no film";
        EXPECT_LT(length(thin_film_reflectance({1, 500}, f0, x) - bare), 1e-9) << "a film of air";
        const dvec3 white = thin_film_reflectance({1.4, 350}, dvec3(1), x);
        EXPECT_LT(length(white - dvec3(1)), 1e-3) << "all light returns";
        // Thick films show no interference: the sum of all reflections without phases.
        const double r0 = std::pow(0.4 / 2.4, 2), r12 = r0 + (1 - r0) * schlick(x);
        const double cosine = std::sqrt(1 - (1 - x * x) / (1.4 * 1.4)), r1 = std::pow((1.5 - 1.4) / 2.9, 2);
        const double r23 = r1 + (1 - r1) * schlick(cosine), all = r12 + (1 - r12) * (1 - r12) * r23 / (1 - r12 * r23);
        EXPECT_NEAR(thin_film_reflectance({1.4, 1e6}, dvec3(0.04), x).y, all, 1e-6);
    }
    // A soap film's first order at normal incidence: half a wave plus the turn of the first reflection adds up in the
    // green at a path difference of 550 nm / 2.
    const double path = 550 / 2.0, thickness = path / (2 * 1.33);
    EXPECT_GT(thin_film_reflectance({1.33, thickness}, dvec3(0), 1).y, 3 * std::pow(0.33 / 2.33, 2));
    EXPECT_LT(thin_film_reflectance({1.33, 2 * thickness}, dvec3(0), 1).y, 0.5 * std::pow(0.33 / 2.33, 2));
}

/// Compares a histogram of one component's sampled directions with the integral of the density from evaluate(). Over
/// 300 cells, an rms difference of 6 % of the density is found with a probability of 99 %, at an error rate of 1e-4.
void test_sampling(const Bsdf& bsdf, Component component, Random& random, const std::string& name) {
    constexpr int kRows = 20, kColumns = 24, kSub = 8, kSamples = 40000;
    const auto pdf = [&](double z, double phi) {
        const Bsdf::Value value = bsdf.evaluate(direction_at(z, phi));
        return component == Component::diffuse ? value.pdf_diffuse : value.pdf_glossy;
    };
    std::vector<double> expected(kRows * kColumns), counted(kRows * kColumns);
    const double dz = 2.0 / kRows, dphi = 2 * kPi / kColumns;
    for (int j = 0; j < kRows; ++j) {
        for (int i = 0; i < kColumns; ++i) {
            double sum = 0;
            for (int k = 0; k < kSub * kSub; ++k) {
                sum += pdf(-1 + (j + (k / kSub + 0.5) / kSub) * dz, (i + (k % kSub + 0.5) / kSub) * dphi);
            }
            expected[j * kColumns + i] = sum * dz * dphi / (kSub * kSub) * kSamples;
        }
    }
    for (int n = 0; n < kSamples; ++n) {
        const double u = random.uniform(), u1 = random.uniform(), u2 = random.uniform();
        const auto s = bsdf.sample(u, u1, u2);
        if (!s || s->mirror || s->component != component) continue;
        const Bsdf::Value value = bsdf.evaluate(s->wi);
        const dvec3 f = component == Component::diffuse ? value.diffuse : value.glossy;
        ASSERT_NEAR(s->weight.x * s->pdf, f.x, 1e-9 * f.x) << name;
        const double phi = std::atan2(s->wi.y, s->wi.x);
        const int j = std::min(static_cast<int>((s->wi.z + 1) / dz), kRows - 1);
        const int i = std::min(static_cast<int>((phi < 0 ? phi + 2 * kPi : phi) / dphi), kColumns - 1);
        ++counted[j * kColumns + i];
    }
    double chi_square = 0, cells = 0, rest_expected = 0, rest_counted = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] < 10) {
            rest_expected += expected[i], rest_counted += counted[i];
            continue;
        }
        chi_square += std::pow(counted[i] - expected[i], 2) / expected[i];
        ++cells;
    }
    // The sheen's density has an edge at the horizon, which the sub-steps resolve coarsely.
    EXPECT_NEAR(rest_counted, rest_expected, 5 * std::sqrt(rest_expected) + 5e-4 * kSamples) << name;
    EXPECT_GT(cells, 10) << name;
    EXPECT_GT(test::chi_square_tail(chi_square, cells), 1e-4) << name << ": " << chi_square << " over " << cells;
}

/// Makes the direction of the brushing perpendicular to a normal.
BsdfParameters turned_to(const dvec3& n, BsdfParameters p) {
    if (p.anisotropy > 0) p.rough_direction = normalize(p.rough_direction - dot(p.rough_direction, n) * n);
    return p;
}

TEST(ReferenceBsdf, SamplesFollowTheirDensity) {
    const Case cases[] = {
        {"metal 0.4", {.roughness = 0.4}},
        {"metal 1", {.roughness = 1}},
        {"dielectric", {.metallic = 0, .roughness = 0.5}},
        {"transmission", {.metallic = 0, .roughness = 0.6, .transmission = 0.8}},
        {"coated", coated({.metallic = 0, .roughness = 0.8}, 1, 0.4)},
        {"coated metal", coated({.roughness = 0}, 1, 0.5)},
        {"sheen", with_sheen({.roughness = 0}, 1, 0.8)},
        {"solid", solid({.metallic = 0, .roughness = 0.6, .transmission = 0.8})},
        {"solid from inside", solid({.metallic = 0, .roughness = 0.5, .ior = 1.4, .transmission = 0.8}, false)},
        {"coated half solid", solid(coated({.metallic = 0.2, .roughness = 0.7, .transmission = 0.6}, 0.5, 0.5))},
        {"sheen over all",
         with_sheen(coated({.metallic = 0, .roughness = 0.4, .transmission = 0.5}, 0.5, 0.5), 0.8, 0.6)},
        {"brushed metal", brushed({.roughness = 0.4}, 0.7, 0.3)},
        {"brushed", brushed(coated({.metallic = 0, .roughness = 0.5, .transmission = 0.5}, 0.5, 0.5), 0.6, 2)},
        {"leaf", {.metallic = 0, .roughness = 0.5, .transmission = 0.4, .diffuse_transmission = 0.6}},
        {"candle", solid({.metallic = 0, .roughness = 0.5, .diffuse_transmission = 0.7}, false)},
        {"film", {.metallic = 0.5, .roughness = 0.5, .iridescence = 0.8}},
        {"brushed solid with a film",
         solid(brushed({.metallic = 0.2, .roughness = 0.5, .transmission = 0.6, .iridescence = 0.5}, 0.6, 2))},
    };
    Random random(5);
    // The normals differ from each other and from the geometric one, so that the side rules cut into the lobes.
    const dvec3 n = normalize(dvec3(0.3, 0.1, 1)), n_k = normalize(dvec3(-0.1, 0.2, 1));
    for (const Case& c : cases) {
        for (const double mu : {0.2, 0.9}) {
            const Bsdf straight(c.parameters, direction_at(mu, 1), kUp, kUp, kUp);
            const Bsdf tilted(turned_to(n, c.parameters), direction_at(mu, 1), kUp, n, n_k);
            test_sampling(straight, Component::glossy, random, c.name);
            test_sampling(tilted, Component::glossy, random, std::string("tilted ") + c.name);
            if (c.parameters.metallic < 1) test_sampling(tilted, Component::diffuse, random, c.name);
        }
        // The mirror direction of this view at the normal is below the horizon.
        const dvec3 away = direction_at(std::cos(0.17), 1 + kPi);
        const Bsdf bent(turned_to(away, c.parameters), direction_at(0.3, 1), kUp, away, away);
        test_sampling(bent, Component::glossy, random, std::string("bent ") + c.name);
    }
}

TEST(ReferenceBsdf, BlackWhereTheSidesOfNormalsDiffer) {
    const dvec3 n = normalize(dvec3(1, 0, 1)), wo = normalize(dvec3(0.5, 0.2, 1));
    const BsdfParameters everything{
        .metallic = 0.3, .roughness = 0.7, .clearcoat = 1, .clearcoat_roughness = 0.5, .transmission = 0.5};
    const Bsdf bsdf(everything, wo, kUp, n, n);
    for (const dvec3& wi :
         {normalize(dvec3(1, 0, -0.2)), normalize(dvec3(-1, 0, 0.2))}) {  // each normal sees one of them
        const Bsdf::Value value = bsdf.evaluate(wi);
        EXPECT_EQ(value.diffuse, dvec3(0));
        EXPECT_EQ(value.glossy, dvec3(0));
        EXPECT_EQ(value.pdf_diffuse + value.pdf_glossy, 0);
    }
    EXPECT_GT(bsdf.evaluate(normalize(dvec3(1, 0, 0.2))).diffuse.x, 0);
    EXPECT_GT(bsdf.evaluate(normalize(dvec3(-1, 0, -0.2))).glossy.x, 0);
    // The coat uses its own normal.
    const Bsdf coat(everything, wo, kUp, n, kUp);
    EXPECT_GT(coat.evaluate(normalize(dvec3(-1, 0, 0.2))).glossy.x, 0);
    EXPECT_EQ(coat.evaluate(normalize(dvec3(-1, 0, 0.2))).diffuse.x, 0);
}

TEST(ReferenceBsdf, DiffuseTransmissionSplitsTheBase) {
    // Without reflection, the base has all light: (1 - t) c on wo's side, t c_t on the other one.
    const dvec3 wo = direction_at(0.5), above = direction_at(0.6, 2), below = -direction_at(0.8, 1);
    for (const double through : {0.0, 0.3, 1.0}) {
        BsdfParameters p{.base_color = {0.2, 0.4, 0.6}, .metallic = 0, .specular = 0, .diffuse_transmission = through};
        p.diffuse_transmission_color = {0.9, 0.5, 0};
        const Bsdf bsdf(p, wo, kUp, kUp, kUp);
        EXPECT_LT(length(bsdf.evaluate(above).diffuse - (1 - through) * 0.6 / kPi * p.base_color), 1e-12);
        EXPECT_LT(length(bsdf.evaluate(below).diffuse - through * 0.8 / kPi * p.diffuse_transmission_color), 1e-12);
    }
    const BsdfParameters overridden{.metallic = 0, .transmission = 1, .diffuse_transmission = 1};
    EXPECT_EQ(Bsdf(overridden, wo, kUp, kUp, kUp).evaluate(below).diffuse, dvec3(0));
}

TEST(ReferenceBsdf, MirrorsReflectAndPassStraight) {
    const dvec3 wo = direction_at(0.6, 0.4);
    const Bsdf metal({.base_color = {0.9, 0.5, 0.2}, .roughness = 0}, wo, kUp, kUp, kUp);
    const auto reflected = metal.sample(0.5, 0.5, 0.5);
    ASSERT_TRUE(reflected && reflected->mirror);
    EXPECT_NEAR(length(reflected->wi - dvec3(-wo.x, -wo.y, wo.z)), 0, 1e-15);
    EXPECT_NEAR(reflected->weight.y, 0.5 + 0.5 * std::pow(0.4, 5), 1e-15);
    EXPECT_EQ(metal.evaluate(reflected->wi).glossy, dvec3(0));

    // A normal that would reflect below the horizon is bent.
    const Bsdf bent({.roughness = 0}, direction_at(0.3, 1), kUp, direction_at(std::cos(0.17), 1 + kPi), kUp);
    const auto above = bent.sample(0.5, 0.5, 0.5);
    ASSERT_TRUE(above && above->mirror);
    EXPECT_NEAR(above->wi.z, 0.01, 1e-12);
    EXPECT_NEAR(above->weight.x, 1, 1e-12);

    const Bsdf glass({.metallic = 0, .roughness = 0, .transmission = 1}, wo, kUp, kUp, kUp);
    const double f0 = 0.04, fresnel = f0 + (1 - f0) * std::pow(0.4, 5);
    int passed = 0;
    for (int i = 0; i < 1000; ++i) {
        const auto s = glass.sample((i + 0.5) / 1000, 0.5, 0.5);
        ASSERT_TRUE(s && s->mirror);
        EXPECT_NEAR(s->weight.x, 1, 1e-12);
        if (s->wi == -wo) ++passed;
    }
    EXPECT_NEAR(passed / 1000.0, 1 - fresnel, 1e-3);
}

}  // namespace
}  // namespace halflight::reference
