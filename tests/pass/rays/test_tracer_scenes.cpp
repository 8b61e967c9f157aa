// Tests the plain tracer against Embree, and culling by tiles against the plain tracer. The scenes are all of ours and
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
    /// Compares the tracers. `flatten` of build_trace_tables() is the renderer's value, or 0 to keep all instances.
    void check(const fs::path& file, std::size_t flatten, std::size_t most_in_part = rays::kMostInPart) {
        SCOPED_TRACE(file.string());
        const Scene scene = load_gltf(file);
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
        const std::vector<Hit> hits = check(tracer, oracle, rays, condition);
        const std::vector<Ray> onward = rays_onward(oracle, rays, hits, glm::length(tables.bounds.extent()));
        check(tracer, oracle, onward, condition);
        rays.insert(rays.end(), onward.begin(), onward.end());
        EXPECT_EQ(PlainAgainstTiles(programs, tables, packed).different_answers(rays), 0u);
    }

    static std::vector<Hit> check(Tracer& tracer, const EmbreeOracle& oracle, const std::vector<Ray>& rays,
                                  double condition) {
        const std::vector<Hit> hits = tracer.closest(rays);
        const Comparison c = compare_hits(oracle, rays, hits, condition);
        EXPECT_GT(c.hits, c.rays / 100);
        EXPECT_EQ(c.missed, 0u);
        EXPECT_EQ(c.false_hits, 0u);
        EXPECT_LE(c.excused, 2 + c.rays / 2000);
        const std::vector<std::uint32_t> occluded = tracer.any(rays);
        std::size_t different = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) different += (hits[i].triangle != kMiss) != (occluded[i] == 1);
        EXPECT_EQ(different, 0u);
        return hits;
    }

    gpu::ProgramCache programs;
};

TEST_F(TracerScenes, OurOwn) {
    for (const fs::path& file : scenes_under(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes")) {
        check(file, kFlattenLimit);
        check(file, 0);
    }
}

TEST_F(TracerScenes, OurOwnInManyParts) {
    for (const fs::path& file : scenes_under(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes"))
        check(file, kFlattenLimit, 300);
}

TEST_F(TracerScenes, OfOtherProjects) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
    for (const fs::path& file : scenes_under(folder)) check(file, 0);
}

}  // namespace
}  // namespace halflight
