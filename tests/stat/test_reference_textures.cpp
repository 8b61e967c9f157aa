// Tests the oracle's texture lookups, and the effect of each texture of a material.
#include "engine/reference/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/reference/surface.h"
#include "tests/support/scenes.h"

namespace halflight::reference {
namespace {

/// Returns an image of 4 x 2 texels with R = 10 column + 100 row, all below 255.
Scene ramp() {
    Scene scene;
    TextureImage image{"ramp", 4, 2, {}};
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 4; ++x)
            image.rgba.edit().insert(image.rgba.edit().end(), {std::uint8_t(10 * x + 100 * y), 51, 102, 204});
    }
    scene.images.push_back(image);
    return scene;
}

double red(const Scene& scene, const TextureRef& ref, double u, double v) {
    return 255 * sample_texture(scene, ref, {u, v}, Encoding::linear).r;
}

TEST(ReferenceTextures, BilinearAboutTexelCentres) {
    const Scene scene = ramp();
    TextureRef ref;
    ref.image = 0;
    EXPECT_NEAR(red(scene, ref, 1.5 / 4, 0.25), 10, 1e-12);  // the point is the centre of a texel
    EXPECT_NEAR(red(scene, ref, 2.0 / 4, 0.25), 15, 1e-12);
    EXPECT_NEAR(red(scene, ref, 1.75 / 4, 0.5), 62.5, 1e-12);
    ref.nearest = true;
    EXPECT_NEAR(red(scene, ref, 1.99 / 4, 0.49), 10, 1e-12);
    EXPECT_NEAR(red(scene, ref, 2.0 / 4, 0.5), 120, 1e-12);
}

TEST(ReferenceTextures, WrapsAsOpenGL) {
    const Scene scene = ramp();
    TextureRef ref;
    ref.image = 0;
    ref.wrap_v = Wrap::clamp_to_edge;
    EXPECT_NEAR(red(scene, ref, 0, -3), 15, 1e-12);  // the point is between columns 3 and 0
    EXPECT_NEAR(red(scene, ref, 7, 5), 115, 1e-12);
    EXPECT_NEAR(red(scene, ref, -2 + 1.5 / 4, 0), 10, 1e-12);
    ref.wrap_u = Wrap::mirrored_repeat;
    EXPECT_NEAR(red(scene, ref, 0, 0), 0, 1e-12);
    EXPECT_NEAR(red(scene, ref, -0.5 / 4, 0), 0, 1e-12);
    EXPECT_NEAR(red(scene, ref, 1 + 1.5 / 4, 0), 20, 1e-12);
    EXPECT_NEAR(red(scene, ref, 2 + 1.5 / 4, 0), 10, 1e-12);
    ref.wrap_u = Wrap::clamp_to_edge;
    EXPECT_NEAR(red(scene, ref, 1e30, 0), 30, 1e-12);
    ref.wrap_u = Wrap::repeat;
    EXPECT_TRUE(std::isfinite(red(scene, ref, INFINITY, 1e300)));
}

TEST(ReferenceTextures, TransformsAndDecodes) {
    const Scene scene = ramp();
    TextureRef ref;
    ref.image = 0;
    ref.uv_transform = glm::mat3x2(vec2(0, 1), vec2(0.5f, 0), vec2(0.125f, 0.25f));  // u = t / 2 + 1/8, v = s + 1/4
    EXPECT_NEAR(red(scene, ref, 0, 0.5), 10, 1e-5);
    EXPECT_NEAR(red(scene, ref, 0.5, 0.5), 110, 1e-5);
    const dvec4 decoded = sample_texture(scene, ref, {0, 0}, Encoding::srgb);
    EXPECT_NEAR(decoded.g, std::pow((0.2 + 0.055) / 1.055, 2.4), 1e-12);
    EXPECT_NEAR(decoded.a, 0.8, 1e-12);
}

TEST(ReferenceTextures, SixteenBits) {
    Scene scene;
    TextureImage image{.name = "deep", .width = 2, .height = 1, .rgba = {}, .deep = true};
    image.rgba = {0x12, 0, 0, 0xff, 0x34, 1, 2, 0xff, 0x12, 0, 0, 0x80, 0x36, 3, 4, 0};
    scene.images.push_back(image);
    TextureRef ref;
    ref.image = 0;
    const dvec4 data = sample_texture(scene, ref, {0.5, 0.5}, Encoding::linear) * 65535.0;
    EXPECT_NEAR(data.r, 0x1235, 1e-9);
    EXPECT_NEAR(data.g, 2, 1e-9);
    EXPECT_NEAR(data.b, 3, 1e-9);
    EXPECT_NEAR(data.a, (0xffff + 0x8000) / 2.0, 1e-9);
    const dvec4 color = sample_texture(scene, ref, {0.25, 0.5}, Encoding::srgb);
    EXPECT_NEAR(color.r, std::pow((0x1234 / 65535.0 + 0.055) / 1.055, 2.4), 1e-12);
    EXPECT_NEAR(color.g, 1 / 65535.0 / 12.92, 1e-15);
    EXPECT_NEAR(color.a, 1, 1e-15);
}

/// Returns the surface where a vertical ray hits a textured quad in the plane z = 0.
Surface surface_of(const Material& material, std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a) {
    Scene scene;
    scene.images.push_back({"flat", 1, 1, {r, g, b, a}});
    test::add_quad(scene, test::add_material(scene, material), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    scene.meshes[0].tangents.assign(4, vec4(1, 0, 0, 1));
    const Tracer tracer(scene);
    const auto hit = tracer.closest_hit({{0.25, 0.125, 1}, {0, 0, -1}}, {});
    return make_surface(tracer, hit.value(), {0, 0, 1});
}

TEST(ReferenceTextures, AffectTheirParameters) {
    TextureRef texture;
    texture.image = 0;
    const double srgb_half = std::pow((128 / 255.0 + 0.055) / 1.055, 2.4);
    Material m;
    m.base_color = {1, 0.5f, 1, 1};
    m.emission = {2, 2, 2};
    m.clearcoat = m.transmission = m.clearcoat_roughness = 1;
    for (TextureRef* ref :
         {&m.base_color_texture, &m.metallic_roughness_texture, &m.emission_texture, &m.specular_texture,
          &m.specular_color_texture, &m.clearcoat_texture, &m.transmission_texture, &m.clearcoat_roughness_texture})
        *ref = texture;
    const Surface s = surface_of(m, 51, 128, 102, 77);
    EXPECT_NEAR(s.parameters.base_color.g, 0.5 * srgb_half, 1e-7);
    EXPECT_NEAR(s.parameters.roughness, 128 / 255.0, 1e-7);
    EXPECT_NEAR(s.parameters.metallic, 0.4, 1e-7);
    EXPECT_NEAR(s.emitted.y, 2 * srgb_half, 1e-7);
    EXPECT_NEAR(s.parameters.specular, 77 / 255.0, 1e-7);
    EXPECT_NEAR(s.parameters.specular_color.g, srgb_half, 1e-7);
    EXPECT_NEAR(s.parameters.clearcoat, 0.2, 1e-7);
    EXPECT_NEAR(s.parameters.transmission, 0.2, 1e-7);
    EXPECT_NEAR(s.parameters.clearcoat_roughness, 128 / 255.0, 1e-7);
}

TEST(ReferenceTextures, NormalMapsTiltTheirOwnNormal) {
    Material m;
    m.normal_texture.image = 0;
    m.normal_scale = 0.5f;
    const dvec3 texel = dvec3(204, 51, 230) / 255.0 * 2.0 - 1.0;
    Surface s = surface_of(m, 204, 51, 230, 255);
    EXPECT_NEAR(length(s.n - normalize(texel * dvec3(0.5, 0.5, 1))), 0, 1e-7);
    EXPECT_EQ(s.n_k, dvec3(0, 0, 1));
    std::swap(m.normal_texture, m.clearcoat_normal_texture);
    s = surface_of(m, 204, 51, 230, 255);
    EXPECT_NEAR(length(s.n_k - normalize(texel)), 0, 1e-7);
    EXPECT_EQ(s.n, dvec3(0, 0, 1));
    // A normal below the horizon is bent towards the viewer.
    std::swap(m.normal_texture, m.clearcoat_normal_texture);
    s = surface_of(m, 255, 128, 0, 255);
    EXPECT_GT(s.n.z, 0);
    EXPECT_LT(s.n.z, 1e-2);
}

}  // namespace
}  // namespace halflight::reference
