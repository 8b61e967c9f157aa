// Rendering to an error target. A band's samples are divided into independent replicates, each with a Sobol sequence of
// its own (seed). The samples of a single sequence do not tell how far it has converged.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/replicates.h"
#include "renderer/film.h"
#include "renderer/frame_constants.h"

namespace halflight {

/// Number of replicates: enough to estimate an error and its confidence. Each costs 12 bytes per pixel of a band.
inline constexpr int kReplicates = 8;
/// Samples of each replicate before the first error estimate; a single sample misses rare light.
inline constexpr int kFirstLook = 2;
inline constexpr int kMostReplicateSamples = 1 << 20;  ///< largest number of samples of a replicate

/// Returns sample `index` of a replicate. Its seed is independent of sample_view() and of the other replicates.
SampleView replicate_view(const FrameSettings& frame, const Band& band, int replicate, int index, SamplePoints points);

/// Estimates the error of a picture, or of a part of it. The weights of a relative error would have to come from the
/// true picture. Weights from the picture itself underestimate it, since outliers get little weight. Weights for each
/// replicate from all others overestimate it, since a noisy mean gives larger weights than the true one. The two are
/// bounds, which meet as the picture converges.
class PictureError {
  public:
    /// Adds a value of the picture: its estimate by each replicate.
    void add(std::span<const double> values, ErrorMetric metric);
    void add(const PictureError& part);
    /// Returns the estimate of a picture that ends once its bound is at most `target`. `chances` is the number of
    /// earlier estimates of this picture below the target, each of which could have ended it too early; it is updated.
    /// The probability that the j-th of them is wrong is limited to (1 - kConfidence) / 2^j, so the bound of the
    /// picture holds with kConfidence wherever it ends (Boole's inequality).
    ErrorEstimate judge(double target, int& chances);
    /// Takes account of looks at other estimates of this picture: estimate() is at the confidence of `chances` of them.
    void count(int chances) { chances_ = std::max(chances_, chances); }
    /// Returns the estimate; after judge(), at the confidence that it used. Sums use the highest confidence.
    ErrorEstimate estimate() const;

  private:
    ReplicateError low_{kReplicates}, high_{kReplicates};
    int chances_ = 0;
};

/// Returns the chances with which judge() begins for a part of the samples, 0 for a whole picture. N parts are merged,
/// and the picture ends where each part has ended. The probability that the j-th estimate of a part is wrong is limited
/// to (1 - kConfidence) / (2 N 2^j) at most, so the bounds of all parts hold together (Boole's inequality). One half is
/// the margin for the estimate of the merged picture, in which the errors of different parts are multiplied, too.
int first_chances(int parts);

/// Values of a picture that shadow catchers change.
enum class Shadows : std::uint8_t {
    none,      // there are no catchers
    in_color,  // they darken the background; alpha is 1
    in_alpha,  // they also add to alpha, whose error counts like that of a colour
};

/// Collects the replicates of a band.
class BandReplicates {
  public:
    explicit BandReplicates(const Band& band, Shadows shadows = Shadows::none);

    /// Adds the difference of the band's sums since the last call to a replicate. Shadows need Film::Sums::catchers.
    void add(int replicate, const Film::Sums& sums);
    /// Adds the replicates of another part of the samples of the same band.
    void add(const BandReplicates& part);
    /// Returns the state, for set() of an object of the same band: a few arrays of numbers.
    std::vector<std::vector<std::byte>> state() const;
    static constexpr std::size_t kArrays = 1 + kReplicates;  ///< number of arrays of state()
    /// Returns false, and changes nothing, unless the arrays have the sizes of this band.
    bool set(std::span<const std::vector<std::byte>> state);
    /// Adds the error of the mean of all replicates to that of the picture. Each replicate has counts[b] samples in
    /// block b of the band's 256-path blocks, and then parts are added row by row of blocks, so that the sum does not
    /// depend on bands; or counts has one element, the number of all blocks.
    void add_error(ErrorMetric metric, std::span<const std::uint32_t> counts, PictureError& picture) const;
    /// Returns the bytes per pixel.
    static constexpr std::size_t bytes(Shadows shadows) {
        return (shadows == Shadows::none ? 3 : 10) * (sizeof(double) + kReplicates * sizeof(float));
    }

  private:
    std::uint32_t path_of(std::size_t pixel) const;
    /// Returns value i of the sums.
    double value_of(std::size_t i, const Film::Sums& sums) const;
    /// Adds the channels of a pixel, of which each replicate holds the sums over `samples`.
    void add_pixel(std::size_t pixel, double samples, ErrorMetric metric, PictureError& error) const;

    Band band_;
    Shadows shadows_;
    std::size_t values_;                          // number of values of a pixel
    std::vector<double> before_;                  // sums at the last call, by pixel and value: rgb, shadows
    std::vector<std::vector<float>> replicates_;  // sums by replicate, pixel and value
};

/// Returns the number of samples of each replicate at the next error estimate: the expected number, but at most twice
/// the current one. It is at least a quarter larger, since every estimate is a chance to stop too early.
int next_replicate_samples(int samples, const ErrorEstimate& estimate, double target);

}  // namespace halflight
