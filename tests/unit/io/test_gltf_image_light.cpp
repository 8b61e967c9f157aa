// Tests EXT_lights_image_based: encoding, orientation, rotation and intensity of cube maps, and damaged files.
#include "engine/io/png.h"
#include "engine/scene/srgb.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

constexpr int kFaceSide = 8;

/// Returns a file whose light has these six images as its first level.
GltfBuilder with_images(const Json& images) {
    GltfBuilder b;
    b.add_triangle();
    b.json["images"] = images;
    b.json["scene"] = 1;
    b.json["scenes"] = {{{"nodes", {0}}},
                        {{"nodes", {0}}, {"extensions", {{"EXT_lights_image_based", {{"light", 0}}}}}}};
    b.json["extensions"]["EXT_lights_image_based"]["lights"] = {
        {{"specularImages", {{0, 1, 2, 3, 4, 5}}}, {"specularImageSize", kFaceSide}}};
    b.require({"EXT_lights_image_based"});
    return b;
}

/// Returns the pixel of the map that a direction shows (scene.h).
vec3 shown(const Scene& scene, const dvec3& direction) {
    const Image& map = scene.environment.map;
    const dvec3 d = glm::normalize(direction);
    const double u = std::atan2(d.z, d.x) / (2 * kPi) + 0.5, v = std::acos(d.y) / kPi;
    const float* p = map.at(std::min(int(u * map.width), map.width - 1), std::min(int(v * map.height), map.height - 1));
    return scene.environment.color * vec3(p[0], p[1], p[2]);
}

class GltfCube : public GltfTest {
  protected:
    /// Writes faces of the greys 10, 20, ..., 60 with one white corner each, at the upper left. Faces have an alpha.
    GltfBuilder cube(std::uint8_t alpha) {
        Json images;
        for (int face = 0; face < 6; ++face) {
            std::vector<std::uint8_t> bytes;
            for (int i = 0; i < kFaceSide * kFaceSide; ++i) {
                const bool corner = i % kFaceSide < kFaceSide / 2 && i / kFaceSide < kFaceSide / 2;
                const auto grey = static_cast<std::uint8_t>(corner ? 255 : 10 * (face + 1));
                bytes.insert(bytes.end(), {grey, grey, grey, alpha});
            }
            const std::string name = fmt::format("{}_{}.png", face, alpha);
            write_png(folder_ / name, kFaceSide, kFaceSide, 4, bytes);
            images.push_back({{"uri", name}});
        }
        return with_images(images);
    }
};

float grey_of(int face) {
    return static_cast<float>(srgb_to_linear(10 * (face + 1) / 255.0));
}

TEST_F(GltfCube, LiesAsOtherViewersShowIt) {
    const Scene scene = load(cube(255));
    EXPECT_TRUE(scene.report.warnings.empty()) << scene.report.warnings[0];
    EXPECT_EQ(scene.environment.map.width, 4 * kFaceSide);
    EXPECT_EQ(scene.environment.color, vec3(1));
    // Babylon.js looks up (-x, y, z) in the cube map of OpenGL. Corners as they are seen from inside with +Y or,
    // looking up and down, -Z and +Z above.
    const dvec3 centres[] = {{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const dvec3 ups[] = {{0, 1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}, {0, 1, 0}, {0, 1, 0}};
    for (int face = 0; face < 6; ++face) {
        const dvec3 centre = centres[face], up = 0.6 * ups[face], right = glm::cross(centre, up);
        EXPECT_NEAR(shown(scene, centre + up - right).x, 1, 1e-6) << face;
        EXPECT_NEAR(shown(scene, centre + up + right).x, grey_of(face), 1e-6) << face;
        EXPECT_NEAR(shown(scene, centre - up - right).x, grey_of(face), 1e-6) << face;
    }
}

TEST_F(GltfCube, HasRangeIntensityAndRotation) {
    GltfBuilder b = cube(51);
    Json& light = b.json["extensions"]["EXT_lights_image_based"]["lights"][0];
    light.update(
        {{"name", "hall"}, {"intensity", 3}, {"rotation", {0, 2, 0, 2}}});  // 90 degrees about +Y, not of length 1
    const Scene scene = load(b);
    EXPECT_EQ(scene.environment.name, "hall");
    EXPECT_NEAR(shown(scene, {0.2, -0.3, 1}).x, 15 * grey_of(0), 1e-4) << "-X turns to +Z";
    EXPECT_NEAR(shown(scene, {-0.2, -0.3, -1}).x, 15 * grey_of(1), 1e-4);
    EXPECT_NEAR(shown(scene, {0, 1, 0.3}).x + shown(scene, {0.3, 1, 0}).x, 30 * grey_of(2), 1e-3);
}

TEST_F(GltfCube, OfOtherScenesAndOfUnreadableImagesIsLeftOut) {
    GltfBuilder other = cube(255);
    other.json["scene"] = 0;
    EXPECT_TRUE(load(other).environment.black());
    GltfBuilder missing = cube(255);
    missing.json["images"][3]["uri"] = "none.png";
    const Scene dark = load(missing);
    EXPECT_TRUE(dark.environment.black());
    expect_warnings(dark.report.warnings, {"images[3] (none.png): "});
    GltfBuilder few = cube(255);
    few.json["extensions"]["EXT_lights_image_based"]["lights"][0]["specularImages"] = {{0, 1}};
    expect_warnings(load(few).report.warnings, {"extensions.EXT_lights_image_based: the first level"});
    GltfBuilder turned = cube(255);
    turned.json["extensions"]["EXT_lights_image_based"]["lights"][0]["rotation"] = {0, 0, 0, 0};
    expect_warnings(load(turned).report.warnings, {"extensions.EXT_lights_image_based: rotation"});
}

TEST_F(GltfCube, IsRefusedIfDamaged) {
    const std::string place = "extensions.EXT_lights_image_based.lights[0]";
    const std::string light = "/extensions/EXT_lights_image_based/lights/0";
    expect_refused(cube(255), {{light + "/intensity", -1, "extensions.EXT_lights_image_based: intensity"},
                               {light + "/intensity", 1e300, "extensions.EXT_lights_image_based: intensity"},
                               {light + "/rotation", {0, 1}, place + ".rotation"},
                               {light + "/specularImages/0/2", 6, place + ".specularImages[0][2]: 6"},
                               {light + "/specularImages", 6, place + ".specularImages"},
                               {light + "/specularImages", kRemoved, place},
                               {"/scenes/1/extensions/EXT_lights_image_based/light", 1, "scenes[1].extensions."}});
}

}  // namespace
}  // namespace halflight
