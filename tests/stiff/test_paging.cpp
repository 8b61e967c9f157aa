// Tests that pictures do not depend on how much of a scene is in memory.
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/core/interruption.h"
#include "engine/paging/convert.h"
#include "tests/stiff/stiff.h"
#include "tests/support/error_message.h"
#include "tests/support/memory_pages.h"
#include "tests/unit/paging/scene_meshes.h"
#include "tools/common/temporary_folder.h"

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
    /// cold at first, then it holds pages that another camera needed. Returns the index of the page file.
    paging::PageIndex compare(const std::string& name, const Scene& scene, const char* reason,
                              const paging::PageLimits& limits = kSmallPages) {
        const RenderSettings settings = settings_of(scene);
        // Triangles in several parts are never split between leaves, as in pages.
        PreparedScene in_memory(context, scene, {.most_in_part = triangles_in(scene) / 3 + 1});
        const RenderResult expected = Renderer(in_memory, ColorConfig::load(), settings).render();
        EXPECT_GT(mean_of(expected).value, 0) << name << ": the picture is black";
        RenderSettings elsewhere = settings;
        elsewhere.camera.camera_to_world[3] += elsewhere.camera.camera_to_world[2];
        const TemporaryFolder folder;
        SceneMeshes meshes(scene);
        paging::convert(meshes, folder / "scene.pages", {.bucket_triangles = 200, .limits = limits, .progress = {}});
        const auto source = std::make_shared<paging::PageFile>(folder / "scene.pages");
        const std::size_t page = paging::PagePool::slot_bytes(source->index());
        for (const std::size_t slots : {1, 5}) {
            PreparedScene paged(context, scene,
                                {.pages = source, .pool_bytes = [&](const SceneNeeds&) { return slots * page; }});
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
        return source->index();
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
    std::ranges::fill(coincident, std::array<vec3, 3>{vec3(0), vec3(0.15f, 0, 0), vec3(0, 0.15f, 0.05f)});
    for (int i = 0; i < 1000; ++i) {
        const vec3 at = place();
        many.push_back({at, at + vec3(0.02f, 0, 0.01f), at + vec3(0, 0.02f, 0)});
    }
    compare("needles across all pages", box_with(needles), exact);
    compare("20000 triangles in one place", box_with(coincident), exact, {});
    compare("1000 small triangles in a box of two triangles a wall", box_with(many), exact);
}

TEST_F(Paging, RayThroughAllPages) {
    // The triangles are left of and below the camera's axis, and their boxes are around it.
    std::vector<std::array<vec3, 3>> row;
    for (int i = 0; i < 1000; ++i) {
        const float z = -0.9f + 0.0015f * static_cast<float>(i);
        row.push_back({vec3(-0.3f, -0.3f, z), vec3(0.3f, -0.3f, z), vec3(-0.3f, 0.24f, z)});
    }
    const Scene scene = box_with(row);
    const paging::PageIndex index = compare("a ray through all pages", scene, exact);
    const vec3 eye(dvec3(scene.cameras[0].camera_to_world[3]) - index.origin);
    std::vector<bool> crossed(index.pages.size(), false);
    for (const paging::PageRoot& root : index.roots)
        if (glm::all(glm::lessThan(vec2(root.bounds.lower), vec2(eye))) &&
            glm::all(glm::lessThan(vec2(eye), vec2(root.bounds.upper))))
            crossed[root.page] = true;
    EXPECT_GT(crossed.size(), 30u);
    EXPECT_EQ(std::ranges::count(crossed, false), 0);
}

TEST_F(Paging, NoPages) {
    Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    for (Instance& instance : scene.instances) instance.moves = true;
    EXPECT_TRUE(compare("no page in the file: everything moves", scene, exact).pages.empty());
}

TEST_F(Paging, EndedWithinASample) {
    const Scene scene = textured_scene();
    const RenderSettings settings = settings_of(scene);
    const TemporaryFolder folder;
    SceneMeshes meshes(scene);
    paging::convert(meshes, folder / "scene.pages", {.bucket_triangles = 200, .limits = kSmallPages, .progress = {}});
    const auto source = std::make_shared<paging::PageFile>(folder / "scene.pages");
    const std::size_t page = paging::PagePool::slot_bytes(source->index());
    PreparedScene paged(context, scene, {.pages = source, .pool_bytes = [&](const SceneNeeds&) { return page; }});
    Renderer renderer(paged, ColorConfig::load(), settings);
    const RenderResult expected = renderer.render();
    struct Ended {};
    for (const int last : {1, 2, 7}) {
        int samples = 0, points = 0;
        {
            const Interruptible ends([&] {
                if (++points == last) throw Ended();
            });
            const auto count = [&](const RenderProgress&) { return ++samples > 0; };
            EXPECT_THROW(renderer.render(count), Ended);
        }
        EXPECT_EQ(samples, 0) << "the picture ended after a sample, not within the first";
        expect(fmt::format("after a picture that ended at point {}", last), pixels(renderer.render(), expected), 0,
               "pixels differ", exact);
    }
}

/// Returns a Cornell box with a glossy cube that moves, a cube of glass pane that deforms, and a lamp that moves.
Scene moving_box(double time) {
    Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    Material pane = diffuse_material({0.3f, 0.5f, 0.8f});
    pane.alpha_mode = AlphaMode::blend;
    pane.base_color.a = 0.5f;
    const int metal = add_material(scene, metal_material({0.4f, 0.6f, 0.9f}, 0.2f)), veil = add_material(scene, pane),
              lamp = add_material(scene, light_material({3, 1, 1}));
    const auto last_mesh = [&]() -> Mesh& { return scene.meshes.back(); };
    add_box(scene, metal, {-0.2f, -0.2f, -0.2f}, {0.2f, 0.2f, 0.2f});
    scene.instances.back().moves = true;
    scene.instances.back().object_to_world =
        glm::rotate(glm::translate(dmat4(1), dvec3(-0.5 + time, -0.3, 0.4)), time, dvec3(0.3, 1, 0.1));
    add_box(scene, veil, {0.1f, -0.9f, 0.5f}, {0.5f, -0.2f, 0.7f});
    last_mesh().deforms = true;
    for (vec3& p : last_mesh().positions) p.x += static_cast<float>(time) * (p.y + 0.9f);
    add_box(scene, lamp, {-0.8f, 0.2f, -0.2f}, {-0.7f, 0.3f, -0.1f});
    scene.instances.back().moves = true;
    scene.instances.back().object_to_world = glm::translate(dmat4(1), dvec3(0.3 * time, 0.4 * time, 0));
    return scene;
}

TEST_F(Paging, Motion) {
    const TemporaryFolder folder;
    const Scene rest = moving_box(0);
    SceneMeshes meshes(rest);
    paging::convert(meshes, folder / "box.pages", {.limits = kSmallPages, .progress = {}});
    const auto source = std::make_shared<paging::PageFile>(folder / "box.pages");
    RenderSettings settings = settings_of(rest);
    settings.aovs = {"ids", "depth", "normal", "albedo"};
    const std::vector<double> times = {0.7, 0.2, 0};
    std::vector<RenderResult> expected;
    PreparedScene in_memory(context, rest, {.most_in_part = triangles_in(rest) / 3 + 1});
    for (const double time : times) {
        in_memory.update(moving_box(time));
        expected.push_back(Renderer(in_memory, ColorConfig::load(), settings).render());
    }
    EXPECT_GT(pixels(expected[0], expected[1]), 100) << "nothing moves";
    const std::size_t page = paging::PagePool::slot_bytes(source->index());
    using Case = std::pair<std::size_t, paging::PageSchedule>;
    for (const auto& [slots, schedule] : {Case(1, paging::PageSchedule::set), Case(3, paging::PageSchedule::queries),
                                          Case(40, paging::PageSchedule::set)}) {
        settings.page_schedule = schedule;
        PreparedScene paged(context, rest,
                            {.pages = source, .pool_bytes = [&](const SceneNeeds&) { return slots * page; }});
        std::optional<Renderer> renderer;
        for (const std::size_t i : {0, 1, 0, 2, 2}) {
            const bool follows = paged.update(moving_box(times[i]));
            if (renderer && follows)
                renderer->follow_scene();
            else
                renderer.emplace(paged, ColorConfig::load(), settings);
            expect(fmt::format("things that move for {} s, pool of {} pages, schedule {}", times[i], slots,
                               name(schedule)),
                   pixels(renderer->render(), expected[i]), 0, "pixels differ", exact);
        }
        EXPECT_TRUE(paged.update(moving_box(0.4))) << "another pose took another renderer";
    }
    // Scenes whose still parts are not those of the pages are refused.
    Scene other = moving_box(0);
    other.instances.back().moves = false;
    EXPECT_NE(error_message([&] { PreparedScene(context, other, {.pages = source}); }).find("objects that do not move"),
              std::string::npos);
}

TEST_F(Paging, Scales) {
    const Scene room = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    // The room is 2 units wide, and 10^12 units when it is scaled up. Positions may be up to 2^40 units from the
    // centre.
    for (const double factor : {1e-12, 5e11})
        compare(fmt::format("room scaled by {:.0e}", factor), scaled(room, factor), exact);
    compare("room 10^7 units from the origin", moved(room, dvec3(1e7, -1e7, 3e6)), exact);
    Scene empty = room;
    empty.meshes.emplace_back();
    compare("a mesh without triangles beside a room", empty, exact);
}

}  // namespace
}  // namespace halflight::test
