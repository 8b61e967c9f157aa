// Tests successive pictures: cuts, repetition, and motion from tiny to large.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Frames : public StiffTest {};

TEST_F(Frames, CameraCut) {
    const Scene scene = cornell_box(metal_material({0.9f, 0.7f, 0.4f}, 0.3f));
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 8, 3);
    settings.aovs.insert(settings.aovs.end(), {"albedo", "normal", "depth", "motion", "ids"});
    FrameSettings next = settings;
    next.camera = look_at_camera({0.5, 0.2, 0.9}, {-1, -0.5, -1}, {0, 1, 0}, 1);
    next.frame = 1;
    const ColorConfig colors = ColorConfig::load();
    const RenderResult alone = Renderer(context, scene, colors, settings).render(next);
    for (const rays::Culling culling : {rays::Culling::off, rays::Culling::compute, rays::Culling::raster}) {
        settings.culling = culling;
        Renderer renderer(context, scene, colors, settings);
        for (const bool forgets : {false, true}) {
            renderer.render();
            if (forgets) renderer.forget("camera cut");
            const RenderResult cut = renderer.render(next);
            double differ = pixels_that_differ(cut.beauty, alone.beauty);
            for (std::size_t i = 0; i < cut.aovs.size(); ++i)
                differ += pixels_that_differ(cut.aovs[i].image, alone.aovs[i].image);
            expect(fmt::format("camera cut, culling {}, {}: something of the old frame", name(culling),
                               forgets ? "told" : "not told"),
                   differ, 0, "pixels of 11 layers", "exact: the bits of a picture without an old frame");
        }
    }
}

TEST_F(Frames, FramesAreFunctionsOfTheirNumber) {
    const Scene scene = cornell_box();
    Renderer renderer(context, scene, ColorConfig::load(), small_settings(scene.cameras[0], 24, 24, 4, 3));
    const auto at = [&](std::uint32_t frame) {
        FrameSettings settings = small_settings(scene.cameras[0], 24, 24, 4, 3);
        settings.frame = frame;
        return renderer.render(settings).beauty;
    };
    const Image first = at(7);
    at(8);
    expect("frame 7 again, after frame 8", pixels_that_differ(at(7), first), 0, "pixels differ",
           "exact: a frame is a function of its number");
    constexpr std::uint32_t kLast = std::numeric_limits<std::uint32_t>::max();
    const double same = 24 * 24 - pixels_that_differ(at(kLast), at(kLast - 1));
    expect("frames 2^32 - 2 and 2^32 - 1: pixels alike", same, 24 * 24 * 0.1, "pixels",
           "only the lamp and what is outside are without noise: less than a tenth of the picture");
}

TEST_F(Frames, Motion) {
    const Scene scene = cornell_box();
    Camera camera = scene.cameras[0];
    const auto motion = [&](const Camera& previous) {
        RenderSettings settings = small_settings(camera, 32, 32, 1, 0);
        settings.aovs = {"motion", "position"};
        settings.previous_camera = previous;
        return picture(scene, settings);
    };
    double bad = 0;
    for (const dvec3& from : {dvec3(0, 0, -1e6), dvec3(1e6, 1e6, 3.9), dvec3(0, 0, 0), dvec3(0.1, 0.99, 0.1)}) {
        const RenderResult r = motion(look_at_camera(from, from + dvec3(1, 0.1, 0), {0, 1, 0}, 0.7));
        const NonFinite n = count_non_finite(layer(r, "motion.X"));
        bad += static_cast<double>(n.nans + n.infinities);
    }
    expect("motion from cameras that teleported: values that are not finite", bad, 0, "values", "exact");

    // A step of 10^-6 metres to the right moves a point at depth z by height / (2 tan(fov/2) z) pixels per metre.
    Camera before = camera;
    before.camera_to_world[3].x -= 1e-6;
    const RenderResult r = motion(before);
    double worst = 0;
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const double z = camera.camera_to_world[3].z - layer(r, "position.X").at(x, y)[2];
            if (z > 5) continue;  // the background
            const double exact = -1e-6 * 32 / (2 * std::tan(camera.vertical_fov / 2) * z);
            worst = std::max(worst, std::abs(layer(r, "motion.X").at(x, y)[0] - exact));
        }
    }
    // One metre is at most 16 / tan(fov / 2) / 2.9 pixels.
    const double roundings = 40 * 0x1p-24 * 4.9 * 16 / std::tan(camera.vertical_fov / 2) / 2.9;
    expect("motion of a camera that moves by 10^-6 m: error", worst, roundings, "pixels",
           "the place and its projection: some forty roundings of 4.9 m, the greatest distance");
}

}  // namespace
}  // namespace halflight::test
