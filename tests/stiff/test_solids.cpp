// Tests glass against closed forms: furnaces, absorption, total internal reflection, nested and open solids, and
// cameras inside.
#include <algorithm>
#include <cmath>

#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Solids : public StiffTest {
  protected:
    static constexpr double kReach = 0.25;  // half the size of the views, which see only one face

    static Scene under_white_sky() {
        Scene scene;
        scene.environment.color = vec3(1);
        return scene;
    }
    static Camera towards(const dvec3& from, const dvec3& at, double size) {
        Camera camera = look_at_camera(from, at, {0, 1, 0}, 1);
        camera.orthographic = true;
        camera.ortho_height = size;
        return camera;
    }
    static Material absorbing(float ior, float color, float distance) {
        Material m = glass_material(0, ior);
        m.attenuation_color = vec3(color);
        m.attenuation_distance = distance;
        return m;
    }
    MeanValue seen(const Scene& scene, const Camera& camera, int size, int samples, int bounces) {
        return mean_of(picture(scene, camera, size, samples, bounces));
    }
    /// Returns the radiance of a smooth slab between white skies, head-on: the sum over all paths between both faces.
    /// `passed`: transmittance of the inside; `specular`: factor of the reflectance from outside.
    static double slab(double ior, double passed, double specular = 1) {
        const double index = std::min(ior, 999.0), f = std::pow((index - 1) / (index + 1), 2), outside = specular * f;
        return outside + (1 - outside) * (1 - f) * passed / (1 - f * passed);
    }
    /// Expects the mean of a view that sees one face head-on.
    void expect_seen(const std::string& name, const Scene& scene, const dvec3& from, const dvec3& at, double exact) {
        const MeanValue found = seen(scene, towards(from, at, kReach), 16, 128, 64);
        expect(name, std::abs(found.value - exact), 4 * found.error + 1e-4, "radiance",
               "four standard errors, and 1/10000 for float and paths of more than 64 bounces");
    }
};

TEST_F(Solids, WhiteBallsVanishUnderAWhiteSky) {
    // Paths in balls of high indices are long: total internal reflection.
    for (const float ior : {1.0f, 1.33f, 1.5f, 2.4f}) {
        Worst worst;
        for (const float roughness : {0.0f, 0.01f, 0.3f, 0.6f, 1.0f}) {
            Scene scene = under_white_sky();
            add_ball(scene, add_material(scene, glass_material(roughness, ior)), vec3(0), 1, 12);
            const MeanValue found = seen(scene, towards({3, 2, 4}, dvec3(0), 2.2), 24, 64, 64);
            worst.add(std::abs(found.value - 1), 4 * found.error + 0.01);
        }
        expect(fmt::format("white glass ball, ior {}", ior), worst.figure, worst.bound, "radiance",
               "worst of roughness 0, 0.01, 0.3, 0.6, 1: four standard errors, and 1/100 for table and 64 bounces");
    }
    Scene scene = under_white_sky();
    add_ball(scene, add_material(scene, glass_material(1, 20)), vec3(0), 1, 12);
    const MeanValue found = seen(scene, towards({3, 2, 4}, dvec3(0), 2.2), 24, 64, 64);
    expect("white glass ball, ior 20, gains nothing", found.value - 1, 4 * found.error + 0.01, "radiance",
           "four standard errors and 1/100; the 64 bounces end many paths inside");
}

TEST_F(Solids, ColoursThatPartAddUpToWhite) {
    for (const float roughness : {0.0f, 0.5f}) {
        Worst worst;
        for (const float dispersion : {1e-6f, 1.0f, 20.0f, 1e6f}) {
            Scene scene = under_white_sky();
            Material m = glass_material(roughness);
            m.dispersion = dispersion;
            add_ball(scene, add_material(scene, m), vec3(0), 1, 12);
            const MeanValue found = seen(scene, towards({3, 2, 4}, dvec3(0), 2.2), 24, 256, 64);
            // High indices of refraction keep light inside for longer than 64 bounces.
            worst.add(dispersion > 20 ? std::max(found.value - 1, 0.0) : std::abs(found.value - 1),
                      4 * found.error + 0.01);
        }
        expect(fmt::format("white glass ball of roughness {} that disperses light", roughness), worst.figure,
               worst.bound, "radiance",
               "worst of dispersions 1e-6, 1, 20, 1e6: four standard errors, and 1/100 for table and 64 bounces");
    }
}

TEST_F(Solids, SlabsAbsorbByTheirThickness) {
    constexpr double kThickness = 0.5;
    for (const float ior : {1.0f, 1.5f, 20.0f, kInfiniteIor}) {
        for (const float distance : {1e-6f, 0.5f, 1e6f, 0.0f}) {
            const double a = distance > 0 ? std::pow(0.4, kThickness / distance) : 1;
            if (ior > 20 && a > 0.5) continue;  // light stays inside for longer than 64 bounces
            Scene scene = under_white_sky();
            add_box(scene, add_material(scene, absorbing(ior, 0.4f, distance)), {-50, -50, -0.5f}, {50, 50, 0});
            expect_seen(fmt::format("slab, ior {}, attenuation distance {}", ior, distance), scene, {0, 0, 5}, dvec3(0),
                        slab(ior, a));
        }
    }
}

TEST_F(Solids, SlabsPassWhatSpecularKeepsFromBeingReflected) {
    for (const float roughness : {0.0f, 0.7f}) {
        for (const float specular : {0.0f, 0.3f}) {
            Scene scene = under_white_sky();
            Material m = absorbing(1.5f, 0.4f, roughness > 0 ? 0 : 0.5f);
            m.specular = specular, m.roughness = roughness;
            add_box(scene, add_material(scene, m), {-50, -50, -0.5f}, {50, 50, 0});
            const MeanValue found = seen(scene, towards({0, 0, 5}, dvec3(0), kReach), 16, 256, 64);
            expect(fmt::format("slab, specular {}, roughness {}", specular, roughness),
                   std::abs(found.value - (roughness > 0 ? 1 : slab(1.5, 0.4, specular))),
                   4 * found.error + (roughness > 0 ? 0.01 : 1e-4), "radiance",
                   "four standard errors, and 1/10000 for float, or 1/100 for the table of rough lobes");
        }
    }
}

TEST_F(Solids, SlabsRefractEachColourByItsIndex) {
    for (const float dispersion : {1.0f, 20.0f, 1e6f}) {
        Scene scene = under_white_sky();
        Material m = absorbing(1.5f, 0.4f, 0.5f);
        m.dispersion = dispersion;
        add_box(scene, add_material(scene, m), {-50, -50, -0.5f}, {50, 50, 0});
        const RenderResult result = picture(scene, towards({0, 0, 5}, dvec3(0), kReach), 16, 512, 64);
        for (int c = 0; c < 3; ++c) {
            const double ior = std::clamp(1.5 + 0.5 * dispersion / 40 * (c - 1), 1.0, 999.0);
            const MeanValue found = mean_radiance(result, c);
            expect(fmt::format("slab, dispersion {}, channel {}", dispersion, c),
                   std::abs(found.value - slab(ior, 0.4)), 4 * found.error + 1e-4, "radiance",
                   "four standard errors, and 1/10000 for float");
        }
    }
}

TEST_F(Solids, CamerasInsideSeeTheWayToTheWall) {
    Scene scene = under_white_sky();
    add_box(scene, add_material(scene, absorbing(1, 0.5f, 1)), vec3(-1), vec3(1));
    expect_seen("camera inside of glass", scene, {0, 0, 0.25}, {0, 0, -1}, std::pow(0.5, 1.25));
    // The way to the wall that is no glass is unknown: nothing says that the camera is inside.
    add_box(scene, add_material(scene, light_material(vec3(3))), {-0.2f, -0.2f, -0.9f}, {0.2f, 0.2f, -0.7f});
    expect_seen("camera and lamp inside of glass", scene, {0, 0, 0.25}, {0, 0, -1}, 3);
    expect_seen("lamp inside of glass", scene, {0, 0, 3}, {0, 0, -1}, 3 * std::pow(0.5, 1.7));
}

TEST_F(Solids, NestedAndOpenGlass) {
    Scene nested = under_white_sky();
    add_box(nested, add_material(nested, absorbing(1, 0.5f, 1)), vec3(-1), vec3(1));
    add_box(nested, add_material(nested, absorbing(1, 0.25f, 1)), vec3(-0.5f), vec3(0.5f));
    expect_seen("nested boxes absorb each by its own way", nested, {0, 0, 5}, dvec3(0), 0.5 * 0.25);

    Scene pane = under_white_sky();
    Material glass = absorbing(1, 0.5f, 1);
    glass.thickness = 0.3f;
    add_quad(pane, add_material(pane, glass), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    expect_seen("open pane absorbs by its thickness", pane, {0, 0, 5}, dvec3(0), std::pow(0.5, 0.3));
    expect_seen("open pane from inside, by the way from the camera", pane, {0, 0, -2}, dvec3(0), 0.25);

    for (const float roughness : {0.0f, 0.4f, 1.0f}) {
        Scene many = under_white_sky();
        const int white = add_material(many, glass_material(roughness, 1.7f));
        add_ball(many, white, vec3(0), 1);
        add_ball(many, white, vec3(0), 0.6f);
        add_ball(many, white, {0.9f, 0, 0}, 0.7f);  // overlaps
        add_quad(many, white, {-2, -2, -1.2f}, {4, 0, 0}, {0, 4, 0});
        const MeanValue found = seen(many, towards({3, 2, 4}, dvec3(0), 2.2), 24, 64, 64);
        expect(fmt::format("nested, overlapping and open white glass, roughness {}", roughness),
               std::abs(found.value - 1), 4 * found.error + 0.02, "radiance",
               "four standard errors, and 2/100 for tables and 64 bounces");
    }
}

}  // namespace
}  // namespace halflight::test
