// Tests Cryptomattes of whole pictures on objects of known coverage, read as a compositing program reads them.
#include <gtest/gtest.h>

#include <bit>
#include <nlohmann/json.hpp>

#include "renderer/cryptomatte.h"
#include "tests/pass/picture/pixels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr int kSide = 48;               // pixels
constexpr double kPixel = 4.0 / kSide;  // world units per pixel

class MattesOfPictures : public GpuTest {
  protected:
    /// Returns squares of side 1.4, 2.25 and 0.5; the camera sees 4 x 4 units from +Z. "front" hides 1 x 1 of "back".
    /// "twin" is a separate object with the material of "back".
    Scene squares() {
        Scene scene;
        Material red = diffuse_material(vec3(0.5f, 0, 0)), blue = diffuse_material(vec3(0, 0, 0.5f));
        red.name = "red", blue.name = "blue";
        const int front = add_material(scene, red), back = add_material(scene, blue);
        add_quad(scene, front, {-1.1f, -1.1f, 1}, {1.4f, 0, 0}, {0, 1.4f, 0});
        add_quad(scene, back, {-0.7f, -0.7f, 0}, {2.25f, 0, 0}, {0, 2.25f, 0});
        add_quad(scene, back, {-1.9f, 1, 0}, {0.5f, 0, 0}, {0, 0.5f, 0});
        scene.instances[0].name = "front", scene.instances[1].name = "back", scene.instances[2].name = "twin";
        scene.cameras.push_back(spot_camera(dvec3(0, 0, 2), dvec3(0, 0, 1), 4));
        return scene;
    }

    static RenderSettings settings_of(const Scene& scene, int samples) {
        RenderSettings settings = small_settings(scene.cameras[0], kSide, kSide, samples, 1);
        settings.aovs = {"cryptomaterial", "albedo", "cryptoobject"};
        return settings;
    }
    RenderResult picture(const Scene& scene, int samples) {
        return render(context, scene, settings_of(scene, samples));
    }

    /// Returns the area of an object in the picture, in world units squared: the sum of its coverage over all
    /// ranks.
    static double area(const RenderResult& r, const std::string& layer_name, const std::string& name) {
        const std::string* manifest = nullptr;
        for (const auto& [key, value] : r.attributes)
            if (value == layer_name) manifest = &r.attributes.at(key.substr(0, key.rfind('/')) + "/manifest");
        if (manifest == nullptr) throw std::out_of_range(layer_name);
        const auto id = std::stoul(nlohmann::json::parse(*manifest).at(name).get<std::string>(), nullptr, 16);
        const Image& image = layer(r, layer_name + "00.R");
        double sum = 0;
        for (std::size_t i = 0; i < image.pixels.size(); i += 2)
            if (std::bit_cast<std::uint32_t>(image.pixels[i]) == id) sum += image.pixels[i + 1];
        return sum * kPixel * kPixel;
    }
};

// All pixels along a side have the same samples. With 64 samples, the side's position is therefore known to about two
// of 64 parts of a pixel.
TEST_F(MattesOfPictures, CoverageEqualsTheGeometry) {
    const RenderResult r = picture(squares(), 64);
    const auto expect_area = [&](const char* layer_name, const char* name, double expected, double outline) {
        EXPECT_NEAR(area(r, layer_name, name), expected, outline * kPixel * 2 / 64) << name;
    };
    expect_area("CryptoObject", "front", 1.4 * 1.4, 4 * 1.4);
    expect_area("CryptoObject", "back", 2.25 * 2.25 - 1, 4 * 2.25 + 2);
    expect_area("CryptoObject", "twin", 0.25, 2);
    expect_area("CryptoMaterial", "red", 1.4 * 1.4, 4 * 1.4);
    expect_area("CryptoMaterial", "blue", 2.25 * 2.25 - 1 + 0.25, 4 * 2.25 + 4);
}

TEST_F(MattesOfPictures, CoverageIsAtMostOneAndZeroForTheBackground) {
    const Image image = layer(picture(squares(), 16), "CryptoObject00.R");
    ASSERT_EQ(image.channels, 12);
    const auto covered = [&](int x, int y) {
        double sum = 0;
        for (int i = 1; i < 12; i += 2) sum += image.at(x, y)[i];
        return sum;
    };
    for (const auto& [x, y] : pixels_of(ivec2(kSide))) ASSERT_LE(covered(x, y), 1.0) << x << ", " << y;
    EXPECT_EQ(covered(1, 1), 0);
    EXPECT_EQ(covered(24, 24), 1);
    EXPECT_GT(image.at(24, 24)[1], 0.99);
}

TEST_F(MattesOfPictures, BandsAndOtherPicturesChangeNothing) {
    const Scene scene = squares();
    RenderSettings settings = settings_of(scene, 5);
    Renderer renderer(context, scene, ColorConfig::load(), settings);
    const RenderResult whole = renderer.render();
    expect_same(renderer.render(), whole);
    settings.band_pixels = 16 * kSide;
    expect_same(render(context, scene, settings), whole);
}

// Objects without a name are numbered.
TEST_F(MattesOfPictures, NamelessObjectsAreNumbered) {
    Scene scene = squares();
    scene.instances[1].name.clear();
    scene.materials[0].name.clear();
    const RenderResult r = picture(scene, 4);
    EXPECT_GT(area(r, "CryptoObject", "object 1"), 3);
    EXPECT_GT(area(r, "CryptoMaterial", "material 0"), 1);
}

}  // namespace
}  // namespace halflight::test
