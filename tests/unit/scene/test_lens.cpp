// Tests lenses as values: the aperture of an f-number, and how settings and scenes combine.
#include <gtest/gtest.h>

#include "api/halflight/camera.h"
#include "api/halflight/statistics.h"
#include "engine/core/view_transform.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

using Kind = Focus::Kind;

Camera camera_of_50_mm(double aspect) {
    Camera camera;
    camera.vertical_fov = 2 * std::atan(36 / 50.0 / 2 / std::max(aspect, 1.0));
    return camera;
}

TEST(LensValues, ApertureOfAnFNumber) {
    for (const double aspect : {16.0 / 9, 1.0, 0.5}) {
        Camera camera = camera_of_50_mm(aspect);
        camera.lens.fstop = 2;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.0125, 1e-12) << "50 mm at f/2, whatever the picture's shape";
        camera.lens.sensor = 18;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.00625, 1e-12);
        camera.lens.aperture = 3;
        EXPECT_NEAR(aperture_radius(camera, aspect), 0.0015, 1e-12) << "the diameter replaces the f-number";
    }
}

TEST(LensValues, SettingsReplaceTheLensOfTheCamera) {
    const Focus at_2{.kind = Kind::distance, .distance = 2};
    const Camera plain;
    Camera own;
    own.lens = {.fstop = 4, .focus = at_2, .blades = 6};
    EXPECT_EQ(with_lens(plain, {}).lens, Lens());
    EXPECT_EQ(with_lens(plain, {.fstop = 2}).lens, Lens()) << "an f-number alone sets the exposure";
    EXPECT_EQ(with_lens(own, {}).lens, own.lens);
    EXPECT_EQ(with_lens(own, {.fstop = 2}).lens, (Lens{.fstop = 2, .focus = at_2, .blades = 6}));
    EXPECT_EQ(with_lens(own, {.focus = {.kind = Kind::none}}).lens, Lens());
    EXPECT_EQ(with_lens(own, {.aperture = 9}).lens, (Lens{.fstop = 4, .aperture = 9, .focus = at_2, .blades = 6}));
    EXPECT_EQ(with_lens(plain, {.aperture = 9, .focus = at_2}).lens, (Lens{.aperture = 9, .focus = at_2}));
    EXPECT_EQ(error_message([&] { with_lens(plain, {.focus = at_2}); }),
              "focus: needs an f-number (--fstop) or an aperture (--aperture)");
    EXPECT_EQ(error_message([&] { with_lens(plain, {.aperture = 9}); }),
              "aperture: blurs nothing without a focus (--focus)");
    Camera orthographic;
    orthographic.orthographic = true;
    EXPECT_NE(error_message([&] { with_lens(orthographic, {.fstop = 2, .focus = at_2}); }).find("no focal length"),
              std::string::npos);
    EXPECT_TRUE(with_lens(orthographic, {.aperture = 2, .focus = at_2}).lens.blurs());
}

TEST(LensValues, AnFNumberBesideAFocusLeavesTheExposureAlone) {
    ViewTransform view;
    view.camera.lens = {.fstop = 2, .focus = {.kind = Kind::distance, .distance = 2}};
    EXPECT_TRUE(view.metered());
    view.camera.iso = 100;
    EXPECT_FALSE(view.metered()) << "exposure and depth of field share the f-number";
    const float blurred = view.stops();
    view.camera.lens.focus = {};
    EXPECT_EQ(view.stops(), blurred);
}

TEST(LensValues, Text) {
    Camera camera = camera_of_50_mm(1.5);
    const Lens lens{.fstop = 2, .focus = {.kind = Kind::distance, .distance = 1.5}, .blades = 6, .rotation = 10};
    EXPECT_EQ(lens_text(camera, lens, {3, 2}), "f/2, aperture 25 mm, focus at 1.5 m, 6 blades turned by 10 degrees");
    const double far = std::numeric_limits<double>::infinity();
    EXPECT_EQ(lens_text(camera, {.aperture = 8, .focus = {.kind = Kind::distance, .distance = far}}, {3, 2}),
              "aperture 8 mm, focus at infinity");
    EXPECT_EQ(lens_text(camera, {}, {3, 2}), "");
}

}  // namespace
}  // namespace halflight
