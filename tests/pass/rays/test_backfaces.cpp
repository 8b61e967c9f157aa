// Tests that all tracers pass the same back faces, and that these are back faces of one-sided triangles.
#include <gtest/gtest.h>

#include "engine/paging/page_server.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"
#include "tests/support/memory_pages.h"

namespace halflight {
namespace {

using namespace test;
using rays::PassBacks;

/// Returns triangles with and without a back, seen through transforms with and without a mirror. `copies` > 1 makes
/// instances of one mesh.
Scene mixed_scene(int copies) {
    Scene scene = soup(600, 0.3f, vec3(1), 3);
    scene.materials.resize(2);
    scene.materials[1] = scene.materials[0];
    scene.materials[1].double_sided = true;
    for (std::size_t i = 0; i < 600; i += 3) scene.meshes[0].triangle_material[i] = 1;
    const Mesh mesh = scene.meshes[0];
    for (int i = 1; i <= copies; ++i) {
        scene.instances.emplace_back(scene.instances[0]);
        dmat4& m = scene.instances.back().object_to_world;
        m = dmat4(1);
        m[0][0] = i % 2 == 1 ? -1 : 1, m[3] = dvec4(0.4 * i, 0.1 * i, -0.2, 1);
        if (copies > 1) continue;
        scene.instances.back().mesh = 1;
        scene.meshes.push_back(mesh);
    }
    return scene;
}

/// Returns rays of which every other one is marked.
std::vector<Ray> marked_rays(const Bounds& bounds) {
    std::vector<Ray> rays = mixed_rays(bounds, 2000);
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (rays[i].t_max > 0) rays[i].t_min = i % 2 == 0 ? shared::kMarkedStart : 0;
    return rays;
}

/// Returns whether a hit is on the back of a one-sided triangle.
bool is_back(const TraceTables& tables, const Ray& ray, const Hit& hit) {
    const uvec4 t = tables.triangles[hit.triangle];
    if ((t.w & kTriangleOneSided) == 0) return false;
    const dvec3 a(tables.positions[t.x]), b(tables.positions[t.y]), c(tables.positions[t.z]);
    const glm::dmat4x3 to_block(tables.instances[hit.instance].world_to_block);
    const double side = glm::dot(glm::cross(b - a, c - a), glm::dmat3(to_block) * dvec3(ray.direction));
    return (side > 0) != ((t.w & kTriangleMirrored) != 0);
}

class Backfaces : public GpuTest {
  protected:
    gpu::ProgramCache programs;
};

TEST_F(Backfaces, TracersAgree) {
    for (const int copies : {1, 5}) {
        const TraceTables tables = build_trace_tables(mixed_scene(copies));
        ASSERT_TRUE(tables.one_sided);
        AgainstPlain pair(programs, tables);
        const std::vector<Ray> rays = marked_rays(tables.bounds);
        for (const PassBacks backs : {PassBacks::marked, PassBacks::all, PassBacks::none})
            EXPECT_EQ(pair.differences({.rays = rays, .backfaces = backs}), "") << copies << ", " << int(backs);
        if (pair.native()) {
            EXPECT_EQ(pair.native()->counts().delegated, 0u);
        }
    }
}

TEST_F(Backfaces, PagesAgree) {
    const TraceTables tables = build_trace_tables(mixed_scene(1));
    rays::TraceScene memory(tables, rays::pack_scene(tables, rays::Hierarchies(tables, tables.triangles.size())), {});
    const MemoryPages pages(tables, 200, paging::PageLimits{1536});
    paging::PagePool pool(pages, 8 * paging::PagePool::slot_bytes(pages.index()));
    paging::PageServer server(pool);
    rays::Tracer paged(pool.scene(), server);
    graph::Executor executor(programs);
    const std::vector<Ray> rays = marked_rays(tables.bounds);
    for (const PassBacks backs : {PassBacks::marked, PassBacks::all}) {
        const TraceRequest request{.rays = rays, .backfaces = backs};
        EXPECT_EQ(different(answers(executor, request, memory), answers(executor, request, paged)), 0u) << int(backs);
    }
}

TEST_F(Backfaces, RaysGoOnToTheNextFront) {
    for (const int copies : {1, 5}) {
        const TraceTables tables = build_trace_tables(mixed_scene(copies));
        rays::TraceScene scene(tables);
        graph::Executor executor(programs);
        const std::vector<Ray> rays = rays_through(tables.bounds, 2000, 1);
        const std::vector<Hit> found = closest_hits(executor, {.rays = rays, .backfaces = PassBacks::all}, scene);
        const std::vector<std::uint32_t> occluded =
            any_hits(executor, {.rays = rays, .backfaces = PassBacks::all}, scene);
        std::vector<Ray> onward = rays;
        std::size_t passed = 0;
        for (int turn = 0; turn < 40; ++turn) {  // rays go on behind the backs that they have met
            const std::vector<Hit> hits = closest_hits(executor, {.rays = onward}, scene);
            std::size_t backs = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const Hit& hit = hits[i];
                if (onward[i].t_max < 0) continue;
                if (hit.triangle != kMiss && is_back(tables, rays[i], hit)) {
                    onward[i].t_min = hit.t;
                    ++backs;
                    continue;
                }
                EXPECT_EQ(found[i].triangle, hit.triangle) << i;
                if (hit.triangle != kMiss) {
                    EXPECT_EQ(found[i].instance, hit.instance) << i;
                }
                EXPECT_EQ(occluded[i] != shared::kFree, hit.triangle != kMiss) << i;
                onward[i].t_max = -1;
            }
            passed += backs;
            if (backs == 0) break;
            ASSERT_LT(turn, 39);
        }
        EXPECT_GT(passed, 500u);
    }
}

}  // namespace
}  // namespace halflight
