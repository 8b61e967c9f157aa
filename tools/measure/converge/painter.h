// Who makes pictures: the engine, by whichever way of tracing, and the oracle.
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

/// Of the picture that all methods make.
struct View {
    int width = 0;   // pixels
    int height = 0;  // pixels
    Camera camera;
    int bounces = 8;
    PixelFilter filter{};
};

/// Called now and then during long work; what it throws ends the work.
using Pulse = std::function<void()>;

struct Painted {
    Picture picture;
    Seconds time;  // of the samples, down to the picture in memory; without preparation and compilation of shaders
};

class Painter {
  public:
    virtual ~Painter() = default;
    virtual Painted paint(const Budget& budget, std::uint32_t seed, const Pulse& pulse) = 0;
    /// Of one more picture, made with each pass waited for; empty where there are no passes.
    virtual std::vector<PassTime> passes(const Budget& budget, std::uint32_t seed, const Pulse& pulse) = 0;
    /// Of what was done once, before the first picture, and is not shared with other painters.
    virtual Seconds preparation() const = 0;
};

/// Method::oracle is none of these. The scene and the colours must outlive the painter.
/// `clamp`, `preview`: of RenderSettings. `warm_up`: Plan::warm_up.
std::unique_ptr<Painter> gl_painter(PreparedScene& scene, const ColorConfig& colors, const View& view, Method method,
                                    float clamp = 0, const Preview& preview = {}, int warm_up = 0);
std::unique_ptr<Painter> oracle_painter(const Scene& scene, const View& view);

/// Samples [first, first + count) of the oracle's picture of this seed: disjoint ranges are independent.
Picture oracle_samples(const ReferenceScene& scene, const View& view, std::uint64_t seed, int first, int count);

}  // namespace halflight::converge
