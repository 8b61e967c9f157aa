#include "renderer/frame_constants.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "passes/surface/raster_window.h"
#include "shaders/shared/sobol.h"

namespace halflight {
namespace {

struct Clip {
    double near_plane;
    double far_plane;
};

/// Returns the clip planes. With reversed float depth, the distance of the near plane only scales all depths, so the
/// precision does not depend on it. If the camera sets no near plane, the plane is closer than any surface, even in
/// scenes of 10^7 m.
Clip clip_of(const Camera& camera, double reach) {
    const double chosen = camera.orthographic ? 0.0 : std::max(reach, 1e-18) * 0x1p-60;
    return {camera.near_plane > 0 ? camera.near_plane : chosen,
            camera.far_plane > 0 ? camera.far_plane : std::numeric_limits<double>::infinity()};
}

/// Returns half the width and height of the view on the plane at distance 1 (orthographic: on any plane).
dvec2 half_extent(const Camera& camera, const ivec2& image) {
    const double half = camera.orthographic ? 0.5 * camera.ortho_height : std::tan(0.5 * camera.vertical_fov);
    return {half * image.x / image.y, half};
}

/// Returns the radius of the image circle of a fisheye, plane coordinates (shaders/shared/ray_projections.h).
double image_circle(const Optics& optics) {
    const double angle = glm::radians(optics.fisheye_fov) / 2;
    return optics.projection == Projection::fisheye ? angle : 2 * std::sin(angle / 2);
}

/// Returns the plane coordinates of the picture of one eye, from its centre to its upper right corner.
dvec2 half_plane(const Camera& camera, const dvec2& eye) {
    switch (camera.optics.projection) {
        case Projection::camera:
            break;
        case Projection::panorama:
            return {kPi, kPi / 2};
        case Projection::fisheye:
        case Projection::equisolid:
            return image_circle(camera.optics) * eye / std::min(eye.x, eye.y);
    }
    return std::tan(camera.vertical_fov / 2) * dvec2(eye.x / eye.y, 1);
}

/// Returns the largest distance of the scene from the camera; 1 for an empty scene.
double reach_of(const TraceTables& tables, const Camera& camera) {
    if (tables.bounds.empty()) return 1;
    const dvec3 eye = dvec3(camera.camera_to_world[3]) - tables.origin;
    const dvec3 far_corner =
        glm::max(glm::abs(dvec3(tables.bounds.lower) - eye), glm::abs(dvec3(tables.bounds.upper) - eye));
    return glm::length(far_corner);
}

vec2 jitter_of(const SampleView& view, const PixelFilter& filter) {
    return sample_point(filter, shared::sample_2d(shared::make_sampler(~0u, ~0u, view.sample, view.seed), 0));
}

/// Returns SampleView::at. of_frame: seed of the times that samples share.
double shutter_time(int times, const SampleView& view, std::uint32_t of_frame) {
    // Shutter times have sequences apart from those of pixels and of their common sample point.
    const auto number = [](std::uint32_t sequence, std::uint32_t index, std::uint32_t seed) {
        return double{shared::sample_1d(shared::make_sampler(~0u, sequence, index, seed), 0)};
    };
    const double own = number(~1u, view.sample, view.seed);
    if (times == 0) return own;
    const double stratum = std::floor(own * times);
    return (stratum + number(~2u, static_cast<std::uint32_t>(stratum), of_frame)) / times;
}

/// Returns SampleView::shared_count of blue noise.
std::uint32_t blue_noise_count(const FrameSettings& frame) {
    const int whole = frame.first_sample == 0 ? frame.samples : 0;
    const int samples = frame.of_samples > 0 ? frame.of_samples : whole;
    if (frame.time_limit > 0 || frame.error || samples > kMostBlueNoiseSamples) return 0;
    return samples > 0 ? std::bit_ceil(static_cast<std::uint32_t>(samples)) : 0;
}

void set_lens(const Camera& camera, const ivec2& image, shared::Frame& frame) {
    const Lens& lens = camera.lens;
    if (!lens.blurs()) return;
    assert(lens.focus.kind == Focus::Kind::distance);
    const double radius = aperture_radius(camera, eye_aspect(camera.optics, image)), turn = glm::radians(lens.rotation);
    const dvec3 right(camera.camera_to_world[0]), up(camera.camera_to_world[1]);
    frame.lens_x = vec4(vec3(radius * (std::cos(turn) * right + std::sin(turn) * up)), 1 / lens.focus.distance);
    frame.lens_y = vec4(vec3(radius * (std::cos(turn) * up - std::sin(turn) * right)), lens.blades);
}

/// Replaces the camera by one that shaders/shared/ray_projections.h describes.
void set_optics(const Camera& camera, const Camera& previous, const dvec3& origin, shared::Frame& frame) {
    dmat4 from_origin(1);
    from_origin[3] = dvec4(origin, 1);
    frame.view_projection = mat4(glm::inverse(camera.camera_to_world) * from_origin);
    frame.previous_view_projection = mat4(glm::inverse(previous.camera_to_world) * from_origin);
    frame.camera_right = vec4(vec3(dvec3(camera.camera_to_world[0])), 0);
    frame.camera_up = vec4(vec3(dvec3(camera.camera_to_world[1])), 0);
    frame.optics = shader_optics(camera, frame.size);
    frame.half_pixel = frame.optics.half_extent.y / shared::eye_size(frame.optics, frame.size).y;
    frame.optics.earlier_zoom = shader_optics(previous, frame.size).half_extent.y / frame.optics.half_extent.y;
}

}  // namespace

shared::Optics shader_optics(const Camera& camera, const ivec2& image) {
    const Optics& optics = camera.optics;
    const bool right = optics.stereo == Stereo::right;
    const dvec2 eyes = eyes_in_picture(optics);
    shared::Optics o{};
    o.half_extent = half_plane(camera, dvec2(image) / eyes);
    o.circle = static_cast<float>(optics.is_fisheye() ? image_circle(optics) : 0);
    if (optics.stereo != Stereo::none) o.eye = static_cast<float>((right ? 0.5 : -0.5) * optics.eye_distance);
    o.toe_in = static_cast<float>(optics.convergence > 0 ? 1 / optics.convergence : 0);
    o.projection = optics.projection == Projection::panorama    ? shared::kPanorama
                   : optics.projection == Projection::fisheye   ? shared::kFisheye
                   : optics.projection == Projection::equisolid ? shared::kEquisolid
                                                                : shared::kPerspective;
    o.layout_of_eyes = eyes.y > 1 ? shared::kOverUnder : eyes.x > 1 ? shared::kSideBySide : shared::kOneEye;
    o.earlier_zoom = 1;
    return o;
}

SamplePoints points_of(const FrameSettings& frame, SamplePoints wanted) {
    return wanted == SamplePoints::blue_noise && blue_noise_count(frame) == 0 ? SamplePoints::sobol : wanted;
}

dmat4 world_to_clip(const Camera& camera, const ivec2& image, double reach) {
    const Clip clip = clip_of(camera, reach);
    const dvec2 half = half_extent(camera, image);
    dmat4 projection(0);
    projection[0][0] = 1 / half.x;
    projection[1][1] = 1 / half.y;
    if (camera.orthographic) {
        // Depth is 1 at the near plane and 0 at the far plane, or just beyond the scene if that is nearer, since all
        // depths share the precision of a float. The camera rays' t_max enforces the far plane.
        const double far_plane = std::min(clip.far_plane, clip.near_plane + 2 * std::max(reach, 1e-30));
        projection[2][2] = 1 / (far_plane - clip.near_plane);
        projection[3][2] = far_plane / (far_plane - clip.near_plane);
        projection[3][3] = 1;
    } else {
        // z = near / distance; the camera rays' t_max enforces a finite far plane.
        projection[2][3] = -1;
        projection[3][2] = clip.near_plane;
    }
    return projection * glm::inverse(camera.camera_to_world);
}

shared::Frame frame_constants(const Camera& camera, const Camera& previous, const dvec3& origin, double reach,
                              const SampleView& view) {
    const ivec2 image = view.band.whole();
    const Clip clip = clip_of(camera, reach);
    const dvec2 half = half_extent(camera, image);
    const auto from_origin = [&](const dmat4& clip_from_world) {
        dmat4 shift(1);
        shift[3] = dvec4(origin, 1);
        dmat4 y_down(1);
        y_down[1][1] = -1;
        return y_down * clip_from_world * shift;
    };
    // The matrix maps pixel coordinates of the whole image to clip space of the window, and moves the sample point to
    // the pixel's centre.
    const RasterWindow drawn = raster_window(view.band);
    const dvec2 size(image.x, drawn.rows);
    dmat4 window(1);
    window[0][0] = 1;
    window[3][0] = 2 * (0.5 - view.jitter.x) / size.x;
    window[1][1] = image.y / size.y;
    window[3][1] = (image.y - 2.0 * drawn.y + 2 * (0.5 - view.jitter.y)) / size.y - 1;

    shared::Frame frame{};
    frame.view_projection = mat4(window * from_origin(world_to_clip(camera, image, reach)));
    frame.previous_view_projection = mat4(from_origin(world_to_clip(previous, image, reach)));
    frame.camera_position = vec4(vec3(dvec3(camera.camera_to_world[3]) - origin), camera.orthographic ? 0 : 1);
    frame.camera_right = vec4(vec3(dvec3(camera.camera_to_world[0]) * half.x), 0);
    frame.camera_up = vec4(vec3(dvec3(camera.camera_to_world[1]) * half.y), 0);
    frame.camera_forward = vec4(vec3(-dvec3(camera.camera_to_world[2])), 0);
    frame.half_pixel = static_cast<float>(half.y / image.y);
    frame.jitter = view.jitter;
    frame.clip = vec2(clip.near_plane, clip.far_plane);
    frame.size = image;
    frame.band_x = view.band.origin.x;
    frame.band_y = view.band.origin.y + view.band.y;
    frame.band_columns = view.band.image.x;
    frame.band_rows = std::min(view.band.rows, view.band.image.y - view.band.y);
    frame.sample_index = view.sample;
    frame.seed = view.seed;
    frame.tiles_x = view.band.tiles().x;
    frame.tiles_y = view.band.tiles().y;
    frame.window_y = drawn.y;
    frame.begins = view.begins ? 1 : 0;
    frame.shared_count = view.shared_count;
    frame.first_half = view.first_half ? 1 : 0;
    set_lens(camera, image, frame);
    if (camera.optics.traced()) set_optics(camera, previous, origin, frame);
    return frame;
}

bool in_first_half(std::uint32_t number) {
    return number < 2 ? number == 0 : (number & (std::bit_floor(number) >> 1)) == 0;
}

SampleView sample_view(const FrameSettings& frame, const Band& band, std::uint32_t index, SamplePoints points) {
    SampleView view{.band = band, .sample = index, .begins = index == static_cast<std::uint32_t>(frame.first_sample)};
    // Parts of a picture have halves together, and other ranges of samples have halves of their own.
    view.first_half = in_first_half(frame.parts > 1 ? index : index - static_cast<std::uint32_t>(frame.first_sample));
    std::uint32_t of_frame =
        shared::hash_combine(shared::hash_u32(frame.seed), static_cast<std::uint32_t>(frame.frame));
    constexpr FrameNumber kMost = std::numeric_limits<std::int32_t>::max();
    if (frame.frame > kMost) of_frame = shared::hash_combine(of_frame, 1);  // negative frames have the same 32 bits
    view.seed = of_frame;
    // The first points of unrelated sequences are independent.
    if (points == SamplePoints::independent) view.seed = shared::hash_combine(view.seed, index), view.sample = 0;
    if (frame.shutter_times) view.at = shutter_time(*frame.shutter_times, view, of_frame);
    const std::uint32_t count = points == SamplePoints::blue_noise ? blue_noise_count(frame) : 0;
    if (index < count) view.shared_count = count;
    view.jitter = jitter_of(view, frame.filter);
    return view;
}

std::vector<int> order_of_samples(const FrameSettings& frame, int from, int to,
                                  const std::function<SampleView(int number)>& view) {
    if (frame.shutter_times.value_or(0) == 0) return {};
    std::vector<std::pair<double, int>> samples;
    for (int number = from; number < to; ++number) samples.emplace_back(view(number).at, number);
    std::ranges::sort(samples);
    std::vector<int> order;
    for (const auto& [at, number] : samples) order.push_back(number);
    return order;
}

SampleView seen_view(const SampleView& sample, const PixelFilter& filter, int number, int count) {
    SampleView view = sample;
    view.sample = sample.sample * static_cast<std::uint32_t>(count) + static_cast<std::uint32_t>(number);
    view.shared_count *= static_cast<std::uint32_t>(count);
    view.jitter = jitter_of(view, filter);
    return view;
}

shared::Frame frame_constants(const FrameSettings& frame, const TraceTables& tables, const SampleView& view) {
    return frame_constants(frame.camera, frame.previous_camera.value_or(frame.camera), tables.origin,
                           reach_of(tables, frame.camera), view);
}

CameraPlaces::CameraPlaces(const Camera& camera, const ivec2& image) : image_(image), size_(image) {
    if (camera.optics.traced()) {
        optics_ = shader_optics(camera, image);
        to_ = glm::inverse(camera.camera_to_world);
    } else {
        to_ = world_to_clip(camera, image, 1);  // depth is not used
    }
}

std::optional<dvec2> CameraPlaces::place(const dvec3& point, const ivec2& pixel) const {
    const dvec4 p = to_ * dvec4(point, 1);
    if (!optics_) {
        if (!(p.w > 0)) return std::nullopt;
        return dvec2(0.5 + 0.5 * p.x / p.w, 0.5 - 0.5 * p.y / p.w) * size_;
    }
    const bool second = shared::shows_second_eye(*optics_, pixel, image_);
    const vec3 plane = shared::plane_of_point(*optics_, shared::eye_of(*optics_, second), vec3(p));
    if (!(plane.z > 0)) return std::nullopt;
    return dvec2(shared::place_of_plane(*optics_, second, vec2(plane), image_));
}

dvec2 CameraPlaces::shorter(dvec2 way) const {
    if (!optics_ || optics_->projection != shared::kPanorama) return way;
    const double around = double{shared::eye_size(*optics_, image_).x};
    way.x -= around * std::round(way.x / around);
    return way;
}

}  // namespace halflight
