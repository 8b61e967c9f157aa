// Tests drivers that end long loops early, as Mesa 22.3 does: an unfinished ray is counted, and never taken for lit or
// shadowed.
#include <gtest/gtest.h>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"
#include "engine/tables/tables.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;

/// Returns a floor under an opaque roof, a point light above the roof, and `sheets` transparent panes (alpha 0) between
/// floor and roof.
Scene floor_under(int sheets) {
    Material white, clear, roof;
    white.metallic = clear.metallic = roof.metallic = 0;
    clear.alpha_mode = AlphaMode::blend;
    clear.base_color.a = 0;
    Scene scene = floor_scene(white);
    scene.materials.push_back(clear);
    scene.materials.push_back(roof);
    const auto pane = [&](Mesh& mesh, float y, std::uint32_t material) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const vec2& c : {vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, 1)}) {
            mesh.positions.push_back({50 * c.x, y, 50 * c.y});
            mesh.normals.push_back({0, 1, 0});
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
        mesh.triangle_material.insert(mesh.triangle_material.end(), 2, material);
    };
    Mesh panes;
    for (int i = 0; i < sheets; ++i) pane(panes, 1 + static_cast<float>(i) / static_cast<float>(sheets), 1);
    pane(panes, 3, 2);
    scene.instances.push_back({"panes", static_cast<int>(scene.meshes.size()), dmat4(1), kNone});
    scene.meshes.push_back(std::move(panes));
    scene.environment = {};
    scene.lights = {{}};
    scene.lights[0].position = {0, 4, 0};
    return scene;
}

/// Returns whether the driver ends a loop of 100000 iterations early.
bool ends_long_loops() {
    const gpu::Program program = gpu::Program::compute({"long loop", R"(
layout(local_size_x = 1) in;
layout(std430) buffer Sums { uint sums[]; };
void main() {
    for (uint i = 0u; i < 100000u; ++i) sums[0] += i + sums[1];
})"});
    const gpu::Buffer sums = gpu::Buffer::from("sums", std::vector<std::uint32_t>{0, 1});
    program.bind_storage("Sums", sums);
    program.dispatch(1);
    std::uint32_t expected = 0;
    for (std::uint32_t i = 0; i < 100000; ++i) expected += i + 1;
    return sums.read<std::uint32_t>()[0] != expected;
}

class UnfinishedTest : public GpuTest {};

TEST_F(UnfinishedTest, LongTraversalsAreCorrectOrCounted) {
    for (const int sheets : {100, 40000}) {
        const Scene scene = floor_under(sheets);
        const RenderResult result =
            render(context, scene, small_settings(spot_camera({0, 0, 0}, {0, 1, 0}, 0.5), 8, 8, 1, 1));
        std::uint64_t counted = 0;
        for (const BadValues& n : result.stats.bad_values) counted += n.total();
        for (const float v : layer(result, "direct_diffuse.R").pixels) EXPECT_EQ(v, 0) << sheets;
        if (sheets == 100) {
            EXPECT_EQ(counted, 0u);
        }
        if (sheets == 40000) {
            EXPECT_EQ(counted > 0, ends_long_loops());
        }
    }
}

}  // namespace
}  // namespace halflight
