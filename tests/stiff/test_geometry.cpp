// Tests meshes that are difficult to trace: slivers, duplicates, T-junctions, thin walls. Nothing may leak.
#include <algorithm>
#include <cmath>
#include <random>

#include "engine/io/gltf/gltf.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/stiff/stiff.h"
#include "tests/support/error_message.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

class Geometry : public StiffTest {
  protected:
    /// Returns rays from points within a tenth of `radius` around the origin. Half of the directions are random. A
    /// quarter leads through vertices and a quarter through midpoints of edges of the first mesh, to float precision.
    static std::vector<Ray> rays_within(const Scene& scene, float radius, std::size_t count, std::uint32_t seed) {
        const Mesh& mesh = scene.meshes[0];
        std::mt19937 random(seed);
        std::normal_distribution<float> normal;
        std::vector<Ray> rays(count);
        const auto turned = [&] { return vec3(normal(random), normal(random), normal(random)); };
        for (std::size_t i = 0; i < count; ++i) {
            const vec3 origin = i % 8 == 0 ? vec3(0) : 0.03f * radius * turned();
            vec3 direction = turned();
            if (i % 4 >= 2) {
                const uvec3& t = mesh.triangles[random() % mesh.triangles.size()];
                const vec3 a = mesh.positions[t.x], b = mesh.positions[t.y];
                direction = (i % 4 == 2 ? a : 0.5f * (a + b)) - origin;
            }
            rays[i] = {origin, 0, direction, kInfinity};
        }
        return rays;
    }
    static std::size_t misses(const std::vector<Hit>& hits) {
        return static_cast<std::size_t>(std::ranges::count(hits, kMiss, &Hit::triangle));
    }
    /// Adds `light` of radiance 1e4 on the ceiling of [x0, x1] x [-1, 1]^2.
    static void add_ceiling_light(Scene& scene, float x0, float x1) {
        add_quad(scene, add_material(scene, light_material(vec3(1e4f))), {x0 + 0.1f, 0.99f, -0.9f},
                 {x1 - x0 - 0.2f, 0, 0}, {0, 0, 1.8f});
    }
};

TEST_F(Geometry, ClosedMeshesAreWatertight) {
    // 3 10^6 rays find leaks of one in 10^6 with a probability of 95 %.
    constexpr std::size_t kRays = 1 << 18;
    std::size_t rays = 0, leaks = 0;
    for (const unsigned rings : {8u, 64u, 256u}) {
        for (const float radius : {1e-6f, 1.0f, 1e6f}) {
            const Scene scene = sphere(rings, vec3(0), radius);
            Tracer tracer(build_trace_tables(scene));
            leaks += misses(tracer.closest(rays_within(scene, radius, kRays, rings)));
            rays += kRays;
        }
    }
    const Scene scene = sphere(64, vec3(0), 1);
    const TraceTables tables = build_trace_tables(scene);
    gpu::ProgramCache programs;
    EXPECT_EQ(AgainstPlain(programs, tables, rays::NodeFormat::grid, kTilesAlone)
                  .differences({rays_within(scene, 1, 1 << 16, 5)}),
              "");
    Tracer tracer(tables);
    for (std::uint32_t seed = 0; rays < 3'000'000; ++seed, rays += kRays)
        leaks += misses(tracer.closest(rays_within(scene, 1, kRays, seed)));
    expect(fmt::format("{:.2e} rays within spheres of 10^-6, 1 and 10^6 m: leaks", static_cast<double>(rays)),
           static_cast<double>(leaks), 0, "rays", "exact: the test is watertight (Woop et al. 2013)");
}

TEST_F(Geometry, Slivers) {
    // A closed box has a belt of slivers of 2 x 2.4e-7, which meet at their ends.
    Scene scene;
    Material glowing = diffuse_material(vec3(0.5f));
    glowing.emission = vec3(1);
    const int material = add_material(scene, glowing);
    const float cuts[] = {-1, 0, 0x1p-22f, 0x1p-21f, 1};
    for (int i = 0; i < 4; ++i) {
        const float x = cuts[i];
        const vec3 u(cuts[i + 1] - x, 0, 0), y(0, 2, 0), z(0, 0, 2);
        for (const float s : {-1.0f, 1.0f}) {
            add_quad(scene, material, {x, s, -1}, u, z);
            add_quad(scene, material, {x, -1, s}, u, y);
        }
    }
    for (const float s : {-1.0f, 1.0f}) add_quad(scene, material, {s, -1, -1}, {0, 2, 0}, {0, 0, 2});
    scene.environment.color = vec3(1e6f);
    const double exact = 2 * (1 - std::pow(0.5, 5));
    const RenderResult seen = picture(scene, camera_in_box(), 32, 64, 4);
    expect("room with slivers of aspect 10^7: pixels that see through", pixels_other_than(layer(seen, "emission.R"), 1),
           0, "pixels", "exact: closed");
    expect_mean("room with slivers of aspect 10^7 under a sky of 10^6", mean_of(seen), exact);
    expect_mean("room with slivers of aspect 10^7 under a sky of 10^6, oracle",
                mean_of(render_oracle(scene, camera_in_box(), 32, 64, 4)), exact);
}

/// A strip of 64 bands around the origin. Each band has two slivers of 6 x 3 * 2^-k. All corners are exact floats in
/// one plane, but no direction is parallel to an axis.
struct SliverStrip {
    static constexpr int kBands = 64;
    vec3 along{1, 2, 2}, across{2, 1, -2}, up{2, -2, 1};  // length 3 each
    float step;                                           // distance of the bands, in lengths of `across`

    explicit SliverStrip(int k) : step(std::ldexp(1.0f, -k)) {}
    double aspect() const { return 6 / (3.0 * step); }
    double width() const { return 3.0 * kBands * step; }
    vec3 corner(float end, int band) const {
        return end * along + step * static_cast<float>(band - kBands / 2) * across;
    }
    /// Adds the strip as one mesh, so that no origin is subtracted from its vertices.
    void add_to(Scene& scene, int material) const {
        Mesh mesh;
        for (int band = 0; band <= kBands; ++band)
            for (const float end : {-1.0f, 1.0f}) mesh.positions.push_back(corner(end, band));
        for (unsigned i = 0; i < 2 * kBands; i += 2) {
            mesh.triangles.emplace_back(i, i + 1, i + 2);
            mesh.triangles.emplace_back(i + 2, i + 1, i + 3);
        }
        mesh.normals.assign(mesh.positions.size(), up / 3.0f);
        mesh.triangle_material.assign(mesh.triangles.size(), static_cast<std::uint32_t>(material));
        scene.instances.push_back({"strip", static_cast<int>(scene.meshes.size()), dmat4(1), kNone});
        scene.meshes.push_back(std::move(mesh));
    }
};

TEST_F(Geometry, SliversAsReceivers) {
    for (const int k : {9, 13, 17, 22}) {
        const SliverStrip strip(k);
        Scene scene;
        strip.add_to(scene, add_material(scene, diffuse_material(vec3(0.5f))));
        scene.environment.color = vec3(1);
        const std::string name = fmt::format("strip of slivers of aspect {:.1e} under a sky of 1", strip.aspect());
        EXPECT_EQ(build_trace_tables(scene).slivers, strip.aspect() > kSliverAspect) << name;
        for (const float place : {0.0f, 0.9f}) {
            const Camera camera = spot_camera(dvec3(place * strip.along), dvec3(strip.up) / 3.0, 0.5 * strip.width());
            const RenderResult seen = picture(scene, camera, 32, 64, 1);
            expect_mean(fmt::format("{}, {} of its way to an end", name, place), mean_of(seen), 0.5);
        }
    }
}

TEST_F(Geometry, SliversAsLights) {
    for (const int k : {9, 13, 17, 22}) {
        const SliverStrip strip(k);
        Scene scene;
        const float radiance = 1e3f / strip.step;
        strip.add_to(scene, add_material(scene, light_material(vec3(radiance))));
        const dvec3 up = dvec3(strip.up) / 3.0, along = dvec3(strip.along) / 3.0, across = dvec3(strip.across) / 3.0;
        const dvec3 at = -2.0 * up + 0.7 * along + 0.5 * across;
        const dvec3 normal = glm::normalize(up + 0.3 * along);
        const dvec3 u = glm::normalize(glm::cross(normal, across)), v = glm::cross(normal, u);
        add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), vec3(at - 0.5 * u - 0.5 * v), vec3(u),
                 vec3(v));
        const dvec3 end = 3.0 * along, side = 0.5 * strip.width() * across;
        const double irradiance =
            radiance * polygon_irradiance(at, normal, {-end - side, end - side, end + side, side - end});
        const double exact = 0.5 / kPi * irradiance;
        const std::string name = fmt::format("lit by a strip of slivers of aspect {:.1e}", strip.aspect());
        expect_mean(name, mean_of(picture(scene, spot_camera(at, normal, 0.01), 16, 256, 1)), exact, 1e-3,
                    "1/1000 for the spot's size");
    }
}

TEST_F(Geometry, TrianglesWithoutAreaAreNoSlivers) {
    Scene scene = closed_box(diffuse_material(vec3(0.5f)));
    EXPECT_FALSE(build_trace_tables(scene).slivers);
    const vec3 a(0.1f, 0.2f, 0.3f), b(0.7f, -0.4f, 0.9f);
    double slivers = 0;
    slivers += is_sliver(a, a, b) + is_sliver(a, b, a) + is_sliver(b, a, a) + is_sliver(a, a, a);
    for (int i = 1; i < 64; ++i) slivers += is_sliver(a, b, glm::mix(a, b, static_cast<float>(i) / 64.0f));
    expect("triangles on a line, as well as floats can tell: tested as slivers", slivers, 0, "triangles",
           "exact: they cover nothing");
    expect("sliver of 2 m x 5 10^-7 m: tested as one", !is_sliver({-1, 0, 0}, {1, 0, 0}, {0.2f, 5e-7f, 0}), 0,
           "triangles not so", "exact: its height is 8 units of its coordinates' last place");
}

TEST_F(Geometry, DuplicateTriangles) {
    const Scene once = cornell_box();
    Scene twice = once;
    for (const Instance& i : once.instances) {
        const Mesh& mesh = once.meshes[static_cast<std::size_t>(i.mesh)];
        if (!has_emission(once.materials[mesh.triangle_material[0]])) twice.instances.push_back(i);
    }
    expect("room with every wall twice",
           pixels_that_differ(picture(twice, once.cameras[0], 48, 8, 4).beauty,
                              picture(once, once.cameras[0], 48, 8, 4).beauty),
           0, "pixels differ", "exact: ties go to the lower primitive");
}

TEST_F(Geometry, TrianglesWithoutArea) {
    GltfBuilder builder;
    Json& primitive = builder.add_mesh({{"POSITION", builder.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0})}});
    primitive["indices"] = builder.accessor<std::uint16_t>("SCALAR", kU16, {0, 1, 2, 0, 1, 1, 0, 1, 3, 3, 3, 3});
    const Scene scene = loaded(builder, [](const auto& file) { return load_gltf(file); });
    expect("glTF of one triangle and three without area: triangles kept",
           static_cast<double>(scene.meshes[0].triangles.size()), 1, "triangles", "the others cover nothing");
    Scene by_hand = scene;
    by_hand.meshes[0].triangles[0].y = by_hand.meshes[0].triangles[0].x;
    expect("one made by hand: rendered nevertheless",
           error_message([&] { picture(by_hand, camera_in_box(), 8, 1, 1); }).empty(), 0, "scenes",
           "validate() names it");
}

TEST_F(Geometry, JunctionsAndSharedEdges) {
    // Four rooms meet at one edge. Two rooms share each of three sheets, and one wall has a vertex where its neighbours
    // have none. The sky lights all outer sides.
    Scene scene;
    const int grey = add_material(scene, diffuse_material(vec3(0.5f)));
    const vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    for (const float s : {-1.0f, 0.0f, 1.0f}) {
        add_quad(scene, grey, {s, -1, -1}, 2.0f * y, 2.0f * z);
        add_quad(scene, grey, {-1, s, -1}, 2.0f * z, 2.0f * x);
    }
    add_quad(scene, grey, {-1, -1, -1}, 2.0f * x, 2.0f * y);
    add_quad(scene, grey, {-1, -1, 1}, 0.625f * x, 2.0f * y);
    add_quad(scene, grey, {-0.375f, -1, 1}, 1.375f * x, 0.875f * y);
    add_quad(scene, grey, {-0.375f, -0.125f, 1}, 1.375f * x, 1.125f * y);
    scene.environment.color = vec3(1);
    double lit = 0;
    for (const dvec3& eye : {dvec3(-0.5, -0.4, 0.3), dvec3(0.5, 0.6, -0.2), dvec3(0.4, -0.3, 0.1)}) {
        const Camera camera = look_at_camera(eye, {eye.x, eye.y + 0.1, 1}, {0, 1, 0}, 2.5);
        lit += pixels_other_than(picture(scene, camera, 64, 32, 6).beauty, 0);
    }
    expect("closed rooms with T-junctions and edges of four sheets under a sky: pixels lit", lit, 0, "pixels",
           "exact: joints lie on one line of floats, and 2 10^6 segments find no crack");
}

TEST_F(Geometry, ThinWalls) {
    struct View {
        const char* name;
        dvec3 from, to;  // two points inside the dark room
        double fov;
    };
    const View views[] = {
        {"looking at the wall", {-0.7, 0.1, 0.2}, {0, -0.1, 0}, 1.6},
        {"looking at the floor", {-0.5, 0.1, 0.2}, {-0.5, -1, 0}, 0.7},
        {"looking at the wall's foot", {-0.7, 0.1, 0.2}, {0, -1, 0}, 1},
        {"looking at the foot from far and low", {-0.9, -0.95, -0.9}, {0, -1, 0.5}, 0.3},
        {"looking into the corner behind", {-0.4, 0.2, -0.3}, {0, -1, 1}, 0.8},
        {"looking along the wall", {-0.01, 0.1, -0.9}, {-0.01, -0.5, 0.9}, 1.5},
        {"looking along the wall 1/1000 of the room beside it", {-0.001, 0.1, -0.9}, {-0.001, -0.5, 0.9}, 1.5},
    };
    for (const double scale : {1.0, 10.0, 100.0}) {
        Scene scene;
        const int white = add_material(scene, diffuse_material(vec3(0.9f)));
        add_box(scene, white, {-1, -1, -1}, {0, 1, 1});
        add_box(scene, white, {static_cast<float>(1e-4 / scale), -1, -1}, {1, 1, 1});
        add_ceiling_light(scene, 0.01f, 1);
        for (const View& v : views) scene.cameras.push_back(look_at_camera(v.from, v.to, {0, 1, 0}, v.fov));
        scene = scaled(scene, scale);
        for (std::size_t i = 0; i < std::size(views); ++i) {
            const std::string name =
                fmt::format("dark room of {} m behind a wall of 10^-4 m, {}", scale, views[i].name);
            // The 65,536 paths of a view find leaks of one in 22,000 with a probability of 95 %.
            expect(name, brightest(rgb(picture(scene, scene.cameras[i], 64, 16, i == 0 ? 8 : 1).beauty)), 0, "radiance",
                   "exact: closed");
            if (i == 0)
                expect(name + ", oracle", brightest(render_oracle(scene, scene.cameras[i], 32, 16, 8).beauty), 0,
                       "radiance", "exact: closed");
        }
    }
    Scene scene;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.9f))), vec3(-1), vec3(1));
    add_quad(scene, 0, {0, -1, -1}, {0, 2, 0}, {0, 0, 2});
    add_ceiling_light(scene, 0, 1);
    const auto mean = [&](double x) {
        const Camera camera = look_at_camera({x, 0.1, 0.2}, {x, -1, 0}, {0, 1, 0}, 0.7);
        return mean_of(picture(scene, camera, 64, 64, 8)).value;
    };
    expect("dark room behind a sheet that abuts on the walls, beside the lit one", mean(-0.5) / mean(0.5), 9 * 0x1p-21,
           "of its radiance",
           "no vertices are shared: each of nine hits may be on the other side by 2^-21 of the room");
}

}  // namespace
}  // namespace halflight::test
