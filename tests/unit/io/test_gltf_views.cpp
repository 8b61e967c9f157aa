// Tests the environment, lights and cameras of glTF files.
#include <cmath>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfSky = GltfTest;
using GltfLight = GltfTest;
using GltfCamera = GltfTest;

TEST_F(GltfSky, InsideTheFile) {
    GltfBuilder b;
    EXPECT_TRUE(load(b).environment.black());
    b.json["extensionsUsed"] = {"HALFLIGHT_environment"};
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 1, 2};
    const Scene scene = load(b);
    EXPECT_EQ(scene.environment.color, vec3(0.5f, 1, 2));
    EXPECT_TRUE(scene.environment.map.pixels.empty() && scene.report.warnings.empty());
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, -1, 2};
    EXPECT_EQ(refusal(b), "extensions.HALFLIGHT_environment: color is negative or not finite");
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 1e200, 2};
    EXPECT_EQ(refusal(b), "extensions.HALFLIGHT_environment: color is negative or not finite");
    b.json["extensions"]["HALFLIGHT_environment"].erase("color");
    EXPECT_NE(refusal(b), "");
}

TEST_F(GltfLight, OfEveryType) {
    GltfBuilder b;
    b.json["extensionsUsed"] = b.json["extensionsRequired"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"name", "lamp"}, {"color", {1, 0.5, 0}}, {"intensity", 20}, {"range", 3}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
        {{"type", "directional"}, {"intensity", 100000}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.75}, {"outerConeAngle", 0.5}}}},
    };
    const auto node = [&](int light, Json extra) {
        extra["extensions"]["KHR_lights_punctual"]["light"] = light;
        b.push("nodes", extra);
    };
    node(0, {{"translation", {1e6, 2, 3}}});
    node(1, {{"name", "stage"}, {"scale", {5, 5, 5}}});
    const double half = std::sqrt(0.5);
    node(2, {{"rotation", {-half, 0, 0, half}}});  // a rotation of -Z to -Y
    node(3, Json::object());
    const Scene scene = load(b);
    ASSERT_EQ(scene.lights.size(), 4u);
    EXPECT_EQ(scene.lights[0].type, LightType::point);
    EXPECT_EQ(scene.lights[0].name, "lamp");
    EXPECT_EQ(scene.lights[0].intensity, vec3(20, 10, 0));
    EXPECT_EQ(scene.lights[0].position, dvec3(1e6, 2, 3));
    EXPECT_EQ(scene.lights[1].type, LightType::spot);
    EXPECT_EQ(scene.lights[1].name, "stage");
    EXPECT_EQ(scene.lights[1].inner_cone, 0.25f);
    EXPECT_EQ(scene.lights[1].outer_cone, 0.5f);
    EXPECT_EQ(scene.lights[1].direction, vec3(0, 0, -1));
    EXPECT_EQ(scene.lights[2].type, LightType::directional);
    EXPECT_EQ(scene.lights[2].intensity, vec3(100000));
    EXPECT_LT(glm::distance(scene.lights[2].direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(scene.lights[3].inner_cone, scene.lights[3].outer_cone);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfLight, UnknownOrMissingOnesAreRefused) {
    GltfBuilder b;
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "sphere"}}};
    EXPECT_EQ(refusal(b), "nodes[0].extensions.KHR_lights_punctual.light: 1 is not an index into lights, which has 1");
    b.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    EXPECT_EQ(refusal(b), "extensions.KHR_lights_punctual.lights[0]: light type 'sphere' is unknown");
    b.json["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "spot";
    EXPECT_EQ(refusal(b), "extensions.KHR_lights_punctual.lights[0]: has no 'spot'");
}

TEST_F(GltfCamera, PerspectiveAndOrthographic) {
    GltfBuilder b;
    b.json["cameras"] = {
        {{"type", "perspective"},
         {"name", "main"},
         {"perspective", {{"yfov", 0.75}, {"znear", 0.5}, {"aspectRatio", 2}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 8}, {"ymag", -4}, {"znear", 0}, {"zfar", 100}}}}};
    b.push("nodes", {{"camera", 0}, {"scale", {3, -2, 5}}, {"translation", {1, 2, 3}}});
    b.push("nodes", {{"camera", 1}, {"name", "plan"}});
    b.push("nodes", {{"camera", 0}, {"name", "copy"}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.cameras.size(), 3u);
    const Camera& p = scene.cameras[0];
    EXPECT_EQ(p.name, "main");
    EXPECT_FALSE(p.orthographic);
    EXPECT_EQ(p.vertical_fov, 0.75);
    EXPECT_EQ(p.aspect, 2);
    EXPECT_EQ(p.near_plane, 0.5);
    EXPECT_EQ(p.far_plane, 0);
    // Scale does not affect the camera. Its basis stays right-handed, so mirroring y rotates it about its own axis.
    EXPECT_EQ(p.camera_to_world, dmat4(dvec4(-1, 0, 0, 0), dvec4(0, -1, 0, 0), dvec4(0, 0, 1, 0), dvec4(1, 2, 3, 1)));
    const Camera& o = scene.cameras[1];
    EXPECT_EQ(o.name, "plan");
    EXPECT_TRUE(o.orthographic);
    EXPECT_EQ(o.ortho_height, 8);
    EXPECT_EQ(o.aspect, 2);
    EXPECT_EQ(o.far_plane, 100);
    EXPECT_EQ(scene.cameras[2].name, "copy") << "a second use of a camera goes by its node's name";
}

TEST_F(GltfCamera, WithoutViewIsRefused) {
    GltfBuilder b;
    b.push("nodes", {{"camera", 0}});
    b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0}, {"znear", 1}}}}};
    EXPECT_EQ(refusal(b), "cameras[0]: yfov 0 is not between 0 and pi");
    b.json["cameras"][0]["perspective"].erase("yfov");
    EXPECT_EQ(refusal(b), "cameras[0].perspective: has no 'yfov'");
    b.json["cameras"][0]["type"] = "orthographic";
    EXPECT_EQ(refusal(b), "cameras[0]: has no 'orthographic'");
    b.json["cameras"][0]["type"] = "panorama";
    EXPECT_EQ(refusal(b), "cameras[0]: type 'panorama' is unknown");
}

}  // namespace
}  // namespace halflight
