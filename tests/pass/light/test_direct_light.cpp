// Tests the direct light of a whole scene against the oracle, sample by sample. The oracle's formulas and Embree
// evaluate the same points in pixels, light samples and directions. Such pairs have almost no noise. Independent
// samples would have to be 10^8 to show the same shift of the mean.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "engine/io/gltf/gltf.h"
#include "engine/reference/path.h"
#include "engine/tables/lights.h"
#include "passes/light/first_scatter.h"
#include "passes/light/shadow.h"
#include "passes/surface/gbuffer.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/sobol.h"
#include "shaders/shared/word.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

double mean(const dvec3& c) {
    return (c.x + c.y + c.z) / 3;
}
/// Returns the power heuristic (Veach 1997, eq. 9.13, beta = 2).
double power_heuristic(double a, double b) {
    return a > 0 ? 1 / (1 + (b / a) * (b / a)) : 0;
}

/// Light of the scene: a sun, or a sky of one colour.
struct Light {
    dvec3 direction{0};  // unit length, towards the light
    dvec3 radiance{0};   // sky: radiance over density; sun: irradiance over probability
    double density = 0;  // 0 for a sun
    double weight(double surface) const { return density > 0 ? power_heuristic(density, surface) : 1; }
};

class SunAndSky {
  public:
    SunAndSky(const Scene& scene, const TraceTables& trace)
        : scene_(scene), tables_(build_lights(scene, trace, LightChoice::power)) {}

    /// Selects a sun or the sky, and a direction.
    Light sample(const shared::Sampler& random) const {
        const shared::SampleBits bits = shared::sample_2d_bits(random, 1);
        const auto count = static_cast<std::uint32_t>(tables_.alias.size());
        const std::uint64_t scaled = std::uint64_t{bits.x} * count;
        const vec2 alias = tables_.alias[scaled >> 32];
        const float u = shared::unit_float(static_cast<std::uint32_t>(scaled));
        const bool keep = u < alias.x;
        const std::size_t chosen = keep ? scaled >> 32 : shared::word_of_float(alias.y);
        if (chosen < scene_.lights.size()) {
            const PunctualLight& sun = scene_.lights[chosen];
            return {-glm::normalize(dvec3(sun.direction)), dvec3(sun.intensity) / tables_.probabilities[chosen], 0};
        }
        const float low = keep ? 0 : alias.x;
        const std::uint32_t rest = shared::left_of_choice(bits.x, count, u, low, keep ? alias.x : 1 - alias.x);
        const double y = 1 - 2 * double(shared::unit_float(bits.y)), r = std::sqrt(1 - y * y),
                     phi = 2 * kPi * double(shared::unit_float(rest));
        return {
            {r * std::cos(phi), r * std::sin(phi), y}, dvec3(scene_.environment.color) / sky_density(), sky_density()};
    }
    double sky_density() const { return tables_.probabilities.back() / (4 * kPi); }

  private:
    const Scene& scene_;
    LightTables tables_;
};

/// Sums of one technique over all pairs.
struct Pairs {
    double oracle = 0;                        // sum over all pairs
    double ours_alike = 0, oracle_alike = 0;  // sums over pairs that agree on visibility
    int count = 0, hidden_from_one = 0;

    void add(double a, double b) {
        ++count;
        oracle += b;
        if ((a > 0) != (b > 0)) {
            ++hidden_from_one;
        } else {
            ours_alike += a, oracle_alike += b;
        }
    }
};

class DirectLightTest : public PassTest {
  protected:
    struct Sample {
        std::vector<shared::Hit> hits;
        std::vector<SurfaceRecord> surfaces;
        std::vector<shared::DirectLight> light;
        std::vector<shared::uint> occluded;
        std::vector<shared::Ray> rays;  // rays that leave the surfaces
        std::vector<shared::Hit> met;
        std::vector<shared::PathState> states;
    };
    Sample trace(Stage& stage) {
        graph::Graph graph;
        const SceneView view = stage.view(graph);
        const SceneNeeds& needs = stage.buffers().needs();
        const GBuffer g = add_gbuffer(graph, view);
        const DirectLightEstimate direct = add_shadow(graph, view, g);
        PathBuffers paths = create_path_buffers(graph, view);
        if (needs.diffuse) add_diffuse(graph, view, g, paths);
        if (needs.glossy) add_glossy(graph, view, g, paths);
        for (const graph::BufferHandle h :
             {g.hits, g.surfaces, direct.light, direct.occluded, paths.rays, paths.hits, paths.states})
            graph.output(h);
        run(graph);
        return {executor.read<shared::Hit>(g.hits),
                unpack_surfaces(executor.read<vec4>(g.surfaces), needs),
                executor.read<shared::DirectLight>(direct.light),
                executor.read<shared::uint>(direct.occluded),
                executor.read<shared::Ray>(paths.rays),
                executor.read<shared::Hit>(paths.hits),
                executor.read<shared::PathState>(paths.states)};
    }
};

TEST_F(DirectLightTest, EqualsTheOracleSampleBySample) {
    const Scene scene = load_gltf(std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/atrium.glb");
    const Camera& camera = scene.cameras[0];
    const ivec2 image(320, 240);
    Stage stage(programs, scene, camera, image, LightChoice::power);
    const ReferenceScene reference(scene);
    const reference::Prepared& oracle = reference.prepared();
    const SunAndSky lights(scene, stage.trace_tables());
    const dvec3 sky(scene.environment.color);
    const double tangent = std::tan(camera.vertical_fov / 2);

    std::map<std::string, Pairs> pairs;
    int seen = 0, otherwise = 0;
    double ours = 0, expected = 0;
    for (std::uint32_t sample = 0; sample < 2; ++sample) {
        stage.select_sample(sample, 2);
        const dvec2 jitter(stage.frame().jitter);
        const Sample s = trace(stage);
        for (const auto& [x, y] : pixels_of(image)) {
            const std::size_t path = stage.path(x, y);
            const dvec3 along(((2 * (x + jitter.x) / image.x - 1) * tangent * image.x) / image.y,
                              (1 - 2 * (y + jitter.y) / image.y) * tangent, -1);
            ReferenceRay ray;
            ray.origin = dvec3(camera.camera_to_world[3]) - oracle.tracer.origin();
            ray.direction = dmat3(camera.camera_to_world) * along;
            const std::optional<ReferenceHit> hit = oracle.tracer.closest_hit(ray, {});
            std::optional<reference::Surface> surface;
            if (hit) surface = reference::make_surface(oracle.tracer, *hit, -glm::normalize(ray.direction));
            const SurfaceRecord& record = s.surfaces[path];
            const TriangleSource source =
                record.is_surface ? source_of(stage.trace_tables(), s.hits[path].instance, s.hits[path].triangle)
                                  : TriangleSource{};
            const bool same =
                record.is_surface == surface.has_value() &&
                (!surface || surface->triangle == reference::TriangleId{int(source.instance), int(source.triangle)});
            ++seen;
            otherwise += !same;

            const auto visible = [&](const dvec3& w) { return !oracle.tracer.occluded({surface->leave(w), w}, {}); };
            std::optional<reference::Bsdf> bsdf;
            if (surface) bsdf.emplace(surface->parameters, surface->wo, surface->n_g, surface->n, surface->n_k);
            const auto compare = [&](const std::string& technique, double a, double b) {
                ours += a, expected += b;
                if (same && surface) pairs[technique].add(a, b);
            };

            const shared::Sampler random = shared::make_sampler(x, y, sample, stage.frame().seed);
            const Light light = lights.sample(random);
            double sampled = 0;
            if (bsdf) {
                const reference::Bsdf::Value v = bsdf->evaluate(light.direction);
                sampled = mean(light.radiance *
                               (v.diffuse * light.weight(v.pdf_diffuse) + v.glossy * light.weight(v.pdf_glossy)));
                if (sampled > 0 && !visible(light.direction)) sampled = 0;
            }
            const double lit = mean(dvec3(s.light[path].diffuse + s.light[path].glossy));
            compare(light.density > 0 ? "sky" : "sun", lit > 0 && s.occluded[path] == shared::kFree ? lit : 0, sampled);

            const shared::PathState& state = s.states[path];
            if (!record.is_surface || state.lobe == shared::kLobeNone) continue;
            const bool diffuse = state.lobe == shared::kLobeDiffuse;
            const auto weight = [&](double pdf) { return pdf > 0 ? power_heuristic(pdf, lights.sky_density()) : 1; };
            const bool missed = s.met[path].triangle == shared::kMiss;
            double met = 0;
            const dvec3 w = glm::normalize(dvec3(s.rays[path].direction));
            if (bsdf) {
                const reference::Bsdf::Value v = bsdf->evaluate(w);
                const double pdf = diffuse ? v.pdf_diffuse : v.pdf_glossy;
                if (pdf > 0 && visible(w)) met = mean((diffuse ? v.diffuse : v.glossy) / pdf * sky) * weight(pdf);
            }
            compare(diffuse ? "sky by diffuse rays" : "sky by glossy rays",
                    missed ? mean(dvec3(state.throughput) * sky) * weight(state.pdf) : 0, met);
        }
    }
    // Another triangle is hit by 0.047 % of the samples at this pixel size (gbuffer.h). If only the pixel's own
    // triangle were tested, 0.11 % would.
    EXPECT_LT(otherwise, seen * 0.0008);
    EXPECT_GT(otherwise, 0) << "no edges in view: these are not the requested pixels";
    ASSERT_EQ(pairs.size(), 4u);
    for (const auto& [technique, p] : pairs) {
        SCOPED_TRACE(technique);
        ASSERT_GT(p.oracle, 0);
        EXPECT_LT(p.hidden_from_one, 1 + p.count * 1e-4) << "of " << p.count;
        // Texture colours are halves (error 2^-12). In textures of few colours the rounding does not average out.
        EXPECT_NEAR(p.ours_alike / p.oracle_alike, 1, 2e-4);
    }
    EXPECT_NEAR(ours / expected, 1, 1e-3);
}

/// Axes of a rotated strip; none of them has a small coordinate.
struct Strip {
    dvec3 along = glm::normalize(dvec3(0.78, 0.21, 0.59));
    dvec3 across = glm::normalize(glm::cross(along, dvec3(0.1, 1, 0.2)));
    dvec3 up = glm::cross(across, along);
};

/// A flat strip of two long triangles must not shadow itself. The tracer's error in the distance of such slivers is
/// much larger than a rounding of their length.
TEST_F(DirectLightTest, LongStripsDoNotShadowThemselves) {
    const Strip strip;
    constexpr double kLength = 27;
    for (const bool shared_mesh : {false, true}) {
        for (const double width : {2.0, 0.5, 0.1, 0.03, 0.01}) {
            SCOPED_TRACE(fmt::format("{} wide{}", width, shared_mesh ? ", instanced" : ""));
            Scene scene;
            add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))),
                     vec3(-0.5 * kLength * strip.along - 0.5 * width * strip.across), vec3(kLength * strip.along),
                     vec3(width * strip.across));
            if (shared_mesh) {
                scene.instances.push_back(scene.instances[0]);
                scene.instances[0].object_to_world[1] *= 1.5;
                scene.instances[1].object_to_world[3] = dvec4(-100.0 * strip.up, 1);
            }
            scene.environment.color = vec3(1);
            const dvec3 up = glm::normalize(strip.up * (shared_mesh ? dvec3(1, 1 / 1.5, 1) : dvec3(1)));
            Stage stage(programs, scene, spot_camera(dvec3(0), up, 6), {256, 256});
            int sent = 0, returned = 0;
            for (std::uint32_t sample = 0; sample < 2; ++sample) {
                stage.select_sample(sample);
                const Sample s = trace(stage);
                for (std::size_t path = 0; path < s.states.size(); ++path) {
                    if (s.states[path].lobe == shared::kLobeNone) continue;
                    ++sent;
                    returned += s.met[path].triangle != shared::kMiss && s.met[path].instance == s.hits[path].instance;
                }
            }
            EXPECT_GT(sent, 150);
            EXPECT_EQ(returned, 0) << "of " << sent;
        }
    }
}

TEST_F(DirectLightTest, ThinLightsDoNotShadowThemselves) {
    const Strip strip;
    for (const double width : {0.1, 0.01, 0.004}) {
        SCOPED_TRACE(width);
        Scene scene;
        add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-4, 0, 4}, {8, 0, 0}, {0, 0, -8});
        add_quad(scene, add_material(scene, light_material(vec3(5))),
                 vec3(dvec3(0, 0.8, 0) - strip.along - 0.5 * width * strip.across), vec3(2.0 * strip.along),
                 vec3(width * strip.across));
        Stage stage(programs, scene, spot_camera(dvec3(0), {0.3, 1, 0.2}, 3), {128, 128});
        int lit = 0, hidden = 0;
        for (std::uint32_t sample = 0; sample < 2; ++sample) {
            stage.select_sample(sample);
            const Sample s = trace(stage);
            for (std::size_t path = 0; path < s.light.size(); ++path) {
                if (s.light[path].diffuse == vec3(0)) continue;
                ++lit;
                hidden += s.occluded[path] != shared::kFree;
            }
        }
        EXPECT_GT(lit, 5000);
        EXPECT_EQ(hidden, 0) << "of " << lit;
    }
}

}  // namespace
}  // namespace halflight::test
