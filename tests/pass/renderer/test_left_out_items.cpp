// Tests each left-out part alone: if it is built, pictures are equal bit for bit, so it would have contributed
// nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using Names = std::set<std::string>;

class LeftOutItemsTest : public GpuTest {
  protected:
    static Names left_out(const RenderResult& result) {
        Names names;
        for (const LeftOut& part : result.stats.left_out) names.insert(part.what);
        return names;
    }

    /// Keeps, one at a time, the left-out parts of the scene that no earlier scene has tested.
    void keep_each(const Scene& scene) {
        RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 3, 3);
        settings.pictures = 1;  // one picture, so that tile lists are left out
        std::erase(settings.aovs, "variance");
        const RenderResult lean = render(context, scene, settings);
        for (const std::string& item : left_out(lean)) {
            if (std::ranges::find(todo, item) == todo.end()) continue;
            SCOPED_TRACE(item);
            settings.kept = Kept({item});
            const RenderResult kept = render(context, scene, settings);
            expect_same(kept, lean);
            EXPECT_FALSE(left_out(kept).contains(item));
            std::erase(todo, item);
        }
    }

    std::vector<std::string> todo = keepable_names();
};

TEST_F(LeftOutItemsTest, EachChangesNothing) {
    Scene glowing = tilted_quad();  // each triangle of this emissive quad is a light
    glowing.meshes[0].triangles.resize(1);
    glowing.meshes[0].triangle_material.resize(1);
    glowing.cameras = {camera_on_quad()};
    Scene metal = tilted_quad();
    metal.materials[0] = metal_material({0.9f, 0.7f, 0.4f}, 0.3f);
    metal.environment.color = {0.5f, 0.7f, 0.9f};
    metal.cameras = {camera_on_quad()};
    Scene unlit = tilted_quad();
    unlit.materials[0].unlit = true;
    unlit.cameras = {camera_on_quad()};
    const std::pair<const char*, Scene> scenes[] = {{"a diffuse box", cornell_box()},
                                                    {"a glowing triangle", glowing},
                                                    {"a metal in the sky", metal},
                                                    {"nothing that reflects", unlit}};
    for (const auto& [name, scene] : scenes) {
        SCOPED_TRACE(name);
        keep_each(scene);
    }
    EXPECT_EQ(todo, std::vector<std::string>()) << "no scene leaves these out";
}

}  // namespace
}  // namespace halflight::test
