// The renderers that are compared: the engine with each tracing method, the oracle, external programs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "engine/color/color.h"
#include "engine/core/stopwatch.h"
#include "engine/device/prepared_scene.h"
#include "engine/gpu/context.h"
#include "engine/reference/reference.h"
#include "renderer/render.h"
#include "tools/measure/converge/picture.h"
#include "tools/measure/converge/plan.h"

namespace halflight::converge {

/// Settings of the picture that all methods render.
struct View {
    int width = 0;   // width of the picture, pixels
    int height = 0;  // height of the picture, pixels
    Camera camera;
    int bounces = 8;
    PixelFilter filter{};
};

/// Callback that long work calls repeatedly; an exception from it ends the work.
using Pulse = std::function<void()>;

struct Painted {
    Picture picture;
    Seconds time;  // time from the first sample to the picture in memory, without preparation and compilation
};

class Painter {
  public:
    virtual ~Painter() = default;
    virtual Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) = 0;
    /// Renders one more picture, waits for each pass, and returns their times; empty for renderers without passes.
    virtual std::vector<PassTime> passes(const Budget& budget, std::uint32_t seed, const Pulse& pulse) = 0;
    /// Returns the time of the preparation before the first picture that is not shared with other painters.
    virtual Seconds preparation() const = 0;
};

/// Returns the engine with a method for which uses_gl() holds. The scene and the colours must outlive it. `clamp` is
/// that of RenderSettings, `warm_up` is Plan::warm_up. Denoised pictures need at least two samples.
std::unique_ptr<Painter> gl_painter(PreparedScene& scene, const ColorConfig& colors, const View& view, Method method,
                                    float clamp = 0, const Technique& technique = {}, int warm_up = 0);
std::unique_ptr<Painter> oracle_painter(const Scene& scene, const View& view);

/// Returns the mean of samples [first, first + count) of the oracle's picture of this seed. Disjoint ranges are
/// independent.
Picture oracle_samples(const ReferenceScene& scene, const View& view, std::uint64_t seed, int first, int count);

}  // namespace halflight::converge
