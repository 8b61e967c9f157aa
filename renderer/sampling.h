// Renders the samples of a picture by its plan (sample_plan.h).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
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
        bool ends = false;       // the band gets no further samples of this part

        bool begun() const { return each > 0 || sequence > 0 || taken > 0; }
    };
    /// A band whose samples are rendered.
    struct BandSamples {
        int index = 0;
        Band where;
        CompiledBand* with = nullptr;
        int part = 1;  // part of the samples that is rendered
        Look look{};
        bool unsaved = false;                        // has samples that its checkpoint lacks
        std::optional<BandReplicates> replicates{};  // of the part; none without an error target
        PartSums earlier{};                          // sums of the parts before
        std::vector<std::size_t> grid{};             // numbers of the band's blocks in the picture
    };
    using Group = std::vector<BandSamples*>;
    /// What the pilot of a part says about the samples of each block of the picture.
    struct Noise {
        Counts wanted{};                   // numbers of samples, if they are decided once for all
        std::vector<double> deviations{};  // of one sample, if the numbers grow
    };

    // The following functions are defined in sampling.cpp.

    BandSamples begin(int index);
    /// Returns the first look of a band in a part.
    Look first_look() const { return {.next = plan_.first_look, .chances = first_chances(own_.parts)}; }
    /// Makes the plan of a part of the samples.
    void begin_part(int part);
    /// Adds the samples of the part to bands. Returns when the plan ends or the callback stops it.
    void render_part(std::span<BandSamples> together);
    /// Adds samples to bands that take looks together. Returns when the plan ends or the callback stops it.
    void grow();
    /// Adds the samples of a look to a band; returns false to stop.
    bool add_look(BandSamples& band);
    /// Adds the samples of a look to the sequence that grows; returns false to stop.
    bool add_sequence(BandSamples& band);
    /// Adds a sample unless work is interrupted, in which case the samples so far are saved.
    void add(const FrameSettings& frame, BandSamples& band, const SampleView& at, SampleKind kind);
    /// Counts a sample, reports progress, and saves the bands when it is time; returns false to stop.
    bool go_on(BandSamples& band, int done);
    /// Returns the samples of each sequence after the next look; those that there are if the plan ends.
    int next_look(const Look& look, int& chances);
    /// Returns the share of the samples so far that fits into the time limit.
    double time_left() const;
    /// Adds the sums of a part to those before.
    void end_part(BandSamples& band);
    /// Makes the sums ready for the picture.
    void finish(BandSamples& band);
    SampleView view(const BandSamples& band, int index) const {
        return view_of(plan_, own_, band.where, band.look.sequence, index, s_.settings.estimator.sampler);
    }

    // The following functions are defined in sampling_noise.cpp.

    /// Renders a pilot, whose noise decides about samples of blocks; returns false to stop.
    bool find_noise();
    /// Renders samples `from` to `to` - 1 of the pilot; the sums of the samples before must be there. Returns the error
    /// of each block of the picture (add_block_errors()), or an empty vector if the callback returned false.
    std::vector<float> pilot_errors(int from, int to, ErrorMetric metric);
    /// Adds samples of listed blocks, after those of all pixels.
    bool add_listed(BandSamples& band);
    /// Returns the samples of listed blocks in the look that the band takes part in, without those that it has got.
    ListedSamples listed(const BandSamples& band) const;
    /// Returns the numbers of samples of the blocks of the picture when each sequence has `each` in the mean.
    Counts counts_at(int each) const;
    /// Returns the numbers of samples of the band's blocks. Blocks below the picture have `least`, and all if `each`
    /// is 0.
    Counts counts_of(const BandSamples& band, int each) const;
    static double mean_of(const Counts& counts);
    /// Returns the numbers of samples that the blocks of the band have got of this part.
    BlockSamples taken(const BandSamples& band) const;
    /// Scales the sums of a band as if all pixels had the same number of samples.
    void scale(BandSamples& band);
    /// Adds the error of a band to that of the picture. each: samples of each sequence; 0: of all parts together.
    void add_error(const BandSamples& band, int each, PictureError& error) const;

    // The following functions are defined in sampling_files.cpp.

    /// Saves all bands with samples that are not saved.
    void save();
    void save(BandSamples& band) const;
    /// Goes on from the samples of a band that an earlier run has saved. With motion blur, sums of other parts than
    /// these begin anew: the earlier run had met poses that need them.
    void restore(BandSamples& band);
    /// Takes the samples of a band from a file. Returns none if there is no file, or if its sums are others
    /// (restore()).
    std::optional<SavedBand> load(BandSamples& band, const Checkpoint& from);
    /// Takes the samples of a part from PictureInputs::merged.
    void merge(BandSamples& band);

    State& s_;
    const FrameSettings& frame_;
    const Stopwatch& watch_;
    std::vector<int>& done_;
    const GoOn go_on_;
    Checkpoint* checkpoint_;  // null: none
    int parts_;               // number of parts whose samples are rendered or merged
    bool stopped_ = false;    // the callback returned false
    PictureError error_;      // of the bands that are rendered
    Shadows shadows_;
    std::map<int, Noise> noise_;                                            // by part
    std::map<int, std::array<std::uint64_t, kBadValueCounts>> bad_values_;  // of merged parts

    // The part that is rendered:
    int part_ = 1;
    FrameSettings own_;
    SamplePlan plan_;

    // State of the bands that take looks together:
    Group group_;
    int first_band_ = 0;
    // By part: samples of each sequence after the looks that were decided, if numbers grow.
    std::map<int, std::vector<int>> looks_;
    double limit_ = 0;  // seconds for their samples; 0: no limit
    Stopwatch clock_;
    double compiled_before_ = 0;
    SamplePace pace_;
    PictureError group_error_;
};

}  // namespace halflight
