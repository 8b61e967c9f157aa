// State of a Renderer and its steps: setup (render_state.cpp), samples (render_samples.cpp), and pictures
// made of them (render_develop.cpp).
#pragma once

#include <array>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/core/stopwatch.h"
#include "engine/graph/execute.h"
#include "engine/paging/page_server.h"
#include "engine/paging/row_gather.h"
#include "engine/rays/native.h"
#include "engine/rays/raster.h"
#include "engine/rays/tracer.h"
#include "passes/light/radiance_cache.h"
#include "passes/picture/composite.h"
#include "renderer/band_graphs.h"
#include "renderer/checkpoint.h"
#include "renderer/cryptomatte.h"
#include "renderer/denoise_stage.h"
#include "renderer/film.h"
#include "renderer/frame_constants.h"
#include "renderer/hand_over.h"
#include "renderer/preview_stage.h"
#include "renderer/render.h"
#include "renderer/replicates.h"
#include "renderer/sample_queue.h"

namespace halflight {

class ListedSamples;

/// Kinds of samples of a band.
enum class SampleKind : std::uint8_t {
    plain,   // adds all pixels to the sums and the mattes
    pilot,   // leaves the mattes alone
    listed,  // adds the blocks of State::sampled_blocks to the sums
    cached,  // adds all pixels, by the radiance cache, to sums of their own
};

/// The graphs and sums of a band, or of several bands that are rendered one after the other.
struct CompiledBand {
    CompiledBand(const GraphInputs& inputs, const Band& band, const BandPlace& place, std::shared_ptr<Mattes> own)
        : graphs(inputs, band, place), mattes(std::move(own)) {}
    BandGraphs graphs;
    std::shared_ptr<Mattes> mattes;      // shared by bands that are rendered one after the other
    SumBuffers sums, cached_sums;        // set by the first sample
    int first_samples = 0;               // number of samples that all pixels have, and that the mattes hold; 0: all
    std::vector<std::uint32_t> samples;  // number of samples of each block of paths; empty: all have the same
};

/// State of a band's plan of samples, which its checkpoint keeps beside the sums.
struct PlanState {
    std::vector<std::uint64_t> numbers;  // empty: the plan has not begun
    std::vector<Checkpoint::Bytes> arrays;
};

struct Renderer::State {
    std::unique_ptr<PreparedScene> own;  // prepared scene of its own; null: the scene is shared
    PreparedScene& scene;
    const ColorConfig colors;
    const RenderSettings asked;
    // Settings with all automatic choices resolved, and the size of the rendered pixels (rendered_window()).
    RenderSettings settings;
    rays::BatchServer* const given_server;               // server of the caller; null: none
    const std::shared_ptr<RadianceCache> given_cache;    // radiance cache of the caller; null: none
    std::unique_ptr<rays::BatchServer> own_server;       // server of the culling method; null: none
    std::unique_ptr<rays::NativeServer> offered_server;  // candidate of Culling::automatic; null: none
    std::unique_ptr<paging::PageServer> page_server;     // server of scenes that are loaded in pages
    std::unique_ptr<paging::RowGather> page_rows;        // table rows of such scenes
    rays::BatchServer* server;                           // server in use: the caller's, or own_server.get()
    std::optional<rays::Tracer> tracer;
    std::optional<ViewKernel> view_kernel;
    std::optional<PreviewStage> preview;
    std::optional<DenoiseStage> denoiser;
    std::optional<gpu::Buffer> sampled_blocks;  // SampledBlock of listed samples; none: not adaptive
    gpu::Buffer frame_constants_buffer{"frame constants", sizeof(shared::Frame)};
    std::vector<gpu::Buffer> seen_constants;  // constants of camera rays for directly visible light
    std::shared_ptr<RadianceCache> cache;     // radiance cache; null: not used
    HandOver hand_over;
    std::optional<SampleQueue> in_flight;  // samples on the device; set by the constructor
    PictureInputs inputs;                  // objects of the picture that is rendered
    FrameOptions options;                  // options of samples without the radiance cache
    Band band;
    Band current;                    // band of the uploaded constants
    std::optional<double> posed_at;  // motion blur: time of the pose (SampleView::at); none: that of the frame
    Camera posed_camera;             // camera at that time
    int bands = 0;
    std::size_t states = 1;  // number of bands with visibility state of their own
    bool own_sums = false;   // bands have sums of their own
    // Bands that have visibility state or, in turns, sums of their own; compiled when needed.
    std::vector<std::unique_ptr<CompiledBand>> places;
    graph::Executor executor;           // runs samples: their sums and the visibility state are its history
    graph::Executor composer;           // makes pictures of sums
    bool hierarchies_reported = false;  // an earlier picture's statistics count the hierarchies of this pose

    State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c, std::optional<ViewKernel> view,
          RenderSettings r, rays::BatchServer* callers_server, std::shared_ptr<RadianceCache> callers_cache);

    // The following functions are defined in render_state.cpp.

    rays::ServedScene served() const;
    const paging::PageSource* pages() const;  ///< Returns null where the geometry is in memory.
    FrameNeeds needs() const { return frame_needs(scene.buffers().needs(), options); }
    GraphInputs graph_inputs();
    Band band_at(int index) const;
    /// Returns the graphs of band `index`; compiles them on first use.
    CompiledBand& compiled(int index);
    /// Compiles the graphs for an element of `places`.
    std::unique_ptr<CompiledBand> compile(std::uint32_t place);

    // The following functions are defined in render_samples.cpp.

    shared::Frame constants_of(const FrameSettings& frame, const SampleView& at) const;
    /// Poses scene and camera at a time of the shutter; none: at the time of the frame. Without motion blur, nothing
    /// changes.
    void pose(const FrameSettings& frame, std::optional<double> at);
    /// Uploads the frame constants of the graphs that run next.
    void upload_constants(const FrameSettings& frame, const SampleView& at);
    /// Adds sample `done` of a picture, from 0, to a band. order: that of the samples, or empty (order_of_samples()).
    void add_sample(const FrameSettings& frame, const Band& where, int done, CompiledBand& with,
                    std::span<const int> order = {});
    void add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with, SampleKind kind);
    /// Callback that receives the finished and the expected number of samples of a band; returns false to stop.
    using AfterSample = std::function<bool(int done, int total)>;
    /// Adds samples to a band that has `first` samples, until there are enough, time is up, or the callback returns
    /// false. Saves checkpoints where the frame has them. Returns the number of all samples.
    int render_band(const FrameSettings& frame, const Band& where, CompiledBand& with, int first, double time_limit,
                    const AfterSample& after_sample);
    /// Adds samples like render_band(), but also stops where the error of the band is below the target. Where all bands
    /// are below it, so is the picture. Adds the error of the band to that of the picture.
    /// state: that of an earlier run, whose sums are in the band.
    int render_band_to_error(const FrameSettings& frame, const Band& where, CompiledBand& with, double time_limit,
                             const AfterSample& after_sample, PictureError& picture_error, const PlanState& state);
    /// Adds samples to all bands in turns, until there are enough, time is up, or the callback returns false. It is
    /// called for each band. done: number of samples of each band.
    void render_in_turns(const FrameSettings& frame, double time_limit, std::vector<int>& done,
                         const std::function<bool()>& after_sample);
    /// Returns the sums of a graph that has run or been placed.
    SumBuffers sums_of(const SampleGraph& sample, int first_half);
    /// Reads a buffer; returns an empty vector for null.
    static std::vector<double> read(const gpu::Buffer* b);
    /// Returns the buffers of sums in a fixed order; null if the frame left them out.
    static std::array<gpu::Buffer*, 8> all_of(const SumBuffers& sums) {
        return {sums.emission, sums.direct, sums.indirect, sums.squares,
                sums.features, sums.halves, sums.groups,   sums.catchers};
    }
    /// Reads the sums of emission, direct and indirect light.
    static Film::Sums light(const SumBuffers& sums);

    // The following functions are defined in band_checkpoint.cpp.

    /// Saves the sums of a band's first `done` samples.
    void save(Checkpoint& to, const Band& where, const CompiledBand& with, int done, bool complete,
              const PlanState& plan = {});
    /// Restores the sums of a band from PictureInputs::checkpoint; none if an earlier run has saved none. With
    /// motion blur, sums of other parts than these begin anew: the earlier run had met poses that need them.
    std::optional<SavedBand> restore(const FrameSettings& frame, const Band& where, CompiledBand& with,
                                     PlanState& plan);
    /// Returns the numbers of samples of plan_samples() that an earlier run has saved; empty if it has saved none.
    std::vector<std::uint32_t> saved_plan(const FrameSettings& frame);

    // The following functions are defined in sample_parts.cpp.

    /// Renders the parts of a band's samples (FrameSettings::parts) one after the other, and adds their sums. Returns
    /// the number of samples.
    int render_parts(const FrameSettings& frame, const Band& where, CompiledBand& with,
                     const AfterSample& after_sample);
    /// Adds the sums of a band from PictureInputs::merged. Returns the number of samples.
    int merge_parts(const FrameSettings& frame, const Band& where, CompiledBand& with);

    // The following functions are defined in adaptive_band.cpp.

    /// Returns the number of 16x16 blocks of the picture in both directions.
    ivec2 picture_blocks() const;
    /// Returns the numbers of the blocks of a band in the picture's rows of blocks, in the order of the band's paths.
    static std::vector<std::size_t> blocks_in_picture(const Band& where);
    /// Renders samples `from` to `to` - 1 of the pilot of adaptive sampling; the sums of the samples before must be
    /// there. Returns the error of each block of the picture (add_block_errors()), or an empty vector if the
    /// callback returned false.
    std::vector<float> pilot_errors(const FrameSettings& frame, int from, int to, ErrorMetric metric,
                                    const std::function<bool()>& after_sample);
    /// Renders the pilot and returns the numbers of samples of all blocks of the picture (adaptive_counts()). Returns
    /// an empty vector if the callback returned false.
    std::vector<std::uint32_t> plan_samples(const FrameSettings& frame, const std::function<bool()>& after_sample);
    /// Adds listed samples to a band. sample: any of them; all have its seed. The callback receives the finished share
    /// after each run, > 0 and at most 1, and returns false to stop. Returns whether it never did.
    bool add_listed(const FrameSettings& frame, SampleView sample, CompiledBand& with, ListedSamples& listed,
                    const std::function<bool(double share)>& after_run);
    /// Scales the sums of a band, whose blocks have CompiledBand::samples, as if all pixels had `wanted` samples, an
    /// even number. first_halves: number of samples of each block in the first half.
    void scale_sums(CompiledBand& with, std::span<const std::uint32_t> first_halves, int wanted);
    /// Adds samples to a band as planned, and scales its sums as if all pixels had as many. Returns that number. If
    /// the callback stops it among the first samples, which all pixels take, returns their number.
    /// state: that of an earlier run, whose sums are in the band.
    int render_band_adaptively(const FrameSettings& frame, const Band& where, CompiledBand& with,
                               const std::vector<std::uint32_t>& plan, const AfterSample& after_sample,
                               const PlanState& state);

    // The following functions are defined in adaptive_error.cpp.

    /// Gives each band sums of its own, which the other bands leave alone.
    void keep_sums_of_bands();
    /// Renders the pilot and returns the deviations of all blocks of the picture (block_deviations()). Returns an empty
    /// vector if the callback returned false.
    std::vector<double> plan_replicates(const FrameSettings& frame, const std::function<bool()>& after_sample);
    /// Adds samples to all bands by the noise of their blocks, until the error of the picture is below the target, or
    /// another limit is met. done: number of samples of each band, which its sums are scaled to. The callback receives
    /// the expected number of samples of all bands, and returns false to stop. picture_error: valid unless it did.
    void render_to_error_adaptively(const FrameSettings& frame, std::vector<int>& done,
                                    const std::function<bool(std::int64_t all)>& go_on, PictureError& picture_error);

    // The following functions are defined in render_develop.cpp.

    /// Adds the picture of a band's first `done` samples to the film.
    void develop(const FrameSettings& frame, const Band& where, const CompiledBand& with, int done, Film& film);
    /// Applies preview modes and the denoiser after all bands were developed.
    void apply_to_picture(const FrameSettings& frame, std::span<const int> samples, Film& film);
    /// Develops all bands whose sums are there. samples: number of samples of each band.
    void develop(const FrameSettings& frame, std::span<const int> samples, Film& film);
    /// Moves the pictures of the film to the result and fills in its statistics.
    void finish(RenderResult& result, Film& film, const FrameSettings& frame, std::span<const int> samples,
                const Stopwatch& watch, double compiled_before);
};

}  // namespace halflight
