// Tests denoised pictures of mirrors and glass whose specular chains are extreme: longer than the limit, into nothing,
// at the limit of roughness.
#include <algorithm>
#include <cmath>

#include "shaders/shared/chain_records.h"
#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Mirrors : public StiffTest {
  protected:
    RenderResult denoised(const Scene& scene, const Camera& camera, int size, int samples, int bounces) {
        RenderSettings settings = small_settings(camera, size, size, samples, bounces);
        settings.denoise = true;
        return picture(scene, settings);
    }
    /// Expects that a picture under a white sky is white, as far as its noisy one is.
    void expect_white(const std::string& name, const Scene& scene, const Camera& camera, int samples, double radiance) {
        const double noisy = most_off(picture(scene, small_settings(camera, 32, 32, samples, 64)).beauty, radiance);
        expect(name, most_off(denoised(scene, camera, 32, samples, 64).beauty, radiance), noisy + 1e-4, "radiance",
               "the noisy picture's own loss, by rough mirrors and by paths of more than 64 bounces");
    }
    /// Returns the largest difference of the first channel from `value`.
    static double most_off(const Image& image, double value) {
        double most = 0;
        for (std::size_t i = 0; i < image.pixels.size(); i += std::size_t(image.channels))
            most = std::max(most, std::abs(double{image.pixels[i]} - value));
        return most;
    }
    static double brightest(const RenderResult& result) { return most_off(result.beauty, 0); }
};

TEST_F(Mirrors, LightIsKept) {
    // A lamp of radiance 2 surrounds white mirrors, so that every pixel is 2, whatever its chain shows.
    for (const float roughness :
         {0.0f, shared::kMostSharpRoughness, std::nextafter(shared::kMostSharpRoughness, 1.0f)}) {
        Scene scene;
        scene.environment.color = vec3(2);
        const int mirror = add_material(scene, metal_material(vec3(1), roughness));
        add_quad(scene, mirror, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
        add_quad(scene, mirror, {-1, 0.5f, -1}, {2, 0, 0}, {0, 0, 2});
        expect_white(fmt::format("mirrors face each other, roughness {:.9g}", roughness), scene,
                     look_at_camera({2, 0.4, 1.5}, {0, 0.2, 0}, {0, 1, 0}, 0.9), 8, 2);
    }
}

TEST_F(Mirrors, EndlessChainsEnd) {
    // Two large mirrors face each other, and only paths that meet the ball between them find light.
    Scene scene;
    const int mirror = add_material(scene, metal_material(vec3(1), 0));
    add_quad(scene, mirror, {-100, 0, -100}, {0, 0, 200}, {200, 0, 0});
    add_quad(scene, mirror, {-100, 1, -100}, {200, 0, 0}, {0, 0, 200});
    add_ball(scene, add_material(scene, light_material(vec3(1))), {0, 0.5f, 0}, 0.3f);
    const Camera camera = look_at_camera({0.6, 0.7, 0.6}, {0, 0.4, 0}, {0, 1, 0}, 1.4);
    const RenderSettings settings = small_settings(camera, 32, 32, 16, 64);
    const RenderResult noisy = picture(scene, settings), found = denoised(scene, camera, 32, 16, 64);
    expect("a lamp between mirrors keeps its light", std::abs(mean_of(found).value / mean_of(noisy).value - 1), 0.01,
           "of the mean", "the denoiser keeps light within 1/100");
}

TEST_F(Mirrors, RaysIntoNothing) {
    Scene scene = floor_scene(metal_material(vec3(1), 0), 1);
    add_ball(scene, add_material(scene, glass_material(0)), {0, 0.5f, 0}, 0.4f);
    const Camera camera = look_at_camera({1, 1.5, 2}, {0, 0.2, 0}, {0, 1, 0}, 1);
    expect("mirror and glass in the dark", brightest(denoised(scene, camera, 32, 4, 16)), 0, "radiance",
           "exact: there is no light");
    scene.environment.color = vec3(1);
    expect_white("white glass on a white mirror under a white sky", scene, camera, 16, 1);
}

}  // namespace
}  // namespace halflight::test
