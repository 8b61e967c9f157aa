// Tests the first picture that a user sees: scenes whose light is far from a radiance of 1, or negligible, rendered by
// the program without options that change light or exposure.
#include <fmt/format.h>

#include <cstdint>
#include <regex>

#include "engine/io/png.h"
#include "tests/cli/command_test.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

class FirstPicture : public CommandTest {
  protected:
    /// Returns two blocks on a floor. Mesh 3 is a cube that emits light, without a node.
    static GltfBuilder blocks() {
        GltfBuilder b;
        std::vector<float> corners;  // corners of a cube of side 1 about the origin
        for (const float z : {-0.5f, 0.5f})
            for (const float y : {-0.5f, 0.5f})
                for (const float x : {-0.5f, 0.5f}) corners.insert(corners.end(), {x, y, z});
        const int positions = b.floats("VEC3", corners);
        const int triangles = b.accessor(
            "SCALAR", kU16, std::vector<std::uint16_t>{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5});
        for (int m = 0; m < 4; ++m) {
            Json& primitive = b.add_mesh({{"POSITION", positions}});
            primitive["indices"] = triangles;
            primitive["material"] = m == 0 ? 0 : m == 3 ? 2 : 1;
        }
        Json& nodes = b.json["nodes"];
        nodes[0].update({{"scale", {6, 0.1, 6}}});
        nodes[1].update({{"translation", {-0.6, 0.55, 0}}});
        nodes[2].update({{"translation", {1.2, 0.8, 0.4}}, {"scale", {0.8, 1.5, 0.8}}});
        nodes.erase(3);
        for (const Json& color : {Json{0.6, 0.5, 0.4, 1}, Json{0.2, 0.3, 0.7, 1}, Json{0, 0, 0, 1}})
            b.push("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", color}, {"metallicFactor", 0}}}});
        b.json["materials"][2]["emissiveFactor"] = {1, 1, 1};
        b.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_emissive_strength"};
        return b;
    }
    /// Adds a light that shines along the rotation of `node` applied to -Z.
    static GltfBuilder lit(const char* type, double intensity, Json node) {
        GltfBuilder scene = blocks();
        Json light{{"type", type}, {"intensity", intensity}};
        if (light["type"] == "spot") light["spot"] = Json::object();
        scene.json["extensions"]["KHR_lights_punctual"]["lights"] = {light};
        node["extensions"]["KHR_lights_punctual"]["light"] = 0;
        scene.push("nodes", node);
        return scene;
    }
    static GltfBuilder sun(double lux) {
        return lit("directional", lux, {{"rotation", {-0.4777, 0.2706, 0.1531, 0.8217}}});
    }
    static GltfBuilder lamp(const char* type, double candela) {
        return lit(type, candela, {{"translation", {1, 4, 2.5}}, {"rotation", {-0.4777, 0.1, 0.1, 0.8217}}});
    }
    static GltfBuilder emitter(double radiance, double side) {
        GltfBuilder scene = blocks();
        scene.json["materials"][2]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = radiance;
        scene.push("nodes", {{"mesh", 3}, {"translation", {-0.6, 0.9, 0.505}}, {"scale", {side, side, 0.02}}});
        return scene;
    }

    /// Renders to outputs, which blanks separate.
    Outcome render(const GltfBuilder& scene, const char* outputs, const Strings& more = {}) {
        write_text(file("scene.glb"), scene.glb());
        Strings names;
        for (const std::string& output : words(outputs)) names.push_back(file(output));
        return done(
            with_defaults(words("render", file("scene.glb"), "--width 96 --height 54", names, more), "--samples 8"));
    }
    Image picture(const std::string& name) const { return read_png(name, read_text(file(name)), 4096); }
    /// Renders without options for light and exposure. Expects that the surfaces can be judged: they are neither black
    /// nor white.
    void expect_judgeable(const GltfBuilder& scene, const char* more = "") {
        render(scene, "a.png a.exr", words("--aov depth", more));
        const Image shown = picture("a.png"), depth = read_exr(folder / "a.exr").image({"Z"});
        std::vector<float> values;
        for (int y = 0; y < shown.height; ++y)
            for (int x = 0; x < shown.width; ++x)
                if (depth.at(x, y)[0] < 1e9f) values.push_back(shown.at(x, y)[1]);
        std::ranges::sort(values);
        ASSERT_GT(values.size(), 700U) << "the scene fills the picture";
        const auto percentile = [&](std::size_t p) { return values[(values.size() - 1) * p / 100]; };
        EXPECT_GT(percentile(50), 0.15f);
        EXPECT_LT(percentile(50), 0.85f);
        EXPECT_LT(percentile(90), 0.99f);
        EXPECT_GT(percentile(95) - percentile(10), 0.15f) << "there are shades";
    }
};

TEST_F(FirstPicture, CanBeJudged) {
    const std::pair<const char*, GltfBuilder> scenes[] = {
        {"a LED of radiance 1", emitter(1, 0.05)},
        {"a LED of radiance 50", emitter(50, 0.02)},
        {"a sun of 2000 lux", sun(2000)},
        {"a sun of 100000 lux", sun(100000)},
        {"a point of 5000 candela", lamp("point", 5000)},
        {"a spot of 40000 candela", lamp("spot", 40000)},
        {"a point of 0.05 candela", lamp("point", 0.05)},
        {"a lamp that is far away", lit("point", 100, {{"translation", {500, 500, 500}}})},
        {"no light", blocks()},
    };
    for (const auto& [name, scene] : scenes) {
        SCOPED_TRACE(name);
        expect_judgeable(scene);
    }
}

TEST_F(FirstPicture, ExposureIsPrintedAndCanBeFixed) {
    const GltfBuilder scene = sun(68000);
    const Outcome metered = render(scene, "a.exr a.png", words("--reproducible"));
    std::smatch match;
    ASSERT_TRUE(std::regex_search(metered.err, match, std::regex("exposure (-[0-9.]+) stops by metering")))
        << metered.err;
    const Outcome fixed = render(scene, "b.exr b.png", words("--reproducible --exposure", match[1].str()));
    EXPECT_FALSE(has(fixed.err, "metering"));
    EXPECT_EQ(read_text(file("a.png")), read_text(file("b.png")));
    EXPECT_EQ(read_text(file("a.exr")), read_text(file("b.exr"))) << "an .exr does not depend on exposure";
    render(scene, "c.exr c.png", words("--reproducible --exposure 0"));
    EXPECT_NE(read_text(file("a.png")), read_text(file("c.png")));
    EXPECT_EQ(read_text(file("a.exr")), read_text(file("c.exr")));
    // Neither samples nor seeds change the exposure.
    expect_has(render(scene, "d.png", words("--samples 2 --seed 5")).err, match[0].str());
}

TEST_F(FirstPicture, PicturesNearOneDoNotChange) {
    for (const GltfBuilder& scene : {blocks(), sun(3), lamp("point", 30)}) {
        EXPECT_FALSE(has(render(scene, "a.png", words("--reproducible")).err, "metering"));
        render(scene, "b.png", words("--reproducible --exposure 0"));
        EXPECT_EQ(read_text(file("a.png")), read_text(file("b.png")));
    }
}

/// The sun moves behind the blocks. All machines of a farm must find the exposure of frame 0.
TEST_F(FirstPicture, ASequenceHasOneExposure) {
    const GltfBuilder scene = sun(20000);
    render(scene, "whole.####.png", words("--frames 0-3"));
    render(scene, "part.####.png", words("--frames 0-3 --part 2/2"));
    const std::string told = render(scene, "other.####.png", words("--frames 3,1")).err;
    for (const char* name : {"other.0001.png", "other.0003.png", "part.0003.png"})
        EXPECT_EQ(picture(name).pixels, picture("whole" + std::string(name).substr(std::string(name).find('.'))).pixels)
            << name;
    expect_has(told, "by metering");
    EXPECT_EQ(told.find("by metering"), told.rfind("by metering")) << "one note";
}

TEST_F(FirstPicture, DemoNeedsNoFile) {
    const Strings small = words("--width 32 --samples 1 --reproducible --seed 3");
    done(words("render --demo", file("a.exr"), file("a.png"), small));
    done(words("render", file("b.png"), small, "--demo"));
    done(words("render", HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb", file("c.png"), small));
    for (const char* demo : {"a.png", "b.png"}) EXPECT_EQ(read_text(file(demo)), read_text(file("c.png"))) << demo;
    EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
}

TEST_F(FirstPicture, TurntableTurnsOnce) {
    render(blocks(), "turn.##.exr", words("--turntable 4 --reproducible"));
    EXPECT_FALSE(std::filesystem::exists(file("turn.04.exr")));
    EXPECT_NE(read_text(file("turn.00.exr")), read_text(file("turn.02.exr")));
    render(blocks(), "next.##.exr", words("--turntable 4 --frames 4 --seed 0"));
    const auto camera = [&](const char* name) { return dmat4(*read_exr(file(name)).attributes.world_to_camera); };
    const auto distance = [](const dmat4& a, const dmat4& b) {
        double most = 0;
        for (int c = 0; c < 4; ++c) most = std::max(most, glm::length(dvec4(a[c]) - dvec4(b[c])));
        return most;
    };
    EXPECT_LT(distance(camera("turn.00.exr"), camera("next.04.exr")), 1e-5) << "a whole turn";
    EXPECT_GT(distance(camera("turn.00.exr"), camera("turn.01.exr")), 1);
}

TEST_F(FirstPicture, EachEyeIsFramed) {
    write_text(file("scene.glb"), blocks().glb());
    const auto camera = [&](const char* options) {
        done(words("render", file("scene.glb"), file("a.exr"), "--samples 1", options));
        return *read_exr(file("a.exr")).attributes.world_to_camera;
    };
    EXPECT_EQ(camera("--stereo side-by-side --width 16 --height 16"), camera("--width 8 --height 16"));
}

TEST_F(FirstPicture, PhysicalCamerasReplaceMetering) {
    const GltfBuilder scene = sun(68000);
    expect_judgeable(scene, "--iso 100 --shutter-speed 1/125 --fstop 16");
    const Image expected = picture("a.png");
    const std::string told = render(scene, "b.png", words("--fstop 16")).err;
    EXPECT_EQ(picture("b.png").pixels, expected.pixels) << "the usual values";
    EXPECT_FALSE(has(told, "metering") || has(told, "black at this exposure"));
    expect_has(told, "exposure -15.23 stops");  // EV100 = log2(256 x 125) = 14.97, and log2(1.2) = 0.26
    render(scene, "b.png", words("--iso 200 --shutter-speed 0.004 --fstop 16"));
    EXPECT_EQ(picture("b.png").pixels, expected.pixels) << "the same exposure";
}

TEST_F(FirstPicture, WhatAPhysicalExposureMakesBlackIsNamed) {
    GltfBuilder scene = blocks();
    scene.json["materials"][0]["name"] = "lamp";
    scene.json["materials"][0]["emissiveFactor"] = {1, 1, 1};
    const auto warning = [&](const char* options) {
        const std::string told = render(scene, "a.png", words("--samples 1", options)).err;
        const std::size_t at = told.find("black at this exposure");
        return at == std::string::npos ? "" : told.substr(at, told.find('\n', at) - at);
    };
    EXPECT_TRUE(has(warning("--sky 50,30"), "material 'lamp'"));
    EXPECT_FALSE(has(warning("--sky 50,30"), "environment"));
    EXPECT_TRUE(has(warning("--env neutral --iso 100"), "the environment neutral, material 'lamp'"));
    for (const char* options : {"--env sky", "--env neutral", "--env neutral --exposure -3"})
        EXPECT_EQ(warning(options), "") << options;
}

}  // namespace
}  // namespace halflight::test
