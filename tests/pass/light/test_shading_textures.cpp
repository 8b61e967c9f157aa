// Tests texture lookups against a bilinear filter in double, and materials that read them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/tables/light_textures.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

TextureImage random_image(int width, int height, unsigned seed, bool deep = false) {
    TextureImage image{.name = "random", .width = width, .height = height, .rgba = {}, .deep = deep};
    std::mt19937 random(seed);
    for (int i = 0; i < 4 * image.pitch() * height; ++i)
        image.rgba.edit().push_back(static_cast<std::uint8_t>(random() >> 24));
    return image;
}

template <int N, class T>
double largest(const glm::vec<N, T>& v) {
    double value = v[0];
    for (int k = 1; k < N; ++k) value = std::max(value, double(v[k]));
    return value;
}

int wrapped(long long i, int size, Wrap wrap) {
    const auto modulo = [](long long a, long long b) { return ((a % b) + b) % b; };
    if (wrap == Wrap::repeat) return static_cast<int>(modulo(i, size));
    if (wrap == Wrap::clamp_to_edge) return static_cast<int>(std::clamp<long long>(i, 0, size - 1));
    const long long m = modulo(i, 2LL * size);
    return static_cast<int>(m < size ? m : 2 * size - 1 - m);
}

/// Returns a texture lookup as defined by SHADING.md, in texel space.
dvec4 lookup(const TextureImage& image, const TextureRef& ref, const vec2& uv0, const vec2& uv1, bool color) {
    const vec2 uv = ref.uv_transform * vec3(ref.uv_set == 0 ? uv0 : uv1, 1);
    const dvec2 at = dvec2(uv) * dvec2(image.width, image.height) - (ref.nearest ? 0.0 : 0.5);
    const dvec2 cell = glm::floor(at);
    const dvec2 f = ref.nearest ? dvec2(0) : at - cell;
    dvec4 sum(0);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int x = wrapped(static_cast<long long>(cell.x) + i, image.width, ref.wrap_u);
            const int y = wrapped(static_cast<long long>(cell.y) + j, image.height, ref.wrap_v);
            const std::uint8_t* texel =
                &image.rgba[image.texel_bytes() * static_cast<std::size_t>(y * image.width + x)];
            dvec4 value;
            for (int k = 0; k < 4; ++k) {
                value[k] = double(image.code(texel, static_cast<std::size_t>(k))) / image.largest();
                if (color && k < 3) value[k] = srgb_to_linear(value[k]);
            }
            sum += (i == 0 ? 1 - f.x : f.x) * (j == 0 ? 1 - f.y : f.y) * value;
        }
    }
    return sum;
}

struct Sampling {
    Wrap u, v;
    bool nearest;
};

class ShadingTextures : public GpuTest {
  protected:
    /// Compares lookups of a scene with one material for each kind of sampling.
    static void expect_lookups(const std::vector<Sampling>& kinds, bool deep = false) {
        Scene scene = triangle_scene({});
        scene.materials.resize(kinds.size());
        scene.images = {random_image(5, 1, 3, deep), random_image(13, 7, 1, deep)};
        scene.meshes[0].triangles.assign(kinds.size(), {0, 1, 2});
        for (std::size_t k = 0; k < kinds.size(); ++k) {
            const auto& [u, v, nearest] = kinds[k];
            scene.meshes[0].triangle_material.resize(k + 1, static_cast<std::uint32_t>(k));
            TextureRef& color = scene.materials[k].base_color_texture;
            color = {.image = 1, .uv_set = 1, .wrap_u = u, .wrap_v = v, .nearest = nearest};
            color.uv_transform = glm::mat3x2(vec2(0.8f, -0.3f), vec2(0.4f, 1.1f), vec2(0.1f, -0.7f));
            scene.materials[k].metallic_roughness_texture = {.image = 0, .wrap_u = u, .wrap_v = v, .nearest = nearest};
        }
        const ShadingScene shading(scene);
        std::mt19937 random(2);
        const auto uniform = [&](double most) { return static_cast<float>(most * (2 * (random() * 0x1p-32) - 1)); };
        constexpr std::size_t kUvs = 1024;
        std::vector<vec4> uvs(kUvs * kinds.size());
        for (std::size_t i = 0; i < uvs.size(); ++i) {
            const double range = i % 4 == 0 ? 50 : i % 4 == 1 ? 1 : 3;
            uvs[i] = vec4(uniform(range), uniform(range), uniform(2), uniform(2));
            if (i % 16 == 2) uvs[i] = glm::round(uvs[i]);  // lookup on texel borders and on seams of the wraps
            if (i % kUvs == 0) uvs[i] = vec4(-1e-9f);
        }
        const auto found = shading.run("#include \"shaders/lib/material.glsl\"", R"(
            result[0] = color_texture(base_color_texture_slot(i / 1024u), inputs[i].xy, inputs[i].zw);
            result[1] = data_texture(metallic_roughness_texture_slot(i / 1024u), inputs[i].xy, inputs[i].zw);
        )",
                                       static_cast<std::uint32_t>(uvs.size()), 2, uvs);
        int off = 0;
        for (std::size_t i = 0; i < uvs.size(); ++i) {
            const Material& m = scene.materials[i / kUvs];
            const vec2 uv0(uvs[i]), uv1(uvs[i].z, uvs[i].w);
            const dvec4 color = lookup(scene.images[1], m.base_color_texture, uv0, uv1, true);
            const dvec4 data = lookup(scene.images[0], m.metallic_roughness_texture, uv0, uv1, false);
            // Half floats have errors of 2^-12. Coordinates of 50 have errors of 50 * 2^-24 * 13 texels = 4e-5.
            const double worst = std::max(largest(glm::abs(dvec4(found[2 * i]) - color)) - 0x1p-12,
                                          largest(glm::abs(dvec4(found[2 * i + 1]) - data)));
            if (worst > 2e-4) ++off;
            // A nearest lookup on a border may use either texel.
            if (!m.base_color_texture.nearest || i % 16 != 2) {
                ASSERT_LT(worst, 2e-4) << uvs[i].x << ' ' << uvs[i].y << ' ' << uvs[i].z << ' ' << uvs[i].w << ' '
                                       << int(kinds[i / kUvs].u) << int(kinds[i / kUvs].v) << kinds[i / kUvs].nearest;
            }
        }
        EXPECT_LT(off, int(uvs.size()) / 16);
    }
};

TEST_F(ShadingTextures, EveryWrapFilterAndTransform) {
    std::vector<Sampling> all;
    for (const Wrap u : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge}) {
        for (const Wrap v : {Wrap::repeat, Wrap::mirrored_repeat, Wrap::clamp_to_edge})
            for (const bool nearest : {false, true}) all.push_back({u, v, nearest});
        expect_lookups({{u, u, false}});  // shaders that leave out the other kinds
    }
    expect_lookups(all);
    expect_lookups(all, true);
}

/// Steps of 1/65535 stay apart in data. Colours are half floats, with 2^-11 of their value at most.
TEST_F(ShadingTextures, SixteenBitsHaveNoBands) {
    constexpr int kWidth = 600;
    const auto ramp = [](int width, bool deep) {
        TextureImage image{.name = "ramp", .width = width, .height = 1, .rgba = {}, .deep = deep};
        for (int x = 0; x < width; ++x) {
            const int code = 30000 + x, dark = 7 * x;
            for (const int byte :
                 {code >> 8, code >> 8, dark >> 8, dark >> 8, code & 255, code & 255, dark & 255, dark & 255})
                image.rgba.edit().push_back(static_cast<std::uint8_t>(byte));
        }
        return image;
    };
    Scene scene = triangle_scene({});
    // An image of 8 bits lies before, so that texels begin at an odd place of the pool.
    scene.images = {random_image(3, 1, 1), ramp(kWidth, true)};
    scene.materials[0].metallic_roughness_texture = {.image = 0};
    scene.materials[0].specular_texture = {.image = 1};
    scene.materials[0].base_color_texture = {.image = 1};
    const ShadingScene shading(scene);
    std::vector<vec4> uvs;
    for (int x = 0; x + 1 < kWidth; ++x)
        for (const double at : {0.5, 0.75}) uvs.emplace_back((x + at) / kWidth, 0.5, 0, 0);
    const auto found = shading.run("#include \"shaders/lib/material.glsl\"", R"(
        result[0] = color_texture(base_color_texture_slot(0u), inputs[i].xy, inputs[i].xy);
        result[1] = data_texture(specular_texture_slot(0u), inputs[i].xy, inputs[i].xy);
    )",
                                   static_cast<std::uint32_t>(uvs.size()), 2, uvs);
    for (std::size_t i = 0; i < uvs.size(); ++i) {
        // Coordinates have errors of 2^-24 of the width.
        const double x = double(uvs[i].x) * kWidth - 0.5;
        EXPECT_NEAR(65535 * double(found[2 * i + 1].r), 30000 + x, 0.01) << i;
        const double left = srgb_to_linear(7 * std::floor(x) / 65535), right = srgb_to_linear(7 * std::ceil(x) / 65535);
        const double exact = left + (right - left) * (x - std::floor(x));
        EXPECT_NEAR(double(found[2 * i].b), exact, 0x1p-11 * exact + 0x1p-25) << i;
    }
}

TEST_F(ShadingTextures, NonFiniteCoordinatesStayInThePool) {
    Scene scene = triangle_scene({});
    scene.images = {random_image(4, 4, 1)};
    scene.materials[0].base_color_texture.image = 0;
    const ShadingScene shading(scene);
    const float nan = std::nanf("");
    const auto found =
        shading.run("#include \"shaders/lib/texture.glsl\"",
                    "TexelFootprint f = texture_footprint(0u, inputs[i].xy, inputs[i].xy, 0);"
                    "result[0] = vec4(f.texel);",
                    3, 1, {vec4(nan, nan, 0, 0), vec4(kInfinity, -kInfinity, 0, 0), vec4(1e38f, -1e38f, 0, 0)});
    for (const vec4& texels : found) {
        for (int k = 0; k < 4; ++k) EXPECT_TRUE(texels[k] >= 0 && texels[k] < 16) << texels[k];
    }
}

TEST_F(ShadingTextures, MaterialsReadTheirSlots) {
    Material m;
    m.base_color = vec4(0.5f, 0.6f, 0.7f, 1);
    m.metallic = 0.9f;
    m.roughness = 0.8f;
    m.emission = vec3(2, 3, 4);
    m.specular = 0.7f;
    m.specular_color = vec3(0.5f, 1, 2);
    m.clearcoat = 0.6f;
    m.clearcoat_roughness = 0.5f;
    m.transmission = 0.4f;
    m.ior = 2;
    m.anisotropy_strength = 0.5f;
    m.iridescence = 0.75f;
    m.iridescence_thickness_maximum = 600;
    m.diffuse_transmission = 0.875f;
    m.diffuse_transmission_color = {1, 0.5f, 0.25f};
    m.anisotropy_rotation = 0.75f;
    m.normal_scale = 0.5f;
    Scene scene = triangle_scene(m);
    // A texture of one texel gives the same value for every lookup.
    const auto add = [&](std::array<std::uint8_t, 4> texel) {
        scene.images.push_back({"texel", 1, 1, {texel[0], texel[1], texel[2], texel[3]}});
        return TextureRef{.image = static_cast<int>(scene.images.size()) - 1};
    };
    Material& t = scene.materials[0];
    t.base_color_texture = add({200, 100, 50, 255});
    t.metallic_roughness_texture = add({0, 51, 102, 0});
    t.normal_texture = add({192, 64, 230, 0});
    t.emission_texture = add({10, 20, 30, 0});
    t.specular_texture = add({0, 0, 0, 153});
    t.specular_color_texture = add({255, 128, 64, 0});
    t.clearcoat_texture = add({204, 0, 0, 0});
    t.clearcoat_roughness_texture = add({0, 25, 0, 0});
    t.clearcoat_normal_texture = add({128, 255, 128, 0});
    t.transmission_texture = add({127, 0, 0, 0});
    t.anisotropy_texture = add({204, 51, 102, 0});
    t.iridescence_texture = add({102, 0, 0, 0});
    t.iridescence_thickness_texture = add({0, 51, 0, 0});
    t.diffuse_transmission_texture = add({0, 0, 0, 153});
    t.diffuse_transmission_color_texture = add({60, 120, 180, 0});
    scene.meshes[0].colors.assign(3, vec4(0.5f, 0.25f, 1, 1));
    const ShadingScene shading(scene);
    const auto found = shading.run("#include \"shaders/lib/material.glsl\"", R"(
        Hit hit;
        hit.t = 1.0; hit.u = 0.2; hit.v = 0.3; hit.triangle = 0u; hit.instance = 0u;
        vec3 wo = i == 0u ? vec3(0.0, 0.0, 1.0) : vec3(0.0, 0.0, -1.0);
        Material m = evaluate_material(surface_at(hit, -wo), wo);
        result[0] = vec4(m.base_color, m.metallic);
        result[1] = vec4(m.emission, m.roughness);
        result[2] = vec4(m.normal, m.specular);
        result[3] = vec4(m.specular_color, m.dielectric_f0);
        result[4] = vec4(m.coat_normal, m.coat);
        result[5] = vec4(m.coat_roughness, m.transmission, m.anisotropy, dot(m.rough_direction, m.normal));
        result[6] = vec4(m.rough_direction, 0.0);
        result[7] = vec4(m.iridescence, m.film_ior, m.film_thickness + m.film_thickness_range, 0.0);
        result[8] = vec4(m.diffuse_transmission_color, m.diffuse_transmission);
    )",
                                   2, 9);
    const auto srgb = [](int r, int g, int b) {
        return vec3(srgb_to_linear(std::uint8_t(r)), srgb_to_linear(std::uint8_t(g)), srgb_to_linear(std::uint8_t(b)));
    };
    const auto near = [](const vec3& a, const vec3& b) { return largest(glm::abs(a - b)) < 1e-3f; };
    const auto mapped = [](vec3 texel, float scale) {
        const vec3 n = 2.0f * texel / 255.0f - 1.0f;
        return glm::normalize(vec3(scale * n.x, scale * n.y, n.z));
    };
    for (std::size_t side = 0; side < 2; ++side) {
        const vec4* r = &found[9 * side];
        const float sign = side == 0 ? 1.0f : -1.0f;
        // The normal map bends normals equally on both sides; normals of the back side are reversed.
        const vec3 n = sign * mapped({192, 64, 230}, 0.5f);
        EXPECT_TRUE(near(vec3(r[0]), vec3(m.base_color) * srgb(200, 100, 50) * vec3(0.5f, 0.25f, 1)));
        EXPECT_TRUE(near(vec3(r[1]), m.emission * srgb(10, 20, 30)));
        EXPECT_TRUE(near(vec3(r[2]), n)) << r[2].x << ' ' << r[2].y << ' ' << r[2].z;
        EXPECT_TRUE(near(vec3(r[3]), m.specular_color * srgb(255, 128, 64)));
        EXPECT_TRUE(near(vec3(r[8]), m.diffuse_transmission_color * srgb(60, 120, 180)));
        const struct {
            const char* what;
            float found;
            double expected, tolerance = 1e-6;
        } values[] = {{"metallic", r[0].w, 0.9 * 102 / 255},
                      {"roughness", r[1].w, 0.8 * 51 / 255},
                      {"specular", r[2].w, 0.7 * 153 / 255},
                      {"dielectric_f0", r[3].w, 1 / 9.0},
                      {"clearcoat", r[4].w, 0.6 * 204 / 255},
                      {"clearcoat roughness", r[5].x, 0.5 * 25 / 255},
                      {"transmission", r[5].y, 0.4 * 127 / 255},
                      {"anisotropy", r[5].z, 0.5 * 102 / 255},
                      {"rough direction along the normal", r[5].w, 0},
                      {"iridescence", r[7].x, 0.75 * 102 / 255},
                      {"film's index", r[7].y, 1.3},
                      {"film's thickness", r[7].z, 100 + 500 * 51 / 255, 1e-3},
                      {"diffuse transmission", r[8].w, 0.875 * 153 / 255}};
        for (const auto& v : values) EXPECT_NEAR(v.found, v.expected, v.tolerance) << v.what << ", side " << side;
        // The texture's direction (0.6, -0.6) is turned by the rotation, and projected along the mapped normal.
        const double angle = -kPi / 4 + 0.75;
        const vec3 along(std::cos(angle), std::sin(angle), 0), rough = glm::normalize(along - glm::dot(along, n) * n);
        EXPECT_NEAR(std::abs(glm::dot(vec3(r[6]), rough)), 1, 1e-5);
        // The coat's normal is almost in the surface plane, so it is bent towards wo.
        EXPECT_GT(sign * r[4].z, 0);
    }
}

TEST_F(ShadingTextures, AlphaDecidesByMaskAndBySample) {
    Material m;
    m.base_color.a = 0.5f;
    m.alpha_mode = AlphaMode::blend;
    Scene scene = triangle_scene(m);
    scene.images = {random_image(8, 8, 4)};
    scene.materials[0].base_color_texture.image = 0;
    scene.meshes[0].colors.assign(3, vec4(1, 1, 1, 0.8f));
    const char* const kBody = R"(
        float sum = 0.0;
        float repeated = 0.0;
        vec2 at = vec2(0.1 + 0.05 * float(i), 0.2);
        for (uint n = 0u; n < 4096u; ++n) {
            bool hit = alpha_accept(0u, 0u, 3u, at.x, at.y, Sampler(i, n));
            sum += hit ? 1.0 : 0.0;
            repeated += hit == alpha_accept(0u, 0u, 3u, at.x, at.y, Sampler(i, n)) ? 0.0 : 1.0;
        }
        result[0] = vec4(sum / 4096.0, alpha_share(0u, at.x, at.y), repeated, 0.0);
    )";
    const auto blended = ShadingScene(scene).run("#include \"shaders/lib/alpha.glsl\"", kBody, 8);
    for (std::size_t i = 0; i < blended.size(); ++i) {
        const vec2 uv(0.1f + 0.05f * float(i), 0.2f);
        const double alpha =
            0.5 * 0.8f * lookup(scene.images[0], scene.materials[0].base_color_texture, uv, uv, true).w;
        EXPECT_NEAR(blended[i].y, alpha, 1e-3);
        EXPECT_NEAR(blended[i].x, blended[i].y, 1.0 / 4096) << "samples are stratified";
        EXPECT_EQ(blended[i].z, 0);
    }
    scene.materials[0].alpha_mode = AlphaMode::mask;
    scene.materials[0].alpha_cutoff = 0.2f;
    const auto masked = ShadingScene(scene).run("#include \"shaders/lib/alpha.glsl\"", kBody, 8);
    for (std::size_t i = 0; i < masked.size(); ++i) {
        const float expected = blended[i].y >= 0.2f ? 1.0f : 0.0f;
        EXPECT_EQ(masked[i].x, expected);
        EXPECT_EQ(masked[i].y, expected);
    }
}

}  // namespace
}  // namespace halflight
