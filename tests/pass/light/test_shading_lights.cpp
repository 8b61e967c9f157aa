// Tests light sampling against analytic irradiance and solid angles, against its own densities, and against quadrature
// of the environment.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/tables/environment_warp.h"
#include "engine/tables/lights.h"
#include "tests/pass/light/density_check.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/pass/picture/pixels.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

const std::string kLibrary = std::string(R"(
#include "shaders/lib/lights.glsl"
#include "shaders/lib/surface.glsl"
const uint kTurns = 16384u;
const vec3 kTowardsAny = vec3(0.0);  // no light is behind a receiver of this normal, nor before it
LightSample sample_of(vec3 position, uint point, uint n) {
    Sampler s = make_sampler(point, 3u, n, 11u);
    return sample_light(receiver_at(position, kTowardsAny), sample_2d_bits(s, 1u));
}
)") + kMeetLibrary;

/// Returns a rectangle of two triangles in the plane z = 0 with corners (0,0) and (w,h).
Mesh rectangle(float width, float height) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {width, 0, 0}, {width, height, 0}, {0, height, 0}};
    mesh.normals.assign(4, vec3(0, 0, 1));
    mesh.uvs[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangle_material = {0, 0};
    return mesh;
}

Scene emitter_scene(const std::vector<dmat4>& placements, const vec3& emission, float width = 2, float height = 1) {
    Scene scene;
    scene.name = "emitters";
    scene.materials.resize(1);
    scene.materials[0].emission = emission;
    scene.meshes = {rectangle(width, height)};
    for (const dmat4& m : placements) {
        Instance instance;
        instance.mesh = 0;
        instance.object_to_world = m;
        scene.instances.push_back(instance);
    }
    return scene;
}

/// Returns the form factor from a surface element to a parallel rectangle a x b at distance 1. One corner is straight
/// above the element (Siegel and Howell, configuration 4).
double corner_form_factor(double a, double b) {
    const double p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
    return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi);
}

/// Returns the solid angle that a triangle subtends at the origin (Van Oosterom and Strackee 1983).
double solid_angle(const dvec3& a, const dvec3& b, const dvec3& c) {
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double denominator = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    return std::abs(2 * std::atan2(glm::dot(a, glm::cross(b, c)), denominator));
}

class ShadingLights : public GpuTest {
  protected:
    /// Returns the irradiance from `scene` on both sides of a surface in the plane z = const at each point.
    static std::vector<vec4> irradiances(const Scene& scene, const std::vector<dvec3>& points) {
        const ShadingScene shading(scene);
        std::vector<vec4> inputs;
        for (const dvec3& p : points) inputs.emplace_back(vec3(p - shading.trace.origin), 0);
        return shading.run(kLibrary, R"(
            vec3 sum = vec3(0.0);
            for (uint n = 0u; n < kTurns; ++n) {
                LightSample s = sample_of(inputs[i].xyz, i, n);
                sum += s.weight * abs(s.direction.z);
            }
            result[0] = vec4(sum / float(kTurns), 0.0);
        )",
                           static_cast<std::uint32_t>(points.size()), 1, inputs);
    }
};

TEST_F(ShadingLights, IrradianceFromASquareIsItsFormFactor) {
    std::vector<dvec3> points;
    std::vector<double> expected;
    for (const double h : {0.3, 1.0, 5.0}) {
        points.emplace_back(0, 0, -h);  // below a corner, at the back
        expected.push_back(corner_form_factor(1 / h, 1 / h));
        points.emplace_back(0.5, 0.5, h);  // above the centre
        expected.push_back(4 * corner_form_factor(0.5 / h, 0.5 / h));
    }
    const auto found = irradiances(emitter_scene({dmat4(1)}, vec3(3, 2, 1), 1, 1), points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double e = kPi * expected[i];
        EXPECT_NEAR(found[i].x / (3 * e), 1, 0.01) << i;  // few samples dominate close to the light
        EXPECT_NEAR(found[i].y / found[i].x, 2 / 3.0, 1e-5) << i;
    }
}

// Covers merged and shared emitters. Sample densities equal those of rays that hit the light, and the samples cover the
// solid angle exactly once. No light blocks its own shadow rays.
TEST_F(ShadingLights, DensitiesAndShadowRays) {
    const std::pair<int, LightChoice> cases[] = {
        {1, LightChoice::power}, {3, LightChoice::power}, {1, LightChoice::tree}, {3, LightChoice::tree}};
    for (const auto& [copies, choice] : cases) {
        SCOPED_TRACE(name(choice));
        std::vector<dmat4> placements;
        for (int i = 0; i < copies; ++i) {
            const dmat4 turned = glm::rotate(glm::translate(dmat4(1), dvec3(3 * i, 0.3, 2)), 0.5 + i, dvec3(1, 2, 3));
            placements.push_back(glm::scale(turned, dvec3(i == 1 ? -1 : 1, 0.5 + i, 1)));
        }
        Scene scene = emitter_scene(placements, vec3(1));
        const ShadingScene shading(scene, choice);
        std::mt19937 random(3);
        const auto uniform = [&](double low, double high) { return low + (high - low) * random() * 0x1p-32; };
        const dvec3 middle(shading.trace.bounds.centre());
        std::vector<vec4> points;
        std::vector<double> expected;
        for (int i = 0; i < 24; ++i) {
            const dvec3 p = middle + dvec3(uniform(-2, 2), uniform(-4, -1), uniform(-3, 1));
            points.emplace_back(vec3(p), 0);
            double sum = 0;
            for (const dmat4& m : placements) {
                std::array<dvec3, 4> corner;
                for (std::size_t k = 0; k < 4; ++k) {
                    corner[k] =
                        dvec3(m * dvec4(scene.meshes[0].positions[k], 1)) - shading.trace.origin - dvec3(points.back());
                }
                sum += solid_angle(corner[0], corner[1], corner[2]) + solid_angle(corner[0], corner[2], corner[3]);
            }
            expected.push_back(sum);
        }
        const auto found =
            shading.run(kLibrary,
                        std::string("const bool kTree = ") + (choice == LightChoice::tree ? "true" : "false") +
                            "; const uint kInstances = " + std::to_string(copies) + R"(u;
            float sum = 0.0;
            float worst = 0.0;
            float stopped = 0.0;
            float unmatched = 0.0;
            for (uint n = 0u; n < 4096u; ++n) {
                vec3 p = inputs[i].xyz;
                LightSample s = sample_of(p, i, n);
                sum += s.pdf > 0.0 ? 1.0 / s.pdf : 0.0;
                if (n < 1024u) {  // llvmpipe grants 65535 turns to all loops of an invocation together
                    // The ray goes on beyond the light, so it meets it; others may be nearer.
                    Ray ray = shadow_ray(p, 1e-6, vec3(0.0, 0.0, 1.0), s);
                    Hit hit = Hit(1e30, 0.0, 0.0, kMiss, 0u);
                    for (uint k = 0u; k < kInstances; ++k) meet(ray, k, 0u, 2u, hit);
                    // One that is met just before its end is met although it is the target.
                    stopped += hit.t < ray.t_max && hit.t > 0.999 ? 1.0 : 0.0;
                    // At the edge between two triangles either may be met, and a tree picks them with other densities.
                    bool on_edge = kTree && min(min(hit.u, hit.v), 1.0 - hit.u - hit.v) < 1e-4;
                    if (hit.triangle != kMiss && hit.t >= ray.t_max && hit.t < 1.001 && !on_edge) {
                        Surface surface = surface_at(hit, ray.direction);
                        float far = distance(p, surface.position);
                        float pdf = light_pdf(receiver_at(p, kTowardsAny), hit, s.direction, far, surface.geometric_normal);
                        worst = max(worst, abs(pdf / s.pdf - 1.0));
                    } else {
                        unmatched += hit.t > 0.999 && !on_edge ? 1.0 : 0.0;
                    }
                }
            }
            result[0] = vec4(sum / 4096.0, worst, stopped, unmatched);
        )",
                        static_cast<std::uint32_t>(points.size()), 1, points);
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_NEAR(found[i].x / expected[i], 1, 0.02) << copies << ' ' << i;
            EXPECT_LT(found[i].y, 1e-3f) << copies << ' ' << i;
            EXPECT_EQ(found[i].z, 0) << copies << ' ' << i;
            EXPECT_LT(found[i].w, 3) << copies << ' ' << i;  // rays may hit edges
        }
    }
}

// Receivers are near and far, at all angles, on scales from 1e-4 to 1e4.
TEST_F(ShadingLights, NoLightShadowsItself) {
    for (const double scale : {1e-4, 1.0, 1e4}) {
        for (const int copies : {1, 2}) {
            std::vector<dmat4> placements;
            for (int i = 0; i < copies; ++i) {
                const dmat4 moved = glm::translate(dmat4(1), scale * dvec3(40 * i, 0.3, 2));
                placements.push_back(glm::scale(glm::rotate(moved, 0.7, dvec3(1, 2, 3)), scale * dvec3(1, 0.2, 3)));
            }
            const ShadingScene shading(emitter_scene(placements, vec3(1)));
            const auto found = shading.run(kLibrary, R"(
                float scale = inputs[0].x;
                float stopped = 0.0;
                float considered = 0.0;
                for (uint n = 0u; n < 256u; ++n) {
                    Sampler r = make_sampler(i, 5u, n, 2u);
                    // On the light's own plane at times: as flat as rays can be.
                    vec3 p = scale * exp2(-10.0 + 16.0 * sample_1d(r, 3u)) *
                             sphere_direction(2.0 * sample_2d(r, 2u).x - 1.0, sample_2d(r, 2u).y);
                    LightSample s = sample_of(p, i, n);
                    if (s.pdf == 0.0) continue;
                    Ray ray = shadow_ray(p, 1e-7 * length(p), vec3(0.0, 0.0, 1.0), s);
                    Hit hit = Hit(ray.t_max, 0.0, 0.0, kMiss, 0u);
                    for (uint k = 0u; k < uint(inputs[0].y); ++k) meet(ray, k, 0u, 2u, hit);
                    considered += 1.0;
                    stopped += hit.triangle != kMiss && hit.t > 0.99 ? 1.0 : 0.0;
                }
                result[0] = vec4(stopped, considered, 0.0, 0.0);
            )",
                                           1024, 1, {vec4(scale, copies, 0, 0)});
            double stopped = 0, considered = 0;
            for (const vec4& r : found) stopped += r.x, considered += r.y;
            EXPECT_EQ(stopped, 0) << scale << ' ' << copies;
            EXPECT_GT(considered, 0.9 * 256 * 1024);
        }
    }
}

TEST_F(ShadingLights, PunctualLights) {
    Scene scene = triangle_scene({});
    PunctualLight point{
        .name = "point", .type = LightType::point, .intensity = vec3(4, 5, 6), .position = dvec3(1, 2, 3)};
    PunctualLight spot = point;
    spot.type = LightType::spot;
    spot.direction = glm::normalize(vec3(0, -1, -1));
    spot.inner_cone = 0.2f;
    spot.outer_cone = 0.9f;
    PunctualLight sun = point;
    sun.type = LightType::directional;
    sun.direction = glm::normalize(vec3(1, -2, 0.5f));
    scene.lights = {point, spot, sun};
    const ShadingScene shading(scene);
    const std::vector<vec4> points = {vec4(0.1f, 0.2f, 0.3f, 0), vec4(1, 1, 0, 0), vec4(-2, 4, 1, 0)};
    const auto found = shading.run(kLibrary, R"(
        vec3 sum = vec3(0.0);
        vec3 towards = vec3(0.0);
        float wrong = 0.0;
        for (uint n = 0u; n < kTurns; ++n) {
            LightSample s = sample_of(inputs[i].xyz, i, n);
            sum += s.weight;
            towards += s.weight.x * s.direction;
            wrong += s.pdf != 0.0 || abs(length(s.direction) - 1.0) > 1e-6 ? 1.0 : 0.0;
            Ray ray = shadow_ray(inputs[i].xyz, 0.0, vec3(0.0, 0.0, 1.0), s);
            wrong += s.at_infinity != isinf(ray.t_max) ? 1.0 : 0.0;
        }
        result[0] = vec4(sum / float(kTurns), wrong);
        result[1] = vec4(towards / float(kTurns), 0.0);
    )",
                                   3, 2, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const dvec3 to_light = point.position - shading.trace.origin - dvec3(points[i]);
        const double square = glm::dot(to_light, to_light);
        const double angle = glm::dot(-glm::normalize(to_light), dvec3(spot.direction));
        const double cone = std::clamp((angle - std::cos(0.9)) / (std::cos(0.2) - std::cos(0.9)), 0.0, 1.0);
        const double expected = (1 + cone * cone) / square + 1;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[2 * i][k] / (point.intensity[k] * expected), 1, 2e-3);
        EXPECT_EQ(found[2 * i].w, 0);
        const dvec3 towards = 4.0 * ((1 + cone * cone) / square * glm::normalize(to_light) - dvec3(sun.direction));
        EXPECT_NEAR(glm::length(dvec3(found[2 * i + 1]) - towards), 0, 2e-3 * glm::length(towards) + 1e-3);
    }
}

// The texture is black on most of the light, and a mask removes a part of it.
TEST_F(ShadingLights, EmissionTexturesAndAlpha) {
    Scene scene = emitter_scene({dmat4(1)}, vec3(2), 1, 1);
    TextureImage image{"t", 8, 8, {}};
    for (int i = 0; i < 64; ++i) {
        const std::uint8_t value = i % 8 < 3 ? 255 : 0, alpha = i / 8 < 4 ? 255 : 0;
        image.rgba.edit().insert(image.rgba.edit().end(), {value, value, value, alpha});
    }
    scene.images = {image};
    Material& m = scene.materials[0];
    m.base_color_texture = m.emission_texture = {
        .image = 0, .wrap_u = Wrap::clamp_to_edge, .wrap_v = Wrap::clamp_to_edge, .nearest = true};
    m.alpha_mode = AlphaMode::mask;
    const auto found = irradiances(scene, {dvec3(0, 0, 0.5)});
    // The corner from (0,0) to (3/8, 1/2) remains, and the point is above that corner.
    EXPECT_NEAR(found[0].x / (2 * kPi * corner_form_factor(0.75, 1)), 1, 0.01);
}

Image test_map(int width, int height) {
    Image map(width, height, 3);
    std::mt19937 random(5);
    for (const auto& [x, y] : test::pixels_of({width, height})) {
        const bool black = x < width / 3 && y > height / 2;
        const bool sun = x == width / 2 && y == height / 4;
        for (int k = 0; k < 3; ++k) map.at(x, y)[k] = black ? 0 : sun ? 900.0f : float(random() % 100) / 50 + 0.1f;
    }
    return map;
}

/// Returns the radiance of the environment in double precision, by its definition in engine/scene/scene.h.
dvec3 radiance(const Image& map, const dvec3& d) {
    const double u = std::atan2(d.z, d.x) / (2 * kPi) + 0.5, v = std::acos(std::clamp(d.y, -1.0, 1.0)) / kPi;
    const dvec2 at = dvec2(u * map.width, v * map.height) - 0.5;
    const dvec2 cell = glm::floor(at), f = at - cell;
    dvec3 sum(0);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int x = (static_cast<int>(cell.x) + i + map.width) % map.width;
            const int y = std::clamp(static_cast<int>(cell.y) + j, 0, map.height - 1);
            const float* texel = map.at(x, y);
            sum += (i == 0 ? 1 - f.x : f.x) * (j == 0 ? 1 - f.y : f.y) * dvec3(texel[0], texel[1], texel[2]);
        }
    }
    return sum;
}

TEST_F(ShadingLights, EnvironmentIsBilinear) {
    Scene scene = triangle_scene({});
    scene.environment.color = vec3(1, 0.5f, 2);
    scene.environment.map = test_map(23, 11);
    const ShadingScene shading(scene);
    std::mt19937 random(9);
    std::vector<vec4> directions = {{0, 1, 0, 0},  {0, -1, 0, 0},      {1, 0, 0, 0},
                                    {-1, 0, 0, 0}, {-1, 0, -1e-9f, 0}, {0, 0, 1, 0}};
    while (directions.size() < 4096) {
        const dvec3 d = dvec3(random(), random(), random()) * 0x1p-31 - 1.0;
        directions.emplace_back(vec3(glm::normalize(d)), 0);
    }
    const auto found = shading.run("#include \"shaders/lib/environment.glsl\"",
                                   "result[0] = vec4(environment_radiance(inputs[i].xyz), 0.0);", 4096, 1, directions);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const dvec3 expected = radiance(scene.environment.map, dvec3(directions[i])) * dvec3(1, 0.5, 2);
        // u and v have errors of about 1e-7 of the map's 23 texels; its slopes are up to 2 * 900 per texel.
        EXPECT_NEAR(glm::length(dvec3(found[i]) - expected), 0, 0.02) << i;
    }
}

// Owen-scrambled Sobol points stay stratified on the map: the mean of 64 points has a much smaller variance than that
// of independent points.
TEST_F(ShadingLights, EnvironmentSamplesStayStratified) {
    Scene scene = triangle_scene({});
    scene.environment.color = vec3(1);
    scene.environment.map = test_map(64, 32);
    const ShadingScene shading(scene);
    ASSERT_TRUE(shading.tables.needs.environment_map);
    constexpr std::uint32_t kSets = 4096;
    const auto found = shading.run(kLibrary, R"(
        vec3 means[2] = vec3[2](vec3(0.0), vec3(0.0));
        for (uint n = 0u; n < 64u; ++n) {
            uint seed = hash_combine(hash_u32(i), n);
            vec2 points[2] = vec2[2](sample_2d(make_sampler(i, 3u, n, 11u), 1u),
                                     vec2(unit_float(hash_combine(seed, 1u)), unit_float(hash_combine(seed, 2u))));
            for (int k = 0; k < 2; ++k) means[k] += sample_environment(kTowardsAny, points[k]).direction / 64.0;
        }
        result[0] = vec4(means[0], 0.0);
        result[1] = vec4(means[1], 0.0);
    )",
                                   kSets, 2);
    for (int axis = 0; axis < 3; ++axis) {
        std::array<double, 2> sum{}, squares{};
        for (std::size_t i = 0; i < found.size(); ++i) {
            sum[i % 2] += found[i][axis];
            squares[i % 2] += double(found[i][axis]) * found[i][axis];
        }
        std::array<double, 2> variance;
        for (std::size_t k = 0; k < 2; ++k) variance[k] = squares[k] / kSets - sum[k] / kSets * (sum[k] / kSets);
        EXPECT_LT(variance[0], 0.1 * variance[1]) << axis;  // an alias table of the cells leaves 0.3 to 0.9
    }
}

// Radiance over density is the estimate of the map's integral. In cells of one texel, it is the integral times the sine
// of the polar angle over the mean sine of the row. In larger cells, only its mean is the integral.
TEST_F(ShadingLights, EnvironmentSamplesFollowTheLuminance) {
    for (const ivec2 size : {ivec2(64, 32), ivec2(2100, 1050)}) {
        SCOPED_TRACE(size.x);
        Scene scene = triangle_scene({});
        scene.environment.color = vec3(1);
        scene.environment.map = test_map(size.x, size.y);
        const EnvironmentCells cells = environment_cells(scene.environment.map);
        const bool are_texels = cells.columns == size.x;
        EXPECT_EQ(are_texels, size.x == 64);
        const ShadingScene shading(scene);
        constexpr std::uint32_t kSamples = 1u << 14;
        const auto found = shading.run(kLibrary, R"(
            uint seed = hash_combine(hash_u32(i), 5u);
            vec2 point = vec2(unit_float(hash_combine(seed, 1u)), unit_float(hash_combine(seed, 2u)));
            EnvironmentSample s = sample_environment(kTowardsAny, point);
            result[0] = vec4(luminance_of(s.radiance), s.density, s.direction.y, length(s.direction.xz));
        )",
                                       kSamples, 1);
        double sum = 0;
        for (const vec4& r : found) {
            ASSERT_GT(r.y, 0);
            const double estimate = r.x / r.y / cells.integral;
            sum += estimate;
            if (!are_texels) continue;
            const double row = kPi / size.y, place = std::atan2(double(r.w), double(r.z)) / row;
            if (std::abs(place - std::round(place)) < 1e-4) continue;  // rounding may lead to the row beyond the border
            const double top = row * std::floor(place), mean_sine = (std::cos(top) - std::cos(top + row)) / row;
            EXPECT_NEAR(estimate * mean_sine / double(r.w), 1, 1e-4) << r.z;
        }
        EXPECT_NEAR(sum / kSamples, 1, 0.02);
    }
}

/// The samples suffice to show a density that is 5 % off over half of the map, which shifts chi-square by about 300,
/// nine standard deviations.
TEST_F(ShadingLights, EnvironmentSamplesFollowTheirDensity) {
    constexpr std::uint32_t kSamples = 1u << 17;
    constexpr int kColumns = 36, kRows = 18, kSub = 8, kGrid = kColumns * kRows * kSub * kSub;
    const std::vector<vec3> normals = {vec3(0), {0, 1, 0}, glm::normalize(vec3(-1, 0.2f, 2))};  // 0: towards any
    std::vector<vec4> inputs;
    std::vector<double> solid_angles;
    for (const vec3& n : normals) inputs.emplace_back(n, 0);
    for (int i = 0; i < kGrid; ++i) {
        const int y = i / (kColumns * kSub), x = i % (kColumns * kSub);
        const double step = kPi / (kRows * kSub), theta = step * (y + 0.5),
                     phi = 2 * kPi * ((x + 0.5) / (kColumns * kSub) - 0.5);
        inputs.emplace_back(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi), 0);
        solid_angles.push_back(2 * kPi / (kColumns * kSub) * (std::cos(step * y) - std::cos(step * (y + 1))));
    }
    for (const bool constant : {false, true}) {
        Scene scene = triangle_scene({});
        scene.environment.color = vec3(1, 0.5f, 2);
        if (!constant) scene.environment.map = test_map(kColumns, kRows);
        PunctualLight& sun = scene.lights.emplace_back();  // gives the selection an alternative to the sky
        sun.type = LightType::directional;
        sun.intensity = vec3(5);
        const ShadingScene shading(scene);
        const double share = shading.tables.environment_warp[0].z;
        EXPECT_GT(share, 0.2);
        EXPECT_LT(share, 0.9);
        const auto samples = shading.run(kLibrary, R"(
            // Chi-square needs independent numbers.
            uint seed = hash_combine(hash_u32(i), 77u);
            SampleBits bits = SampleBits(hash_combine(seed, 1u), hash_combine(seed, 2u));
            Receiver at = receiver_at(vec3(0.0), inputs[i >> 17].xyz);
            LightSample s = sample_light(at, bits);
            result[0] = vec4(s.direction, s.pdf);
            result[1] = vec4(s.weight * s.pdf - environment_radiance(s.direction), environment_pdf(at, s.direction));
            result[2] = vec4(s.weight, luminance_of(environment_radiance(s.direction)));
        )",
                                         kSamples * 3, 3, inputs);
        const auto densities = shading.run(kLibrary, "const uint kGrid = " + std::to_string(kGrid) + R"(u;
            vec3 d = inputs[i % kGrid + 3u].xyz;
            Receiver at = receiver_at(vec3(0.0), inputs[i / kGrid].xyz);
            result[0] = vec4(environment_radiance(d), environment_pdf(at, d));
        )",
                                           3 * kGrid, 1, inputs);
        for (std::size_t k = 0; k < normals.size(); ++k) {
            SCOPED_TRACE(fmt::format("{}, normal {}", constant, k));
            const auto received = [&](const vec3& d) {
                return k == 0 ? 1.0 : std::max(0.0, double(glm::dot(normals[k], d)));
            };
            std::vector<double> expected(kColumns * kRows), found(kColumns * kRows);
            dvec3 integral(0), mean(0);
            double dark = 0, inconsistent = 0, picked = 0, sum = 0;
            for (std::size_t i = 0; i < kGrid; ++i) {
                const vec4& density = densities[k * kGrid + i];
                const double light = received(vec3(inputs[i + 3]));
                const std::size_t y = i / (kColumns * kSub) / kSub, x = i % (kColumns * kSub) / kSub;
                expected[y * kColumns + x] += kSamples * density.w * solid_angles[i];
                sum += density.w * solid_angles[i];
                integral += solid_angles[i] * light * dvec3(density);
                EXPECT_TRUE(density.w > 0 || light == 0 || vec3(density) == vec3(0));
                dark += density.w == 0 ? 1 : 0;
            }
            EXPECT_EQ(dark > 1000, !constant);
            EXPECT_NEAR(sum, share, 1e-3);
            for (std::size_t i = 0; i < kSamples; ++i) {
                const vec4* r = &samples[3 * (k * kSamples + i)];
                if (r[0].w == 0) continue;
                ++picked;
                mean += received(vec3(r[0])) * dvec3(r[2]) / double(kSamples);
                // A round trip through sine and arc moves the direction a little, and at the borders to another cell.
                // So densities are compared per luminance of each direction, which they follow within a cell.
                const double per_luminance = r[1].w / r[2].w * double(luminance(vec3(r[2])));
                const bool same = std::abs(per_luminance - 1) <= 1e-4;
                inconsistent += same && glm::length(vec3(r[1])) <= 1e-2 * (1 + r[0].w * r[2].y) ? 0 : 1;
                const double u = std::atan2(r[0].z, r[0].x) / (2 * kPi) + 0.5, v = std::acos(r[0].y) / kPi;
                const int x = std::clamp(static_cast<int>(u * kColumns), 0, kColumns - 1),
                          y = std::clamp(static_cast<int>(v * kRows), 0, kRows - 1);
                ++found[static_cast<std::size_t>(y * kColumns + x)];
            }
            EXPECT_LT(inconsistent, 2e-4 * kSamples);
            EXPECT_NEAR(picked / kSamples, share, 5e-3);
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c] / integral[c], 1, 0.02);
            EXPECT_GT(test::chi_square(found, expected, 5).p_value(), 1e-6);
        }
    }
}

}  // namespace
}  // namespace halflight
