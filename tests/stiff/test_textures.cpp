// Tests gradients of textures that are finer than 8 bits against closed forms.
#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/scene/srgb.h"
#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Textures : public StiffTest {
  protected:
    static constexpr int kSize = 64;  // texels and pixels along a side
    static constexpr double kAlbedo = 0.5, kElevation = 10 * kPi / 180;

    /// Returns an image whose columns have the value of `of` at their centres, x in [0, 1].
    static TextureImage columns(bool deep, const std::function<std::array<double, 3>(double)>& of) {
        TextureImage image{.name = "columns", .width = kSize, .height = 1, .rgba = {}, .deep = deep};
        for (int x = 0; x < kSize; ++x) {
            const auto [r, g, b] = of((x + 0.5) / kSize);
            std::array<std::uint8_t, 8> bytes;
            for (std::size_t c = 0; const double value : {r, g, b, 1.0}) {
                const auto code = static_cast<unsigned>(std::lround(value * image.largest()));
                bytes[c] = static_cast<std::uint8_t>(deep ? code >> 8 : code);
                bytes[c++ + 4] = static_cast<std::uint8_t>(code & 255);
            }
            image.rgba.edit().insert(image.rgba.edit().end(), bytes.begin(), bytes.begin() + (deep ? 8 : 4));
        }
        return image;
    }

    /// Renders a wall that a camera looks at from the front, and returns the largest error of a column, relative to the
    /// largest of the exact radiances. A distant light of 1 lux comes from the right, 10 degrees above the wall.
    double error_of(TextureRef Material::*slot, double albedo, const TextureImage& image,
                    const std::function<double(double)>& exact, PrimaryVisibility primary) {
        Scene scene;
        Material material = diffuse_material(vec3(float(albedo)));
        (material.*slot) = {.image = 0, .wrap_u = Wrap::clamp_to_edge};
        scene.images = {image};
        add_quad(scene, add_material(scene, material), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
        Mesh& mesh = scene.meshes[0];
        mesh.tangents.assign(mesh.positions.size(), vec4(1, 0, 0, 1));
        PunctualLight& sun = scene.lights.emplace_back();
        sun.type = LightType::directional;
        sun.direction = {-std::cos(kElevation), 0, -std::sin(kElevation)};
        sun.intensity = vec3(1);
        Camera& camera = scene.cameras.emplace_back();
        camera.orthographic = true;
        camera.ortho_height = 2.0 * 4 / kSize;
        camera.camera_to_world[3] = {0, 0, 1, 1};
        RenderSettings settings = small_settings(camera, kSize, 4, 256, 1);
        settings.primary = primary;
        const Image beauty = picture(scene, settings).beauty;
        double worst = 0, largest = 0;
        for (int x = 4; x < kSize - 4; ++x) {  // the outer texels are clamped
            const double value = exact((x + 0.5) / kSize);
            worst = std::max(worst, std::abs(*beauty.at(x, 2) - value));
            largest = std::max(largest, value);
        }
        return worst / largest;
    }
};

TEST_F(Textures, GradientsOfSixteenBits) {
    // Normals that lean by 0.02 to both sides, as a brushed or wavy surface has them.
    const auto lean = [](double x) { return 0.02 * (2 * x - 1); };
    const auto normal = [&](double x) { return std::array{0.5 + 0.5 * lean(x), 32768 / 65535.0, 1.0}; };
    const auto lit = [&](double x) {
        const double cosine = (lean(x) * std::cos(kElevation) + std::sin(kElevation)) / std::hypot(1, lean(x));
        return kAlbedo / kPi * cosine;
    };
    // Base colours from 0 to 1/250.
    const auto dark = [](double x) { return 0.004 * x; };
    const auto color = [&](double x) {
        const double code = linear_to_srgb(dark(x));
        return std::array{code, code, code};
    };
    const auto seen = [&](double x) { return dark(x) / kPi * std::sin(kElevation); };
    for (const auto& [primary, name] :
         {std::pair(PrimaryVisibility::raster, "rasterized"), {PrimaryVisibility::traced, "traced"}}) {
        const auto errors = [&](bool deep) {
            return std::array{error_of(&Material::normal_texture, kAlbedo, columns(deep, normal), lit, primary),
                              error_of(&Material::base_color_texture, 1, columns(deep, color), seen, primary)};
        };
        const auto fine = errors(true), coarse = errors(false);
        expect(fmt::format("gradient of normals under grazing light, {}", name), fine[0], 2e-3, "of the radiance",
               "a column spans 0.4 % of it, which 256 samples average; 8 bits leave 1 %");
        expect(fmt::format("gradient of dark base colours, {}", name), fine[1], 2e-3, "of the largest radiance",
               "half floats have 2^-12; a column spans 1.6 %, which 256 samples average; 8 bits leave 3 %");
        EXPECT_GT(coarse[0], 4 * fine[0]);
        EXPECT_GT(coarse[1], 4 * fine[1]);
    }
}

}  // namespace
}  // namespace halflight::test
