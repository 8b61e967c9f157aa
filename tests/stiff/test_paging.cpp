// Tests that pictures do not depend on how much of a scene is in memory.
#include <random>

#include "tests/stiff/stiff.h"
#include "tests/support/memory_pages.h"

namespace halflight::test {
namespace {

class Paging : public StiffTest {
  protected:
    static constexpr paging::PageLimits kSmallPages{.bytes = 1536, .alpha_tested = 24};

    static RenderSettings settings_of(const Scene& scene) {
        RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 4, 4);
        settings.primary = PrimaryVisibility::traced;
        settings.band_pixels = 512;
        return settings;
    }
    static std::size_t triangles_in(const Scene& scene) {
        std::size_t count = 0;
        for (const Instance& instance : scene.instances)
            count += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
        return count;
    }
    static double pixels(const RenderResult& a, const RenderResult& b) {
        double count = pixels_that_differ(a.beauty, b.beauty);
        EXPECT_EQ(a.aovs.size(), b.aovs.size());
        for (std::size_t i = 0; i < a.aovs.size(); ++i) count += pixels_that_differ(a.aovs[i].image, b.aovs[i].image);
        return count;
    }
    /// Compares pictures from pools of several numbers of slots with the picture of the scene in memory. Each pool is
    /// cold at first, then it holds pages that another camera needed.
    void compare(const std::string& name, const Scene& scene, const char* reason,
                 const paging::PageLimits& limits = kSmallPages) {
        const RenderSettings settings = settings_of(scene);
        // Triangles in several parts are never split between leaves, as in pages.
        PreparedScene in_memory(context, scene, {.most_in_part = triangles_in(scene) / 3 + 1});
        const RenderResult expected = Renderer(in_memory, ColorConfig::load(), settings).render();
        EXPECT_GT(mean_of(expected).value, 0) << name << ": the picture is black";
        RenderSettings elsewhere = settings;
        elsewhere.camera.camera_to_world[3] += elsewhere.camera.camera_to_world[2];
        const auto source = std::make_shared<MemoryPages>(scene, 200, limits);
        const std::size_t page = paging::PagePool::slot_bytes(source->index());
        for (const std::size_t slots : {1, 5}) {
            PreparedScene paged(context, scene, {.pages = source, .pool_bytes = slots * page});
            const char* const pool = slots == 1 ? "one page" : "five pages";
            const auto render = [&](const RenderSettings& s) {
                return Renderer(paged, ColorConfig::load(), s).render();
            };
            expect(fmt::format("{}, pool of {}", name, pool), pixels(render(settings), expected), 0, "pixels differ",
                   reason);
            render(elsewhere);
            expect(fmt::format("{}, pool of {} after another view", name, pool), pixels(render(settings), expected), 0,
                   "pixels differ", reason);
        }
    }
    /// Adds triangles to the first mesh of the Cornell box.
    static Scene box_with(const std::vector<std::array<vec3, 3>>& triangles) {
        Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
        Mesh& mesh = scene.meshes[0];
        for (const auto& [a, b, c] : triangles) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            const vec3 normal = glm::normalize(glm::cross(b - a, c - a));
            for (const vec3& p : {a, b, c}) {
                mesh.positions.push_back(p);
                mesh.normals.push_back(normal);
                for (std::vector<vec2>& uvs : mesh.uvs)
                    if (!uvs.empty()) uvs.emplace_back(0);
            }
            mesh.triangles.push_back(first + uvec3(0, 1, 2));
            mesh.triangle_material.push_back(mesh.triangle_material[0]);
        }
        return scene;
    }
    const char* const exact = "exact: hits do not depend on which pages are in memory";
};

TEST_F(Paging, Surfaces) {
    compare("Cornell box with an area light", cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f)), exact);
    compare("masked, blended and emissive curtains", curtain_scene(), exact);
    compare("textures, normal maps and vertex colours", textured_scene(), exact);
    compare("mirrored and scaled instances, merged", instanced_scene(), exact);
}

TEST_F(Paging, Triangles) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> number(-0.9f, 0.9f);
    const auto place = [&] { return vec3(number(random), number(random), number(random)); };
    std::vector<std::array<vec3, 3>> needles, coincident(20000), many;
    for (int i = 0; i < 300; ++i) {
        const vec3 from = place();
        needles.push_back({from, from + vec3(1e-5f, 0, 0), place()});
    }
    const std::array<vec3, 3> one = {place(), place(), place()};
    std::ranges::fill(coincident, one);
    for (int i = 0; i < 1000; ++i) {
        const vec3 at = place();
        many.push_back({at, at + vec3(0.02f, 0, 0.01f), at + vec3(0, 0.02f, 0)});
    }
    compare("needles across all pages", box_with(needles), exact);
    compare("20000 triangles in one place", box_with(coincident), exact, {});
    compare("1000 small triangles in a box of two triangles a wall", box_with(many), exact);
}

TEST_F(Paging, Scales) {
    const Scene room = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    for (const double factor : {1e-12, 5e11})
        compare(fmt::format("room scaled by {:.0e}", factor), scaled(room, factor), exact);
    compare("room 10^7 units from the origin", moved(room, dvec3(1e7, -1e7, 3e6)), exact);
    Scene empty = room;
    empty.meshes.emplace_back();
    compare("a mesh without triangles beside a room", empty, exact);
}

}  // namespace
}  // namespace halflight::test
