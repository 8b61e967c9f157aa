// Settings that may differ from one picture of a renderer to the next.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/core/frames.h"
#include "engine/core/pixel_filter.h"
#include "engine/scene/scene.h"

namespace halflight {

inline constexpr int kMaxSamples = 1 << 24;  ///< samples per pixel; a float32 counts no further

enum class ErrorMetric { mse, relmse };  // metrics of engine/core/metrics.h
const char* name(ErrorMetric metric);

/// Target for the error of the picture: the mean over pixels and channels of its linear Rec.709 radiance.
struct ErrorTarget {
    ErrorMetric metric = ErrorMetric::relmse;
    double error = 0.01;  // > 0
    bool operator==(const ErrorTarget&) const = default;
};

/// The view of the scene: camera, frame number, and times of the shutter.
struct SceneSettings {
    Camera camera;
    std::optional<Camera> previous_camera{};  // camera of the previous frame, for the layer "motion"; none: `camera`
    // Motion blur: number of different times at which samples are taken while the shutter is open, as in Cook, Porter
    // and Carpenter 1984, Distributed Ray Tracing. All pixels share the time of a sample (SampleView::at). The opening
    // has as many strata, and each has one time for all its samples. 0: each sample has a time of its own; none: that
    // of the frame. PictureInputs::pose poses the scene.
    std::optional<int> shutter_times{};
    int part = 0;              // number of the part of the samples that is rendered, 1 to `parts`; 0: all parts
    bool stays_noisy = false;  // a picture that would be denoised stays the mean of its samples, without layers
    FrameNumber frame = 0;     // frame number, which seeds the noise
};

/// Settings that may differ between the pictures of one renderer. settings_table.h describes the public ones.
struct FrameSettings : SceneSettings {
    int samples = 64;      // samples per pixel, > 0; an upper limit if time_limit or error is set
    int first_sample = 0;  // number of the picture's first sample in the frame's sequence, >= 0
    // Number of parts of equal length in which samples are summed; the sums of the parts are added in order. Parts can
    // be rendered apart and merged, to the same bits (settings_of_part()). 1 to `samples`.
    int parts = 1;
    int of_samples = 0;    // length of the frame's sequence if the picture is a part of it; 0: unknown
    PixelFilter filter{};  // reconstruction filter of radiance; layers at pixel centres are not filtered
    double time_limit =
        0;  // seconds; > 0: samples are added until this time, at least one, or two to denoise; 0: no limit
    std::uint32_t seed = 0;  // seed of the noise; different seeds give independent noise
    /// Samples are added until the error is below the target at kConfidence (engine/core/statistics.h). The number of
    /// samples is then a multiple of kReplicates, and at least twice as many (renderer/replicates.h).
    std::optional<ErrorTarget> error{};
};

/// Returns the settings of part `number` of the samples, 1 to settings.parts. It is a range of the frame's samples. If
/// noise decides about their number, by an error target or by adaptive sampling, it is a picture of its own with a seed
/// of its own. Its error is `parts` times as large, so that the mean of all parts meets the target.
FrameSettings settings_of_part(const FrameSettings& settings, int number, bool adaptive);

}  // namespace halflight
