// Tests coverage, independent of the order of traversal: masks, stochastic transparency, and panes.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/device/scene_buffers.h"
#include "engine/paging/page_server.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"
#include "tests/support/memory_pages.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

using test::Hit;
using test::kMiss;
using test::Ray;

constexpr std::uint32_t kRays = 8192;

/// Adds a square over [0, 1]^2 at height z with texture coordinates (x, y) and a material of its own.
void add_square(Scene& scene, float z, const Material& material) {
    Mesh mesh;
    mesh.positions = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
    mesh.normals.assign(4, vec3(0, 0, 1));
    mesh.uvs[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangle_material.assign(2, static_cast<std::uint32_t>(scene.materials.size()));
    scene.materials.push_back(material);
    scene.instances.emplace_back().mesh = static_cast<int>(scene.meshes.size());
    scene.meshes.push_back(mesh);
}

Material covering(AlphaMode mode, float alpha) {
    Material material;
    material.alpha_mode = mode;
    material.base_color.a = alpha;
    return material;
}

class TracerAlpha : public GpuTest {
  protected:
    struct Answers {
        std::vector<Hit> hits;
        std::vector<Ray> rays;
        TraceTables tables;
        /// Returns the height of ray i's hit.
        float height(std::size_t i) const { return rays[i].origin.z - hits[i].t + static_cast<float>(tables.origin.z); }
    };

    /// Traces rays straight down on a grid above the squares, in memory and through a pool of one page, which must
    /// agree.
    Answers trace(const Scene& scene, std::uint32_t salt = 0, std::uint32_t sample = 0,
                  std::uint32_t rays_of_path = 1) {
        Answers a;
        a.tables = build_trace_tables(scene);
        const ShadingTables shading = build_shading_tables(scene, a.tables);
        const SceneBuffers buffers(a.tables, shading);
        rays::TraceScene memory(a.tables, buffers.defines());
        for (std::uint32_t i = 0; i < kRays; ++i) {
            const vec3 from((static_cast<float>(i % 128) + 0.4f) / 128.0f, (static_cast<float>(i / 128) + 0.6f) / 64.0f,
                            9);
            a.rays.push_back({from - vec3(a.tables.origin), 0, vec3(0, 0, -1), kInfinity});
        }
        const test::MemoryPages pages(a.tables, 8, {.bytes = 768, .alpha_tested = 16}, shading.vertices);
        paging::PagePool pool(pages, 1, buffers.defines());
        paging::PageServer server(pool);
        rays::Tracer paged(pool.scene(), server);
        gpu::Buffer constants = test::constants_of_paths(sample);
        graph::Executor executor(programs_);
        buffers.bind();
        const test::TraceRequest request{
            .rays = a.rays, .frame_constants = &constants, .rays_of_path = rays_of_path, .alpha_salt = salt};
        const test::Answers plain = answers(executor, request, memory);
        EXPECT_EQ(different(plain, answers(executor, request, paged)), 0u) << "a pool of one page";
        for (std::size_t i = 0; i < kRays; ++i) EXPECT_EQ(plain.occluded[i] == 1, plain.hits[i].triangle != kMiss) << i;
        a.hits = plain.hits;
        return a;
    }

    gpu::ProgramCache programs_;
};

TEST_F(TracerAlpha, MasksCutOutByTexture) {
    Scene scene;
    scene.name = "mask";
    Material mask = covering(AlphaMode::mask, 1);
    mask.base_color_texture.image = 0;
    mask.base_color_texture.nearest = true;
    scene.images.push_back({"half", 2, 1, {255, 255, 255, 0, 255, 255, 255, 255}});
    add_square(scene, 2, mask);
    add_square(scene, 1, covering(AlphaMode::mask, 0.4f));  // the alpha is below the cutoff
    add_square(scene, 0, Material{});
    const Answers a = trace(scene);
    for (std::size_t i = 0; i < kRays; ++i) EXPECT_NEAR(a.height(i), i % 128 < 64 ? 0.0f : 2.0f, 1e-5f) << i;
}

// Two triangles share an edge. The upper triangle is transparent.
TEST_F(TracerAlpha, BothTrianglesOfAPairAreTested) {
    for (const std::size_t absent : {0u, 1u}) {
        Scene scene;
        scene.name = "bent";
        add_square(scene, 0, covering(AlphaMode::mask, 1));
        scene.materials.push_back(covering(AlphaMode::mask, 0.4f));
        Mesh& mesh = scene.meshes[0];
        mesh.positions = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 2, 0.5f}};
        mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
        mesh.triangle_material = {0, 0};
        mesh.triangle_material[absent] = 1;
        for (const bool both : {false, true}) {
            if (both) mesh.triangle_material[1 - absent] = 1;
            const Answers a = trace(scene);
            ASSERT_EQ(rays::pack_scene(a.tables).pairs.size(), 4u);
            for (std::size_t i = 0; i < kRays; ++i) {
                EXPECT_EQ(a.hits[i].triangle, both ? kMiss : static_cast<std::uint32_t>(1 - absent)) << i;
            }
        }
    }
}

TEST_F(TracerAlpha, BlendHitsWithProbabilityAlpha) {
    Scene scene;
    scene.name = "blend";
    add_square(scene, 2, covering(AlphaMode::blend, 0.3f));
    add_square(scene, 1, covering(AlphaMode::blend, 0.6f));
    trace(scene, 0, 0, 4);
    const Answers a = trace(scene), again = trace(scene), other_salt = trace(scene, 1);
    EXPECT_TRUE(test::bits_of(a.hits) == test::bits_of(again.hits));
    std::size_t upper = 0, lower = 0, salted = 0;
    for (std::size_t i = 0; i < kRays; ++i) {
        const bool hit = a.hits[i].triangle != kMiss;
        upper += hit && a.height(i) > 1.5f;
        lower += hit && a.height(i) < 1.5f;
        salted += a.hits[i].triangle != other_salt.hits[i].triangle;
    }
    const auto expect_share = [](std::size_t count, double share) {
        EXPECT_NEAR(static_cast<double>(count) / kRays, share, 5 * std::sqrt(share * (1 - share) / kRays));
    };
    expect_share(upper, 0.3);
    expect_share(lower, 0.7 * 0.6);
    // Two independent results out of {upper, lower, none} differ with probability 1 - sum of squares.
    const double differ = 1 - 0.3 * 0.3 - 0.42 * 0.42 - 0.28 * 0.28;
    expect_share(salted, differ);
}

TEST_F(TracerAlpha, SamplesOfAPixelAreStratified) {
    Scene scene;
    scene.name = "blend";
    add_square(scene, 2, covering(AlphaMode::blend, 0.3f));
    add_square(scene, 1, covering(AlphaMode::blend, 0.6f));
    constexpr std::uint32_t kSamples = 8;
    std::vector<int> upper(kRays), lower(kRays);
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) {
        const Answers a = trace(scene, 0, sample);
        for (std::size_t i = 0; i < kRays; ++i) {
            if (a.hits[i].triangle == kMiss) continue;
            ++(a.height(i) > 1.5f ? upper : lower)[i];
        }
    }
    double sum = 0;
    for (std::size_t i = 0; i < kRays; ++i) {
        EXPECT_TRUE(upper[i] == 2 || upper[i] == 3) << i << ": 0.3 * 8 is 2.4";
        sum += lower[i];
    }
    // Squares are independent: the lower one takes its share of what the upper one leaves.
    const double share = 0.7 * 0.6;
    EXPECT_NEAR(sum / (kRays * kSamples), share, 5 * std::sqrt(share * (1 - share) / (kRays * kSamples)));
}

TEST_F(TracerAlpha, SurfacesBehindAHitDoNotChangeIt) {
    Scene few, many;
    few.name = many.name = "layers";
    add_square(few, 5, covering(AlphaMode::blend, 0.5f));
    add_square(many, 5, covering(AlphaMode::blend, 0.5f));
    for (int i = 0; i < 30; ++i) add_square(many, 0.1f * static_cast<float>(i), covering(AlphaMode::blend, 0.5f));
    const Answers a = trace(few), b = trace(many);
    for (std::size_t i = 0; i < kRays; ++i) {
        const bool first = b.hits[i].triangle < 2;
        EXPECT_EQ(a.hits[i].triangle != kMiss, first) << i;
    }
}

// Instances, opaque and blended squares among panes; all tracers and a pool of few pages.
TEST_F(TracerAlpha, AllTracersPassTheSamePanes) {
    for (const int copies : {1, 5}) {
        Scene scene = test::soup(400, 0.4f, vec3(1), 3);
        scene.name = "panes";
        Material pane = test::glass_material(0);
        pane.thickness = 0;
        scene.materials.push_back(pane);
        scene.materials.push_back(pane);
        scene.materials.back().alpha_mode = AlphaMode::blend;
        scene.materials.back().base_color.a = 0.5f;
        scene.materials.push_back(covering(AlphaMode::blend, 0.5f));
        for (std::size_t i = 0; i < 400; ++i) scene.meshes[0].triangle_material[i] = static_cast<std::uint32_t>(i % 4);
        for (int i = 1; i < copies; ++i) {
            scene.instances.emplace_back(scene.instances[0]);
            scene.instances.back().object_to_world[3] = dvec4(0.3 * i, 0.1 * i, 0, 1);
        }
        const TraceTables tables = build_trace_tables(scene);
        ASSERT_TRUE(tables.panes);
        const ShadingTables shading = build_shading_tables(scene, tables);
        const SceneBuffers buffers(tables, shading);
        gpu::Buffer constants = test::constants_of_paths(0);
        const std::vector<Ray> rays = test::mixed_rays(tables.bounds, 3000);
        test::AgainstPlain pair(programs_, tables, rays::NodeFormat::grid, {}, buffers.defines());
        // Distances of triangles that are split between leaves depend on the leaves, and parts that are cut split none.
        const rays::Hierarchies unsplit(tables, tables.triangles.size() / 2);
        rays::TraceScene scene_of(tables, rays::pack_scene(tables, unsplit), buffers.defines());
        graph::Executor executor(programs_);
        std::size_t met[2] = {};  // rays that meet anything, by mode
        for (const bool passes : {false, true}) {
            buffers.bind();  // restores the rows that the pool has replaced
            const test::TraceRequest request{.rays = rays, .frame_constants = &constants, .passes_panes = passes};
            EXPECT_EQ(pair.differences(request, 2), "") << copies << ", " << passes;
            const test::Answers plain = answers(executor, request, scene_of);
            std::size_t panes = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const Hit& hit = plain.hits[i];
                EXPECT_EQ(plain.occluded[i] == 1, hit.triangle != kMiss) << i;
                if (hit.triangle == kMiss) continue;
                ++met[passes ? 1 : 0];
                panes += shared::in_pane(tables.triangles[hit.triangle].w);
            }
            EXPECT_EQ(panes > 0, !passes);
            if (copies > 1) continue;
            const test::MemoryPages pages(tables, 100, {.bytes = 1536, .alpha_tested = 64}, shading.vertices);
            paging::PagePool pool(pages, 8 * paging::PagePool::slot_bytes(pages.index()), buffers.defines());
            paging::PageServer server(pool);
            rays::Tracer paged(pool.scene(), server);
            EXPECT_EQ(different(plain, answers(executor, request, paged)), 0u) << passes;
        }
        EXPECT_GT(met[0], met[1]);
        EXPECT_GT(met[1], 0u);
    }
}

}  // namespace
}  // namespace halflight
