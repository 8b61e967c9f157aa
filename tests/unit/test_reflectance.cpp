// Of how much of a scene's area light leaves otherwise than diffusely.
#include "engine/scene/reflectance.h"

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace halflight::test {
namespace {

TEST(GlossyShare, IsByArea) {
    Scene scene;
    EXPECT_EQ(glossy_share(scene), 0);
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {0, 0, 0}, {3, 0, 0}, {0, 1, 0});
    EXPECT_EQ(glossy_share(scene), 0);
    const int metal = add_material(scene, metal_material(vec3(0.5f), 0.3f));
    add_quad(scene, metal, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    EXPECT_NEAR(glossy_share(scene), 0.25, 1e-12);
    scene.instances.back().object_to_world = dmat4(2.0);
    EXPECT_NEAR(glossy_share(scene), 4.0 / 7, 1e-12);
}

TEST(GlossyShare, IsMetalAndWhatTransmits) {
    Scene scene;
    const int material = add_material(scene, metal_material(vec3(1), 0));
    add_quad(scene, material, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    Material& m = scene.materials.front();
    EXPECT_EQ(glossy_share(scene), 1);
    m.metallic = 0.5f;
    m.transmission = 0.5f;
    EXPECT_NEAR(glossy_share(scene), 0.75, 1e-12);
    scene.images.push_back({"half metal", 2, 1, {0, 0, 255, 255, 0, 0, 0, 255}});
    m.metallic_roughness_texture.image = 0;
    EXPECT_NEAR(glossy_share(scene), 0.25 + 0.75 * 0.5, 1e-12);
    m.transmission_texture.image = 0;  // black where transmission is read
    EXPECT_NEAR(glossy_share(scene), 0.25, 1e-12);
    m.clearcoat = 1;
    EXPECT_NEAR(glossy_share(scene), 0.25, 1e-12);
    m.unlit = true;
    EXPECT_EQ(glossy_share(scene), 0);
}

}  // namespace
}  // namespace halflight::test
