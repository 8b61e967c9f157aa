// Tests the first picture that a user sees: scenes whose light is far from a radiance of 1, or negligible, rendered by
// the program without options that change light or exposure.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <regex>

#include "engine/io/exr.h"
#include "engine/io/png.h"
#include "tests/support/process.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;
using Strings = std::vector<std::string>;

class FirstPicture : public testing::Test {
  protected:
    FirstPicture() {
        // A cube of side 1 about the origin.
        std::string bytes;
        const auto add = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
        for (const float z : {-0.5f, 0.5f})
            for (const float y : {-0.5f, 0.5f})
                for (const float x : {-0.5f, 0.5f}) add(x), add(y), add(z);
        for (const std::uint16_t i : {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5})
            add(i);
        write_text(folder / "cube.bin", bytes);
    }

    /// Returns two blocks on a floor. Mesh 1 is a cube that emits light.
    static Json blocks() {
        const auto mesh = [](int material) {
            return Json{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", material}}}}};
        };
        const auto grey = [](double r, double g, double b) {
            return Json{{"pbrMetallicRoughness", {{"baseColorFactor", {r, g, b, 1}}, {"metallicFactor", 0}}}};
        };
        Json lamp = grey(0, 0, 0);
        lamp["emissiveFactor"] = {1, 1, 1};
        return {{"asset", {{"version", "2.0"}}},
                {"buffers", {{{"uri", "cube.bin"}, {"byteLength", 96 + 72}}}},
                {"bufferViews",
                 {{{"buffer", 0}, {"byteLength", 96}}, {{"buffer", 0}, {"byteOffset", 96}, {"byteLength", 72}}}},
                {"accessors",
                 {{{"bufferView", 0},
                   {"componentType", 5126},
                   {"count", 8},
                   {"type", "VEC3"},
                   {"min", {-0.5, -0.5, -0.5}},
                   {"max", {0.5, 0.5, 0.5}}},
                  {{"bufferView", 1}, {"componentType", 5123}, {"count", 36}, {"type", "SCALAR"}}}},
                {"materials", {grey(0.6, 0.5, 0.4), lamp, grey(0.2, 0.3, 0.7)}},
                {"meshes", {mesh(0), mesh(1), mesh(2)}},
                {"nodes",
                 {{{"mesh", 0}, {"scale", {6, 0.1, 6}}},
                  {{"mesh", 2}, {"translation", {-0.6, 0.55, 0}}},
                  {{"mesh", 2}, {"translation", {1.2, 0.8, 0.4}}, {"scale", {0.8, 1.5, 0.8}}}}},
                {"scenes", {{{"nodes", {0, 1, 2}}}}},
                {"scene", 0}};
    }
    static void add_node(Json& scene, Json node) {
        scene["nodes"].push_back(std::move(node));
        scene["scenes"][0]["nodes"].push_back(scene["nodes"].size() - 1);
    }
    /// Adds a light that shines along `rotation` applied to -Z.
    static void add_light(Json& scene, const char* type, double intensity, Json place) {
        Json& lights = scene["extensions"]["KHR_lights_punctual"]["lights"];
        Json light{{"type", type}, {"intensity", intensity}};
        if (light["type"] == "spot") light["spot"] = Json::object();
        lights.push_back(std::move(light));
        place["extensions"]["KHR_lights_punctual"]["light"] = lights.size() - 1;
        scene["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_emissive_strength"};
        add_node(scene, std::move(place));
    }
    static Json sun(double lux) {
        Json scene = blocks();
        add_light(scene, "directional", lux, {{"rotation", {-0.4777, 0.2706, 0.1531, 0.8217}}});
        return scene;
    }
    static Json lamp(const char* type, double candela) {
        Json scene = blocks();
        add_light(scene, type, candela, {{"translation", {1, 4, 2.5}}, {"rotation", {-0.4777, 0.1, 0.1, 0.8217}}});
        return scene;
    }
    static Json emitter(double radiance, double side) {
        Json scene = blocks();
        scene["extensionsUsed"] = {"KHR_materials_emissive_strength"};
        scene["materials"][1]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = radiance;
        add_node(scene, {{"mesh", 1}, {"translation", {-0.6, 0.9, 0.505}}, {"scale", {side, side, 0.02}}});
        return scene;
    }

    Outcome render(const Json& scene, const Strings& outputs, const Strings& more = {}) {
        write_text(folder / "scene.gltf", scene.dump());
        Strings arguments = {"render", folder / "scene.gltf", "--width", "96", "--height", "54"};
        if (std::ranges::find(more, "--samples") == more.end()) arguments.insert(arguments.end(), {"--samples", "8"});
        for (const std::string& output : outputs) arguments.push_back(folder / output);
        arguments.insert(arguments.end(), more.begin(), more.end());
        Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome;
    }
    Image picture(const std::string& name) const { return read_png(name, read_text(folder / name), 4096); }
    /// Renders without options for light and exposure. Expects that the surfaces can be judged: they are neither black
    /// nor white.
    void expect_judgeable(const Json& scene, Strings more = {}) {
        more.insert(more.end(), {"--aov", "depth"});
        render(scene, {"a.png", "a.exr"}, more);
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
    TemporaryFolder folder;
};

TEST_F(FirstPicture, CanBeJudged) {
    const std::pair<const char*, Json> scenes[] = {
        {"a LED of radiance 1", emitter(1, 0.05)},
        {"a LED of radiance 50", emitter(50, 0.02)},
        {"a sun of 2000 lux", sun(2000)},
        {"a sun of 68000 lux", sun(68000)},
        {"a sun of 100000 lux", sun(100000)},
        {"a point of 5000 candela", lamp("point", 5000)},
        {"a spot of 40000 candela", lamp("spot", 40000)},
        {"a point of 0.05 candela", lamp("point", 0.05)},
        {"a lamp that is far away",
         [] {
             Json scene = blocks();
             add_light(scene, "point", 100, {{"translation", {500, 500, 500}}});
             return scene;
         }()},
        {"no light", blocks()},
    };
    for (const auto& [name, scene] : scenes) {
        SCOPED_TRACE(name);
        expect_judgeable(scene);
    }
}

TEST_F(FirstPicture, ExposureIsPrintedAndCanBeFixed) {
    const Json scene = sun(68000);
    const Outcome metered = render(scene, {"a.exr", "a.png"}, {"--reproducible"});
    std::smatch match;
    ASSERT_TRUE(std::regex_search(metered.err, match, std::regex("exposure (-[0-9.]+) stops by metering")))
        << metered.err;
    const Outcome fixed = render(scene, {"b.exr", "b.png"}, {"--reproducible", "--exposure", match[1].str()});
    EXPECT_EQ(fixed.err.find("metering"), std::string::npos);
    EXPECT_EQ(read_text(folder / "a.png"), read_text(folder / "b.png"));
    EXPECT_EQ(read_text(folder / "a.exr"), read_text(folder / "b.exr")) << "an .exr does not depend on exposure";
    render(scene, {"c.exr", "c.png"}, {"--reproducible", "--exposure", "0"});
    EXPECT_NE(read_text(folder / "a.png"), read_text(folder / "c.png"));
    EXPECT_EQ(read_text(folder / "a.exr"), read_text(folder / "c.exr"));
    // Neither samples nor seeds change the exposure.
    EXPECT_NE(render(scene, {"d.png"}, {"--samples", "2", "--seed", "5"}).err.find(match[0].str()), std::string::npos);
}

TEST_F(FirstPicture, PicturesNearOneDoNotChange) {
    for (const Json& scene : {blocks(), sun(3), lamp("point", 30)}) {
        EXPECT_EQ(render(scene, {"a.png"}, {"--reproducible"}).err.find("metering"), std::string::npos);
        render(scene, {"b.png"}, {"--reproducible", "--exposure", "0"});
        EXPECT_EQ(read_text(folder / "a.png"), read_text(folder / "b.png"));
    }
}

TEST_F(FirstPicture, ASequenceHasOneExposure) {
    // The sun moves behind the blocks. All machines of a farm must find the exposure of frame 0.
    const Json scene = sun(20000);
    render(scene, {"whole.####.png"}, {"--frames", "0-3"});
    render(scene, {"part.####.png"}, {"--frames", "0-3", "--part", "2/2"});
    const Outcome outcome = render(scene, {"other.####.png"}, {"--frames", "3,1"});
    EXPECT_EQ(read_text(folder / "whole.0003.png").size(), read_text(folder / "other.0003.png").size());
    for (const char* frame : {"0001", "0003"})
        EXPECT_EQ(picture(fmt::format("whole.{}.png", frame)).pixels,
                  picture(fmt::format("other.{}.png", frame)).pixels);
    EXPECT_EQ(picture("whole.0003.png").pixels, picture("part.0003.png").pixels);
    const auto first = outcome.err.find("by metering");
    EXPECT_NE(first, std::string::npos);
    EXPECT_EQ(outcome.err.find("by metering", first + 1), std::string::npos) << "one note";
}

TEST_F(FirstPicture, TurntableTurnsOnce) {
    render(blocks(), {"turn.##.exr"}, {"--turntable", "4", "--reproducible"});
    std::vector<std::string> frames;
    for (int frame = 0; frame < 4; ++frame) frames.push_back(read_text(folder / fmt::format("turn.{:02}.exr", frame)));
    EXPECT_FALSE(std::filesystem::exists(folder / "turn.04.exr"));
    EXPECT_NE(frames[0], frames[2]);
    render(blocks(), {"next.##.exr"}, {"--turntable", "4", "--frames", "4", "--seed", "0"});
    const auto camera = [&](const char* name) { return *read_exr(folder / name).attributes.world_to_camera; };
    const auto distance = [](const dmat4& a, const dmat4& b) {
        double most = 0;
        for (int c = 0; c < 4; ++c) most = std::max(most, glm::length(dvec4(a[c]) - dvec4(b[c])));
        return most;
    };
    EXPECT_LT(distance(dmat4(camera("turn.00.exr")), dmat4(camera("next.04.exr"))), 1e-5) << "a whole turn";
    EXPECT_GT(distance(dmat4(camera("turn.00.exr")), dmat4(camera("turn.01.exr"))), 1);
    const auto refused = [&](const Strings& options) {
        Strings arguments = {"render", folder / "scene.gltf"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 2);
        return outcome.err;
    };
    EXPECT_NE(refused({folder / "a.exr", "--turntable", "4"}).find("has no placeholder"), std::string::npos);
    EXPECT_NE(refused({folder / "a.#.exr", "--turntable", "0"}).find("--turntable: expects a whole number from 1 to"),
              std::string::npos);
    EXPECT_NE(refused({folder / "a.#.exr", "--turntable", "4", "--frame", "1"}).find("--turntable: cannot be given"),
              std::string::npos);
}

TEST_F(FirstPicture, EachEyeIsFramed) {
    write_text(folder / "scene.gltf", blocks().dump());
    const auto camera = [&](Strings options) {
        options.insert(options.begin(), {"render", folder / "scene.gltf", folder / "a.exr", "--samples", "1"});
        const Outcome outcome = run_program(options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return *read_exr(folder / "a.exr").attributes.world_to_camera;
    };
    const Strings pair = {"--stereo", "side-by-side", "--width", "16", "--height", "16"};
    EXPECT_EQ(camera(pair), camera({"--width", "8", "--height", "16"}));
}

TEST_F(FirstPicture, PhysicalCamerasReplaceMetering) {
    const Json scene = sun(68000);
    expect_judgeable(scene, {"--iso", "100", "--shutter-speed", "1/125", "--fstop", "16"});
    const std::string told = render(scene, {"b.png"}, {"--fstop", "16"}).err;
    EXPECT_EQ(told.find("metering"), std::string::npos);
    EXPECT_NE(told.find("exposure -15.23 stops by the physical camera (--iso, --shutter-speed, --fstop, --exposure)"),
              std::string::npos)
        << told << "EV100 = log2(256 x 125) = 14.97, and log2(1.2) = 0.26";
    render(scene, {"b.png"}, {"--iso", "200", "--shutter-speed", "0.004", "--fstop", "16"});
    EXPECT_EQ(picture("a.png").pixels, picture("b.png").pixels) << "the same exposure";
    render(scene, {"c.png"}, {"--fstop", "16"});
    EXPECT_EQ(picture("a.png").pixels, picture("c.png").pixels) << "the usual values";
}

}  // namespace
}  // namespace halflight::test
