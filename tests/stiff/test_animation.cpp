// Tests animations: jumps, times outside the keys, frames of a microsecond, cuts.
#include <cmath>
#include <limits>

#include "engine/core/frames.h"
#include "engine/io/gltf/gltf.h"
#include "tests/stiff/stiff.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

constexpr std::size_t kFirst[] = {0};

class Animations : public StiffTest {
  protected:
    /// Returns a lit triangle and a camera in front of it; node 0 belongs to the triangle, node 1 to the camera.
    static GltfBuilder lit_triangle() {
        GltfBuilder b;
        b.add_triangle()["material"] = b.push("materials", {{"emissiveFactor", {0.2, 0.3, 0.4}}});
        b.json["nodes"][0]["translation"] = {0, 0, 0};
        b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
        b.push("nodes", {{"camera", 0}, {"translation", {0, 0, 3}}});
        b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 0.5, 0.5};
        return b;
    }
    static GltfBuilder moved(int node, const char* interpolation, const std::vector<float>& times,
                             const std::vector<float>& places) {
        GltfBuilder b = lit_triangle();
        b.push("animations", {{"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", "translation"}}}}}},
                              {"samplers",
                               {{{"input", b.floats("SCALAR", times)},
                                 {"output", b.floats("VEC3", places)},
                                 {"interpolation", interpolation}}}}});
        return b;
    }
    static GltfBuilder resting(int node, const Json& place) {
        GltfBuilder b = lit_triangle();
        b.json["nodes"][static_cast<std::size_t>(node)]["translation"] = place;
        return b;
    }
    static GltfScene open(const GltfBuilder& builder) {
        return loaded(builder, [](const auto& file) { return GltfScene(file); });
    }
    Image picture_of(const Scene& scene) { return picture(scene, scene.cameras.at(0), 24, 2, 3).beauty; }
    Image at_rest(int node, const Json& place) { return picture_of(open(resting(node, place)).at(0, {})); }
    static dvec3 place(const Scene& scene) { return scene.instances.at(0).object_to_world[3]; }
};

TEST_F(Animations, Teleports) {
    GltfScene scene =
        open(moved(0, "LINEAR", {0, 1, 1, 1, 2}, {0, 0, 0, 0, 0, 0, 9e5f, 9, 9, -1, 0, 0.5f, -1, 0, 0.5f}));
    expect("three keys at 1 s: distance to the last one at that time",
           glm::distance(place(scene.at(1, kFirst)), {-1, 0, 0.5}), 0, "m",
           "exact: of keys at one time the last one counts");
    const dvec3 before = place(scene.at(double{std::nextafter(1.0f, 0.0f)}, kFirst));
    expect("and of the last float before it to the first one", glm::distance(before, dvec3(0)), 0, "m",
           "exact: it stood still");
    expect("of the last double before it, whose float is 1 s, to the last one",
           glm::distance(place(scene.at(std::nextafter(1.0, 0.0), kFirst)), {-1, 0, 0.5}), 0, "m",
           "exact: times compare as floats, as files store them");
    expect("picture after the jump: what differs from one that was always there",
           pixels_that_differ(picture_of(scene.at(1, kFirst)), at_rest(0, {-1, 0, 0.5})), 0, "pixels",
           "exact: a frame is a function of its scene");
    expect("picture before the jump", pixels_that_differ(picture_of(scene.at(0.999, kFirst)), at_rest(0, {0, 0, 0})), 0,
           "pixels", "exact: nothing of what is to come");
}

TEST_F(Animations, TimesBeyondAllKeys) {
    for (const char* interpolation : {"STEP", "LINEAR"}) {
        GltfScene scene = open(moved(0, interpolation, {1, 2}, {0.5f, 0, 0, 0, 0.5f, 0}));
        double worst = 0;
        for (const double far : {1e3, 1e30, std::numeric_limits<double>::max()}) {
            worst = std::max(worst, glm::distance(place(scene.at(-far, kFirst)), {0.5, 0, 0}));
            worst = std::max(worst, glm::distance(place(scene.at(far, kFirst)), {0, 0.5, 0}));
        }
        expect(fmt::format("up to 1.8e308 s before and after all keys, {}", interpolation), worst, 0, "m",
               "exact: the nearest key");
    }
    GltfScene spline = open(moved(0, "CUBICSPLINE", {1, 2},
                                  {1e30f, 0, 0, 0.5f, 0, 0, 1e30f, 0, 0,  //
                                   1e30f, 0, 0, 0, 0.5f, 0, 1e30f, 0, 0}));
    expect("the same of a spline with tangents of 10^30 m/s",
           glm::distance(place(spline.at(-1e30, kFirst)), {0.5, 0, 0}) +
               glm::distance(place(spline.at(1e30, kFirst)), {0, 0.5, 0}),
           0, "m", "exact: it does not go on by its tangents");
}

TEST_F(Animations, FramesOfAMicrosecond) {
    const FrameRate rate = parse_frame_rate("--fps", "1000000");
    GltfScene scene = open(moved(0, "LINEAR", {0, 4}, {0, 0, 0, 4, 0, 0}));  // 1 m/s
    double worst = 0, shortest = 1;
    for (std::uint32_t frame = 2'000'000; frame < 2'000'100; ++frame) {
        const double x = place(scene.at(rate.seconds(frame), kFirst)).x;
        worst = std::max(worst, std::abs(x - frame / 1e6));
        shortest = std::min(shortest, place(scene.at(rate.seconds(frame + 1.0), kFirst)).x - x);
    }
    expect("frames of 10^-6 s at 2 s, 1 m/s: error of place", worst, 8 * 2 * 0x1p-53, "m",
           "eight roundings of 2 m in double");
    expect("and by how much the shortest step falls short of 10^-6 m", 1 - shortest / 1e-6, 1e-6, "of it",
           "roundings of 2 m to a step of 10^-6 m: 10^-9 of it and some");
    GltfScene moving = open(moved(0, "LINEAR", {1, 1 + 0x1p-23f}, {0, 0, 0, 1, 0, 0}));
    expect("keys one float32 apart, half-way: error of place", std::abs(place(moving.at(1 + 0x1p-24, kFirst)).x - 0.5),
           0, "m", "exact: times are compared in double");
}

TEST_F(Animations, CutsLeaveNoTrace) {
    GltfScene scene = open(moved(1, "STEP", {0, 0.5f}, {0, 0, 3, 0.7f, 0.2f, 1.5f}));
    const FrameRate rate;
    const Scene rest = scene.at(0, kFirst);
    RenderSettings settings = small_settings(rest.cameras.at(0), 24, 24, 6, 3);
    const auto settings_at = [&](std::uint32_t frame) {
        FrameSettings f = settings;
        f.frame = frame;
        f.camera = scene.cameras_at(rate.seconds(frame), kFirst).at(0);
        return f;
    };
    const ColorConfig colors = ColorConfig::load();
    const RenderResult alone = Renderer(context, rest, colors, settings).render(settings_at(12));
    Renderer living(context, rest, colors, settings);
    for (std::uint32_t frame = 8; frame < 12; ++frame) living.render(settings_at(frame));
    const RenderResult cut = living.render(settings_at(12));
    expect("a cut between frames 11 and 12: something of frame 11", pixels_that_differ(cut.beauty, alone.beauty), 0,
           "pixels", "exact: the bits of a picture without an old frame");
    expect("and the camera's distance to where it was cut to",
           glm::distance(dvec3(settings_at(12).camera.camera_to_world[3]), dvec3(vec3(0.7f, 0.2f, 1.5f))), 0, "m",
           "exact: the key");
}

}  // namespace
}  // namespace halflight::test
