// Tests that pictures do not depend on the tracing method, bit for bit.
#include <gtest/gtest.h>

#include "engine/rays/tracer.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using rays::Culling;

class CulledPictures : public GpuTest {
  protected:
    /// If native tracing is possible, `automatic` tries tiles only if there are more samples than
    /// Tracer::kFirstNativeRuns.
    void check(const Scene& scene, int samples = 8) {
        RenderSettings settings = small_settings(scene.cameras.front(), 40, 24, samples, 3);
        settings.culling = Culling::off;
        settings.estimator.reuse = Reuse::four;
        const RenderResult plain = render(context, scene, settings);
        for (const Culling culling : {Culling::compute, Culling::raster, Culling::automatic}) {
            SCOPED_TRACE(rays::name(culling));
            settings.culling = culling;
            const RenderResult culled = render(context, scene, settings);
            expect_same(culled, plain);
            bool tiles = false, native = false, raster = false;
            for (const rays::BatchStatistics& s : culled.stats.batches) {
                tiles = tiles || s.measured[static_cast<std::size_t>(rays::TraceMethod::tiles)].runs > 0;
                native = native || s.measured[static_cast<std::size_t>(rays::TraceMethod::native)].runs > 0;
                raster = raster || s.method == rays::TraceMethod::raster;
            }
            const bool waits = native && static_cast<std::uint64_t>(samples) <= rays::Tracer::kFirstNativeRuns;
            EXPECT_EQ(tiles, culling != Culling::raster && !waits);
            EXPECT_EQ(raster, culling == Culling::raster);
        }
    }
};

TEST_F(CulledPictures, OneHierarchy) {
    for (const int samples : {8, static_cast<int>(rays::Tracer::kFirstNativeRuns) + 8}) {
        SCOPED_TRACE(samples);
        check(cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f)), samples);
    }
}

TEST_F(CulledPictures, CoverageAndInstances) {
    check(curtain_scene());
    check(instanced_scene());
}

// Slivers are tested in double precision.
TEST_F(CulledPictures, Slivers) {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.7f, 0.5f), 0.2f));
    const int material = add_material(scene, diffuse_material(vec3(0.8f)));
    for (int i = 0; i < 20; ++i) {
        const float h = 0.04f * static_cast<float>(i);
        add_quad(scene, material, {-0.9f, h - 0.5f, 0.7f - h}, {1.8f, 0.4f - h, 0.1f}, {0, 1e-6f * (1 + h), 0});
    }
    check(scene);
}

}  // namespace
}  // namespace halflight
