// Renders the samples of a picture by its plan (sample_plan.h).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "renderer/listed_samples.h"
#include "renderer/part_sums.h"
#include "renderer/render_state.h"
#include "renderer/replicates.h"
#include "renderer/sample_pace.h"
#include "renderer/sample_plan.h"

namespace halflight {

/// Adds the samples of a picture to the sums of its bands, and saves checkpoints.
class Renderer::State::Sampling {
  public:
    /// Callback after each sample. It receives the expected number of samples of all bands, and returns false to stop.
    using GoOn = std::function<bool(std::int64_t all)>;
    /// watch: time since the picture began. done: number of finished samples of each band, which is kept up to date.
    Sampling(State& state, const FrameSettings& frame, const SamplePlan& plan, const Stopwatch& watch,
             std::vector<int>& done, GoOn go_on);

    /// Adds all samples, until the plan ends or the callback stops it. Calls `rendered` for each band with samples,
    /// whose sums are valid during the call.
    void run(const std::function<void(int band)>& rendered);
    /// Returns the error of the picture; valid with an error target unless the callback stopped it.
    const PictureError& error() const { return error_; }

  private:
    using Counts = std::vector<std::uint32_t>;  // numbers of samples by block of pixels

    /// The look that a band takes part in.
    struct Look {
        int each = 0;            // samples of each sequence before it
        int next = 0;            // samples of each sequence after it
        int sequence = 0;        // sequence that grows
        int taken = 0;           // samples of all pixels that it has got in this look
        std::uint64_t runs = 0;  // runs of listed blocks that it has got in this look
        int chances = 0;         // PictureError::judge()
        bool ends = false;       // the band gets no further samples
    };
    /// A band whose samples are rendered.
    struct BandSamples {
        int index = 0;
        Band where;
        CompiledBand* with = nullptr;
        Look look{};
        bool restored = false;                       // an earlier run has rendered all samples
        std::optional<BandReplicates> replicates{};  // none without an error target
        PartSums parts{};                            // sums of the parts so far
        std::vector<std::size_t> grid{};             // numbers of the band's blocks in the picture
        Counts taken{}, first_halves{};              // samples of the blocks, and those in the first half
        bool uneven = false;                         // blocks may have different numbers of samples
    };

    // The following functions are defined in sampling.cpp.

    BandSamples begin(int index);
    /// Adds samples to bands that take looks together. Returns when the plan ends or the callback stops it.
    void grow(std::span<BandSamples> group);
    /// Adds the samples of a look to the sequence that grows; returns false to stop.
    bool add_sequence(BandSamples& band);
    /// Adds a sample unless work is interrupted, in which case the samples so far are saved.
    void add(const BandSamples& band, const FrameSettings& frame, const SampleView& at, SampleKind kind);
    /// Counts a sample, reports progress, and saves the band when it is time; returns false to stop.
    bool go_on(const BandSamples& band, int done);
    /// Returns the samples of each sequence after the next look; those that there are if the plan ends.
    int next_look(std::span<const BandSamples> group, int& chances);
    /// Makes the sums ready for the picture.
    void finish(BandSamples& band);

    // The following functions are defined in sampling_noise.cpp.

    /// Renders a pilot, whose noise decides about samples of blocks; returns false to stop.
    bool find_noise();
    /// Renders samples `from` to `to` - 1 of the pilot; the sums of the samples before must be there. Returns the error
    /// of each block of the picture (add_block_errors()), or an empty vector if the callback returned false.
    std::vector<float> pilot_errors(int from, int to, ErrorMetric metric);
    /// Adds samples of listed blocks, after those of all pixels.
    bool add_listed(BandSamples& band, const ListedSamples::SampleOf& sample_of);
    /// Returns the numbers of samples of the band's blocks. Blocks below the picture have `least`.
    Counts counts_of(const BandSamples& band, const Counts& picture) const;
    /// Scales the sums of a band as if all pixels had the same number of samples.
    void scale(BandSamples& band);

    // The following functions are defined in sampling_files.cpp.

    void save(const BandSamples& band) const;
    /// Goes on from the samples of a band that an earlier run has saved. With motion blur, sums of other parts than
    /// these begin anew: the earlier run had met poses that need them.
    void restore(BandSamples& band);
    /// Adds the sums of a band from PictureInputs::merged.
    void merge(BandSamples& band) const;

    State& s_;
    const FrameSettings& frame_;
    const Stopwatch& watch_;
    std::vector<int>& done_;
    const GoOn go_on_;
    SamplePlan plan_;
    Checkpoint* checkpoint_;          // null: none
    bool stopped_ = false;            // the callback returned false
    PictureError error_;              // of the bands that are rendered
    std::vector<double> deviations_;  // of one sample, by block of the picture; for an error target
    Counts wanted_, counts_;          // samples of each sequence by block of the picture after and before the look

    // State of the bands that take looks together:
    int first_band_ = 0;
    int part_ = 1;      // number of the look
    double limit_ = 0;  // seconds for their samples; 0: no limit
    Stopwatch clock_;
    double compiled_before_ = 0;
    SamplePace pace_;
    PictureError group_error_;
};

}  // namespace halflight
