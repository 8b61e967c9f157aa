// Motion blur: the mean of pictures at several times while the shutter is open (Cook, Porter, Carpenter 1984,
// Distributed Ray Tracing, with one time for the samples of many pixels).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/cryptomatte.h"
#include "renderer/noisy_frame.h"
#include "renderer/render.h"

namespace halflight {

/// A time while the shutter is open, and its share of the frame's samples.
struct ShutterTime {
    double at = 0;         // fraction of the opening time, [0,1)
    int first_sample = 0;  // FrameSettings::first_sample
    int samples = 1;       // > 0
};

/// Divides the opening time of the shutter into strata proportional to their numbers of samples, and draws one random
/// time in each. The mean of all samples is then unbiased. 1 <= times <= samples. The result depends on the arguments
/// alone.
std::vector<ShutterTime> shutter_times(int samples, int times, std::uint32_t seed, std::uint32_t frame);

/// Merges the pictures of shutter_times() into one, each layer by its LayerMerge (engine/settings/layers.h). Shadows on
/// catchers are ratios of sums over all times (SHADING.md), so pictures with catchers need RenderResult::catchers. The
/// variance is that of the mean, given the times. Mattes cover ids that are among the ranks at any time. Layers without
/// a mean are taken from take()'s `still`.
class ShutterMean {
  public:
    /// aovs: layers of all pictures, in their order. samples: number of samples at all times together.
    ShutterMean(const std::vector<std::string>& aovs, int samples);

    /// Adds the picture of a time.
    void add(const RenderResult& picture);
    /// Returns whether take() needs a picture at the frame's own time.
    bool wants_still() const;
    /// Returns the merged picture, without a view: the mean of the samples that were added, which may be fewer than
    /// all. Layers without a mean are those of `still`, or of the first picture where `still` is empty. RenderStats are
    /// sums; batches are those of the last picture. Precondition: a picture was added.
    RenderResult take(RenderResult still);

  private:
    struct Layer {
        const AovInfo* aov;
        std::vector<double> sums;  // sums of values, weighted by the layer's LayerMerge
        IdCoverage coverage;       // coverage by pixel; empty except for mattes
    };
    void add_layer(Layer& layer, const Image& image, int samples);

    int samples_;
    std::vector<double> beauty_;    // without the shadows on catchers
    std::vector<double> catchers_;  // means of RenderResult::catchers
    std::vector<Layer> layers_;
    RenderResult result_;  // the first picture, with statistics and attributes of all pictures so far
};

/// Merges the noisy halves of shutter_times() into those of the whole frame: means of light, albedo and surface
/// properties over all samples. Light is divided by the mean albedo after it is merged, because a pixel may show other
/// surfaces at other times. Needs a current context.
class ShutterHalves {
  public:
    /// Peak number of bytes per pixel: sums, and copies of textures in add().
    static constexpr std::size_t kBytes =
        (6 + 2 * kFilteredLights.size() + 6) * sizeof(vec4) + 4 * sizeof(double) + sizeof(float);

    /// samples: number of samples at all times together.
    explicit ShutterHalves(int samples) : of_samples_(samples) {}
    /// Adds the halves of a time, made with SampleHalves::merges.
    void add(NoisyFrame& time);
    /// Writes the merged halves into `frame`, whose textures and lens are those of any time. picture: the merged
    /// picture, which may be a part of the pixels that are rendered. All times must have been added.
    void take(const Image& picture, NoisyFrame& frame);

  private:
    std::vector<std::vector<vec4>> sums_;  // by DenoiserTextures::all()
    std::vector<double> mean_;             // of the rendered pixels
    std::vector<float> covered_;           // samples of the times at which a pixel shows a surface
    int of_samples_;
    int samples_ = 0, first_ = 0;  // samples of the times so far; of those, in the first half
};

}  // namespace halflight
