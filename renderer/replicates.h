// Rendering to an error instead of a number of samples: a band's samples are taken as independent replicates, each with
// a Sobol sequence of its own (seed), since the samples of one sequence do not tell how far it has converged.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/replicates.h"
#include "renderer/film.h"
#include "renderer/frame_constants.h"

namespace halflight {

/// Enough to tell an error and how sure it is; each one more keeps 12 bytes per pixel of a band and shortens sequences.
inline constexpr int kReplicates = 8;
inline constexpr int kFirstLook =
    2;  ///< samples of each before the error is looked at: with one, rare light is not met
inline constexpr int kMostReplicateSamples = 1 << 20;  ///< of each

/// Sample `index` of a replicate. Its seeds have nothing to do with those of sample_view(), nor with each other.
SampleView replicate_view(const FrameSettings& frame, const Band& band, int replicate, int index, SamplePoints points);

/// The error of a picture, or of a part of it. Weights of a relative error would have to come from the true picture.
/// From the picture itself they make it too low, outliers having little weight; each replicate's from all others, too
/// high, the weight of a noisy mean being larger than that of the true one. The two are its bounds; they meet as it
/// converges.
class PictureError {
  public:
    /// Of a value of the picture: what each replicate has for it.
    void add(std::span<const double> values, ErrorMetric metric);
    void add(const PictureError& part);
    ErrorEstimate estimate() const;

  private:
    ReplicateError low_{kReplicates}, high_{kReplicates};
};

class BandReplicates {
  public:
    explicit BandReplicates(const Band& band);

    /// What has come to the band's sums since the last call is this replicate's.
    void add(int replicate, const Film::Sums& sums);
    /// Of the mean of all, which have `samples` each.
    PictureError error(ErrorMetric metric, int samples) const;

  private:
    Band band_;
    std::vector<double> before_;                  // beauty sums of the last call, by pixel and channel
    std::vector<std::vector<float>> replicates_;  // beauty sums
};

/// How many samples each replicate should have when the error is looked at next: as many as it seems to take, but no
/// more than twice what they have, nor less than a quarter more, since every look is a chance to stop too early.
int next_replicate_samples(int samples, const ErrorEstimate& estimate, double target);

}  // namespace halflight
