// Frame constants: camera and sample as kernels read them.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "engine/device/scene_view.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/tables/tables.h"
#include "shaders/shared/frame_block.h"

namespace halflight {

/// A sample of a band: its place in the pixel and its random numbers.
struct SampleView {
    Band band;
    vec2 jitter{0.5f};         // sample point of every pixel, from its upper left corner, pixels
    std::uint32_t sample = 0;  // index of the sample in its sequence
    std::uint32_t seed = 0;    // seed of the sequences of all pixels
    // Blue noise: number of consecutive samples that each pixel takes from the shared sequence, a power of 2; 0: each
    // pixel has its own sequence.
    std::uint32_t shared_count = 0;
    double at = 0;           // motion blur: share of the shutter's opening time, [0,1)
    bool first_half = true;  // the sample belongs to the first half (in_first_half())
    bool begins = true;      // first sample of the picture, which overwrites the sums
};

/// Returns the constants of a sample. A lens that blurs must focus at a distance. origin: TraceTables::origin.
/// previous: camera of the previous frame. reach: world units, > 0; the scene lies within this distance of the camera.
/// It decides the near plane if the camera has none.
shared::Frame frame_constants(const Camera& camera, const Camera& previous, const dvec3& origin, double reach,
                              const SampleView& view);

/// Returns the sample points of a frame. Blue noise falls back to `sobol` if the number of samples is large or
/// unknown in advance.
SamplePoints points_of(const FrameSettings& frame, SamplePoints wanted);
/// Returns whether sample `number` of a picture, from 0, belongs to the first of two halves that the denoiser compares.
/// The samples from 2^k to 2^(k+1) - 1 are split in the middle. Each half then consists of aligned blocks of a
/// sequence, which are well distributed, whatever the number of samples; the halves are equal if that is a power of
/// two.
bool in_first_half(std::uint32_t number);
/// Returns sample `index` of a frame. All pixels share the sample point, as rasterization demands. Different frames and
/// different user seeds have independent seeds.
SampleView sample_view(const FrameSettings& frame, const Band& band, std::uint32_t index, SamplePoints points);
/// Returns the numbers `from` to `to` - 1 of samples in the order in which they are taken. They are sorted by their
/// times if several samples share a pose. Returns an empty list if they are taken in their own order.
std::vector<int> order_of_samples(const FrameSettings& frame, int from, int to,
                                  const std::function<SampleView(int number)>& view);
/// Returns the sample with the sample point of camera ray `number` of `count`. Together these points are the samples of
/// a sequence that is `count` times as long.
SampleView seen_view(const SampleView& sample, const PixelFilter& filter, int number, int count);
/// Returns the constants of a frame's sample.
shared::Frame frame_constants(const FrameSettings& frame, const TraceTables& tables, const SampleView& view);

/// Returns the matrix from world space to OpenGL clip space of the whole image: +y up, reversed depth (near 1, far 0).
/// Depths of orthographic cameras end just beyond `reach`, or at the far plane if that is nearer.
dmat4 world_to_clip(const Camera& camera, const ivec2& image, double reach);

/// Returns what shaders need of the optics of a camera that must be traced. image: size of the whole picture, pixels.
shared::Optics shader_optics(const Camera& camera, const ivec2& image);

/// Places of points in the picture of a camera.
class CameraPlaces {
  public:
    /// image: size of the whole picture, pixels.
    CameraPlaces(const Camera& camera, const ivec2& image);
    /// Returns the place of a point, pixels from the picture's upper left corner; none if it has none, such as
    /// behind a perspective camera. pixel: a pixel of the same eye.
    std::optional<dvec2> place(const dvec3& point, const ivec2& pixel) const;
    /// Returns a way between two places; in panoramas, the shorter way around.
    dvec2 shorter(dvec2 way) const;

  private:
    dmat4 to_{1};                           // world space to clip space, or with optics to camera coordinates
    std::optional<shared::Optics> optics_;  // none: the picture can be rasterized
    ivec2 image_;
    dvec2 size_;
};

}  // namespace halflight
