// Motion blur: a picture as the mean of pictures at times at which the shutter is open, each of which has a share of
// the samples (Cook, Porter, Carpenter 1984, Distributed Ray Tracing, with one time for the samples of many pixels).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "renderer/cryptomatte.h"
#include "renderer/render.h"

namespace halflight {

/// A time at which some of a frame's samples see the scene.
struct ShutterTime {
    double at = 0;         // of the time that the shutter is open, [0,1)
    int first_sample = 0;  // of the frame's (FrameSettings)
    int samples = 1;       // > 0
};

/// Strata of the time that the shutter is open, each as long as its share of the samples and seen at one random point
/// of it, so that the mean of all samples is unbiased. 1 <= times <= samples; a function of the arguments alone.
std::vector<ShutterTime> shutter_times(int samples, int times, std::uint32_t seed, std::uint32_t frame);

/// Merges the pictures of shutter_times() into one, each layer by its LayerMerge (engine/settings/layers.h). The
/// variance is that of the mean, given the times. Mattes cover what is among the ranks at any time. Layers without a
/// mean are those of take()'s `still`.
class ShutterMean {
  public:
    /// aovs: those that all pictures have, in their order. samples: of all times.
    ShutterMean(const std::vector<std::string>& aovs, int samples);

    void add(const RenderResult& picture);
    /// Whether take() wants a picture of the frame's own time.
    bool wants_still() const;
    /// What add() was given as one picture, without a view. RenderStats are sums, batches those of the last picture.
    RenderResult take(RenderResult still);

  private:
    struct Layer {
        const AovInfo* aov;
        std::vector<double> sums;  // weighted as the layer wants it
        IdCoverage coverage;       // of a Cryptomatte
    };
    void add_layer(Layer& layer, const Image& image, int samples);

    int samples_;
    std::vector<double> beauty_;
    std::vector<Layer> layers_;
    RenderResult result_;  // the first picture, with stats and attributes of all so far
};

}  // namespace halflight
