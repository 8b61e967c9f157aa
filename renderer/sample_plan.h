// Which samples a picture takes, and how they are summed: a plain value, made in one place from settings.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/settings/render_settings.h"
#include "renderer/frame_constants.h"

namespace halflight {

/// The samples of a picture. A look takes the samples from `each` to `next` - 1 of all sequences, one sequence after
/// the other. After a look, the picture ends or another look follows (Sampling::next_look()).
struct SamplePlan {
    int samples = 1;          // samples per pixel, > 0; an upper limit where the picture may end earlier
    int sequences = 1;        // one, or the replicates of a picture that is rendered up to an error
    int most = 1;             // largest number of samples of a sequence, > 0
    int first_look = 1;       // samples of each sequence in the first look, > 0
    bool one_by_one = false;  // looks have one sample each, after which other bands follow or time may be up
    int parts = 1;            // parts of the samples, each with a plan of its own, whose sums are then added
    int cached = 0;           // number of the first samples, which use the radiance cache
    // Samples of each sequence that all pixels take, before the noise of a pilot decides about those of each block of
    // pixels; 0: all pixels take all samples.
    int least = 0;
    bool grows = false;     // numbers of blocks grow with every look, else the noise decides them once for all
    bool together = false;  // all bands take part in a look, with sums of their own; else one band follows the other
    bool by_time = false;   // samples of a sequence that share a pose follow each other within a look

    /// Returns how many samples a band has taken when it has taken `taken` of a sequence in a look.
    int done(int each, int next, int sequence, int taken) const {
        return each * sequences + sequence * (next - each) + taken;
    }
    /// Returns the expected number of samples of a band when it takes those of a look up to `next`.
    int expected(int next) const { return sequences > 1 ? sequences * next : samples; }
};

/// Returns the numbers of the blocks of a band in the picture's rows of blocks, in the order of the band's paths.
std::vector<std::size_t> blocks_in_picture(const Band& where);
/// Returns the plan of a picture or of one of its parts. cache: samples can use the radiance cache. saved: the samples
/// are saved, band by band.
SamplePlan plan_of(const RenderSettings& settings, const FrameSettings& frame, bool cache, bool saved);
/// Returns sample `index` of a sequence of the plan, without cached ones.
SampleView view_of(const SamplePlan& plan, const FrameSettings& frame, const Band& where, int sequence, int index,
                   SamplePoints points);

}  // namespace halflight
