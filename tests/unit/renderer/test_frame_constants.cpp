// Tests the frame constants against a second implementation of SHADING.md, "Camera", in double precision.
#include "renderer/frame_constants.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "engine/gpu/program.h"
#include "passes/surface/raster_window.h"
#include "shaders/shared/ray_structs.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

constexpr double kRounding = 0x1p-24;  // relative error of a float operation
constexpr double kNear = 0x1p-60;      // near plane of a perspective camera without znear, relative to the reach

struct View {
    Camera camera;
    dvec3 origin;
    double reach;
    SampleView sample;
    double near() const { return camera.near_plane > 0 ? camera.near_plane : camera.orthographic ? 0 : reach * kNear; }
    shared::Frame frame() const { return frame_constants(camera, camera, origin, reach, sample); }
};

/// Makes random cameras near and far from the world's origin, with images, bands and jitters.
class RandomViews {
  public:
    View next() {
        View v;
        v.reach = std::exp(real(-3, 5));
        const dvec3 centre = random_.operator()() % 2 == 0 ? dvec3(0) : dvec3(real(-1e6, 1e6), real(-1e6, 1e6), 3e5);
        v.origin = centre;
        const dvec3 from = centre + v.reach * direction();
        v.camera = look_at_camera(from, from + direction(), direction(), real(0.1, 2.8));
        v.camera.orthographic = integer(0, 2) == 0;
        v.camera.ortho_height = v.reach * real(0.1, 3);
        v.sample.band.image = {integer(1, 700), integer(1, 500)};
        const int first_block = integer(0, (v.sample.band.image.y - 1) / 16);
        v.sample.band.y = first_block * 16;
        v.sample.band.rows = integer(1, v.sample.band.image.y);  // the last band may extend below the image
        v.sample.jitter = {static_cast<float>(real(0, 1)), static_cast<float>(real(0, 1))};
        return v;
    }
    /// Returns a view that has a near plane, a far plane, both or none.
    View next_with_planes(int i) {
        View v = next();
        if (i % 2 == 0) v.camera.near_plane = 0.01 * v.reach;
        if (i % 3 == 0) v.camera.far_plane = 1.5 * v.reach;
        return v;
    }
    /// Returns a pixel of the band that is inside the image.
    ivec2 pixel(const View& v) {
        const Band& b = v.sample.band;
        return {integer(0, b.image.x - 1), integer(b.y, std::min(b.y + b.rows, b.image.y) - 1)};
    }
    double real(double lower, double upper) { return std::uniform_real_distribution(lower, upper)(random_); }
    int integer(int lower, int upper) { return std::uniform_int_distribution(lower, upper)(random_); }

  private:
    dvec3 direction() {
        const double z = real(-1, 1), turn = real(0, 2 * kPi), r = std::sqrt(1 - z * z);
        return {r * std::cos(turn), r * std::sin(turn), z};
    }
    std::mt19937 random_{7};
};

struct CameraRay {
    dvec3 origin;  // origin, world units
    dvec3 along;   // direction, of length 1 per unit of distance along the camera's axis
};

CameraRay camera_ray(const Camera& camera, const ivec2& image, const dvec2& at) {
    const double half = camera.orthographic ? camera.ortho_height / 2 : std::tan(camera.vertical_fov / 2);
    const double x = (2 * at.x / image.x - 1) * half * image.x / image.y, y = (1 - 2 * at.y / image.y) * half;
    const dmat3 turn(camera.camera_to_world);
    const dvec3 place(camera.camera_to_world[3]);
    return camera.orthographic ? CameraRay{place + turn * dvec3(x, y, 0), turn * dvec3(0, 0, -1)}
                               : CameraRay{place, turn * dvec3(x, y, -1)};
}

/// Place in a picture, pixels, and a bound on its error from float matrices and sums.
struct Projected {
    dvec2 place;
    dvec2 error;
};

Projected project(const mat4& m, const dvec3& p, const ivec2& size) {
    const dvec4 q(p, 1);
    const dmat4 exact(m);
    const dvec4 clip = exact * q;
    EXPECT_GT(clip.w, 0);
    dvec4 error(0);
    for (int c = 0; c < 4; ++c) error += glm::abs(exact[c] * q[c]);
    // Each matrix entry, computed in double, is rounded once, each coordinate once, and the sum four times.
    error *= 6 * kRounding;
    const dvec2 ndc = dvec2(clip) / clip.w;
    return {(0.5 * ndc + 0.5) * dvec2(size), 0.5 * dvec2(size) * (dvec2(error) + glm::abs(ndc) * error.w) / clip.w};
}

TEST(FrameConstants, TheSamplePointIsTheCentreOfItsTexel) {
    RandomViews random;
    for (int i = 0; i < 4000; ++i) {
        const View v = random.next();
        const ivec2 pixel = random.pixel(v);
        const shared::Frame frame = v.frame();
        const CameraRay ray = camera_ray(v.camera, v.sample.band.image, dvec2(pixel) + dvec2(v.sample.jitter));
        const double distance = v.reach * random.real(0.01, 1.9);
        const dvec3 point = ray.origin + distance * ray.along - v.origin;
        const RasterWindow window = raster_window(v.sample.band);
        const Projected p = project(frame.view_projection, point, {v.sample.band.image.x, window.rows});
        const dvec2 expected = dvec2(pixel) - dvec2(0, window.y) + 0.5;
        for (int axis = 0; axis < 2; ++axis) {
            EXPECT_NEAR(p.place[axis], expected[axis], p.error[axis]) << "view " << i << ", axis " << axis;
            EXPECT_LT(p.error[axis], 0.05) << "the bound is meaningful";
        }
    }
}

TEST(FrameConstants, OrthographicDepthIsPreciseWhereverTheFarPlaneIs) {
    Camera camera;
    camera.orthographic = true;
    camera.ortho_height = 2;
    camera.near_plane = 0.01;
    for (const double far_plane : {0.0, 20.0, 1e6, 1e30}) {
        camera.far_plane = far_plane;
        const mat4 to_clip(world_to_clip(camera, {64, 64}, 10));
        EXPECT_GT((to_clip * vec4(0, 0, -5, 1)).z, (to_clip * vec4(0, 0, -5.00001f, 1)).z) << far_plane;
    }
}

TEST(FrameConstants, DepthIsReversedAndBeginsAtTheNearPlane) {
    RandomViews random;
    for (int i = 0; i < 500; ++i) {
        const View v = random.next_with_planes(i);
        const double near = v.near();
        const dmat4 to_clip = world_to_clip(v.camera, v.sample.band.image, v.reach);
        const auto depth = [&](double distance) {
            const dvec4 clip = to_clip * v.camera.camera_to_world * dvec4(0, 0, -distance, 1);
            return clip.z / clip.w;
        };
        // Points are in world space, where doubles have this resolution relative to the camera.
        const double scale = v.camera.orthographic ? v.reach : near;
        EXPECT_NEAR(depth(near), 1, 32 * 0x1p-53 * (1 + glm::length(dvec3(v.camera.camera_to_world[3])) / scale));
        double before = 1;
        for (const double share : {0.02, 0.1, 0.5, 1.0, 1.45}) {
            const double now = depth(share * v.reach);
            EXPECT_LT(now, before);
            EXPECT_GT(now, 0) << "nothing within reach is clipped";
            before = now;
        }
        const shared::Frame frame = v.frame();
        EXPECT_EQ(frame.clip.x, static_cast<float>(near));
        EXPECT_EQ(frame.clip.y, v.camera.far_plane > 0 ? static_cast<float>(v.camera.far_plane) : kInfinity);
        EXPECT_EQ(frame.camera_position.w, v.camera.orthographic ? 0 : 1);
    }
}

TEST(FrameConstants, PreviousCameraHasNeitherJitterNorBand) {
    RandomViews random;
    for (int i = 0; i < 500; ++i) {
        const View v = random.next();
        const View before = random.next();
        const dvec2 at(random.real(0, v.sample.band.image.x), random.real(0, v.sample.band.image.y));
        const shared::Frame frame = frame_constants(v.camera, before.camera, before.origin, before.reach, v.sample);
        const CameraRay ray = camera_ray(before.camera, v.sample.band.image, at);
        const Projected p = project(frame.previous_view_projection,
                                    ray.origin + before.reach * ray.along - before.origin, v.sample.band.image);
        for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(p.place[axis], at[axis], p.error[axis]);
    }
}

TEST(FrameConstants, HalfAPixelIsThatOfOneEye) {
    SampleView view;
    view.band.image = {40, 20}, view.band.rows = 20;
    const auto half = [&](const Optics& optics) {
        Camera camera;
        camera.vertical_fov = 2 * std::atan(0.5);
        camera.optics = optics;
        return frame_constants(camera, camera, dvec3(0), 1, view).half_pixel;
    };
    EXPECT_FLOAT_EQ(half({}), 0.5f / 20);
    EXPECT_FLOAT_EQ(half({.stereo = Stereo::left}), 0.5f / 20);
    EXPECT_FLOAT_EQ(half({.stereo = Stereo::over_under}), 0.5f / 10);
    EXPECT_FLOAT_EQ(half({.projection = Projection::panorama}), float(kPi / 40));
}

TEST(FrameConstants, TheLastBandEndsAtTheImage) {
    const Camera camera = look_at_camera({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 1);
    SampleView view;
    view.band = {{100, 70}, 48, 48};
    view.sample = 5, view.seed = 77;
    const shared::Frame frame = frame_constants(camera, camera, dvec3(0), 1, view);
    EXPECT_EQ(ivec4(frame.size, frame.band_y, frame.band_rows), ivec4(100, 70, 48, 22));
    EXPECT_EQ(uvec2(frame.tiles_x, frame.tiles_y), uvec2(7, 3)) << "of the band as it was allocated";
    EXPECT_EQ(uvec2(frame.sample_index, frame.seed), uvec2(5, 77));
}

TEST(FrameConstants, FramesHaveNoiseOfTheirOwn) {
    std::set<std::uint32_t> seeds;
    const FrameNumber frames[] = {kLeastFrame, -2, -1, 0, 1, 2147483647, 2147483648, kMostFrame - 1, kMostFrame};
    for (const FrameNumber number : frames) {
        FrameSettings frame;
        frame.frame = number;
        seeds.insert(sample_view(frame, {{16, 16}, 0, 16}, 0, SamplePoints::sobol).seed);
    }
    EXPECT_EQ(seeds.size(), std::size(frames));
}

using CameraRayTest = GpuTest;

TEST_F(CameraRayTest, KernelsSeeTheSameRays) {
    const gpu::Program program = gpu::Program::compute({"camera rays", R"(
#include "shaders/lib/camera.glsl"
layout(local_size_x = 1) in;
layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) writeonly buffer Rays { Ray rays[]; };
uniform ivec2 pixel;
uniform int place;
void main() { rays[place] = camera_ray(frame, pixel); }
)"});
    constexpr int kViews = 300;
    RandomViews random;
    const gpu::Buffer rays("rays", kViews * sizeof(shared::Ray));
    program.bind_storage("Rays", rays);
    std::vector<View> views;
    std::vector<ivec2> pixels;
    for (int i = 0; i < kViews; ++i) {
        const View v = random.next_with_planes(i);
        const shared::Frame frame = v.frame();
        gpu::Buffer constants("frame", sizeof(frame));
        constants.write(0, sizeof(frame), &frame);
        program.bind_uniform("FrameBlock", constants);
        pixels.push_back(random.pixel(v));
        program.set("pixel", pixels.back());
        program.set("place", i);
        program.dispatch(1);
        views.push_back(v);
    }
    const std::vector<shared::Ray> found = rays.read<shared::Ray>();
    for (int i = 0; i < kViews; ++i) {
        const View& v = views[i];
        const CameraRay ray = camera_ray(v.camera, v.sample.band.image, dvec2(pixels[i]) + dvec2(v.sample.jitter));
        const shared::Ray& r = found[i];
        const double slope = glm::length(ray.along);
        // Origins are rounded to float before an offset of at most the view's size is added. Directions have about ten
        // roundings of components as long as the direction itself, including the image's half size.
        const double size = glm::length(ray.origin - v.origin) + v.camera.ortho_height * v.sample.band.image.x;
        EXPECT_LT(glm::length(dvec3(r.origin) - (ray.origin - v.origin)), 10 * kRounding * size) << i;
        const double half_width = std::tan(v.camera.vertical_fov / 2) * v.sample.band.image.x / v.sample.band.image.y;
        EXPECT_LT(glm::length(dvec3(r.direction) - ray.along / slope), 12 * kRounding * (1 + half_width / slope)) << i;
        EXPECT_NEAR(glm::length(r.direction), 1, 4 * kRounding);
        EXPECT_NEAR(r.t_min, v.near() * slope, 8 * kRounding * v.near() * slope);
        const double far = v.camera.far_plane * slope;
        if (far > 0)
            EXPECT_NEAR(r.t_max, far, 8 * kRounding * far);
        else
            EXPECT_EQ(r.t_max, kInfinity);
    }
}

}  // namespace
}  // namespace halflight
