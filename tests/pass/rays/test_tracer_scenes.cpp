// Tests the plain tracer against Embree, and all other methods against the plain tracer. The scenes are all of ours and
// the available ones of other projects.
#include <gtest/gtest.h>

#include <filesystem>

#include "engine/io/gltf/gltf.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using namespace test;

class TracerScenes : public GpuTest {
  protected:
    /// Compares the tracers in a scene. `flatten` of build_trace_tables() is the renderer's value, or 0 to keep all
    /// instances. If `all` is false, raster culling and floating nodes are left out.
    void check(const Scene& scene, std::size_t flatten, bool all, std::size_t most_in_part = rays::kMostInPart) {
        const TraceTables tables = opaque_tables(scene, flatten);  // Embree knows no coverage
        if (tables.triangles.empty()) return;
        std::vector<Ray> rays = rays_through(tables.bounds, 62 * 64, 1);  // a multiple of 64
        for (const vec3& from : {vec3(1, 0.4f, 0.3f), vec3(0, 0, 1), vec3(-0.2f, 1, -0.3f)}) {
            const std::vector<Ray> view = camera_rays(tables.bounds, from);
            rays.insert(rays.end(), view.begin(), view.end());
        }
        // Some instances are scaled non-uniformly, by 1:4 at most.
        const double condition = tables.instances.size() > 1 ? 12 : 1;
        const rays::PackedScene packed = roomy(rays::pack_scene(tables, rays::Hierarchies(tables, most_in_part)));
        Tracer tracer(tables, packed);
        const EmbreeOracle oracle(tables);
        const std::vector<Ray> onward =
            rays_onward(oracle, rays, tracer.closest(rays), glm::length(tables.bounds.extent()));
        for (const std::vector<Ray>& some : {rays, onward}) {
            const Comparison c = expect_embree_hits(oracle, tracer, some, condition);
            EXPECT_LE(c.excused, 2 + c.rays / 2000);
        }
        std::vector<Ray> mixed = mixed_rays(tables.bounds, 4000);
        kill_some(mixed);
        mixed.insert(mixed.end(), onward.begin(), onward.end());
        EXPECT_EQ(AgainstPlain(programs, tables, packed, {.raster = all}).differences({mixed}, all ? 2 : 1), "");
        if (!all) return;
        AgainstPlain floating(programs, tables, rays::NodeFormat::floating, {.raster = false});
        EXPECT_EQ(floating.differences({mixed}), "");
    }

    gpu::ProgramCache programs;
};

TEST_F(TracerScenes, OurOwn) {
    for (const fs::path& file : scenes_under(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes")) {
        SCOPED_TRACE(file.string());
        const Scene scene = load_gltf(file);
        check(scene, kFlattenLimit, true);
        check(scene, 0, true);
        check(scene, kFlattenLimit, false, 300);
    }
}

TEST_F(TracerScenes, OfOtherProjects) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
    for (const fs::path& file : scenes_under(folder)) {
        SCOPED_TRACE(file.string());
        check(load_gltf(file), 0, false);
    }
}

}  // namespace
}  // namespace halflight
