// What may differ from one picture of a scene to the next.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/scene/motion.h"
#include "engine/scene/scene.h"
#include "engine/core/pixel_filter.h"

namespace halflight {

class PictureHistory;

enum class ErrorMetric { mse, relmse };  // engine/core/metrics.h
const char* name(ErrorMetric metric);

/// An error of the picture, as the mean over pixels and channels of its linear Rec.709 radiance.
struct ErrorTarget {
    ErrorMetric metric = ErrorMetric::relmse;
    double error = 0.01;  // > 0
};

struct FrameSettings {
    Camera camera;
    std::optional<Camera> previous_camera{};  // of the frame before, for the motion output; without: `camera`
    const PreviousSurfaces* previous_surfaces = nullptr;  // of the frame before, likewise; null: as they are
    // With Preview::temporal: what earlier pictures have left to this one, and what it leaves; null: nothing.
    PictureHistory* history = nullptr;
    int samples = 64;       // per pixel, > 0
    int first_sample = 0;   // >= 0; the picture's are those from here on of the frame's sequence
    int of_samples = 0;     // that the frame's sequence has in all, where the picture is a part of it; 0: not known
    PixelFilter filter{};   // that the picture is made with; data at pixel centres is without
    double time_limit = 0;  // seconds; > 0: samples are added until it is spent, at least one, `samples` at most
    /// Samples are added until the error is below it at kConfidence (engine/core/statistics.h), `samples` at most. Then
    /// there are a multiple of kReplicates samples, at least twice as many (renderer/replicates.h).
    std::optional<ErrorTarget> error{};
    std::uint32_t seed = 0;   // independent pictures of the same frame
    std::uint32_t frame = 0;  // frame number: other noise for every frame
};

}  // namespace halflight
