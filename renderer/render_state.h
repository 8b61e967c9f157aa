// State of a Renderer and its steps: setup (render_state.cpp), single samples (render_samples.cpp), pictures
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
#include "renderer/ray_servers.h"
#include "renderer/render.h"
#include "renderer/replicates.h"
#include "renderer/sample_queue.h"

namespace halflight {

/// Kinds of samples of a band.
enum class SampleKind : std::uint8_t {
    plain,   // adds all pixels to the sums and the mattes
    pilot,   // leaves the mattes alone
    listed,  // adds the blocks of CurrentSample::blocks to the sums
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

/// The bands of a picture.
struct Bands {
    Band first;
    int count = 0;
    std::size_t states = 1;  // number of bands with visibility state of their own
    bool own_sums = false;   // bands have sums of their own
    // Bands that have visibility state or sums of their own; made when needed.
    std::vector<std::unique_ptr<CompiledBand>> places{};

    Band at(int index) const;
    /// Gives each band sums of its own, which the other bands leave alone.
    void keep_sums();
};

/// The sample that graphs run next, as kernels read it.
struct CurrentSample {
    Band band;
    gpu::Buffer frame{"frame constants", sizeof(shared::Frame)};
    std::vector<gpu::Buffer> seen{};      // constants of camera rays for directly visible light
    std::optional<gpu::Buffer> blocks{};  // SampledBlock of listed samples; none: not adaptive
};

/// Pose of the scene.
struct Pose {
    std::optional<double> at{};  // motion blur: time of the pose (SampleView::at); none: that of the frame
    Camera camera{};             // camera at that time
};

struct Renderer::State {
    class Sampling;  ///< sampling.h

    // What is fixed at construction.
    std::unique_ptr<PreparedScene> own;  // prepared scene of its own; null: the scene is shared
    PreparedScene& scene;
    const ColorConfig colors;
    const RenderSettings asked;
    // Settings with all automatic choices resolved, and the size of the rendered pixels (rendered_window()).
    RenderSettings settings;
    const std::shared_ptr<RadianceCache> given_cache;  // radiance cache of the caller; null: none
    RayServers servers;
    FrameOptions options;                  // options of samples without the radiance cache
    std::shared_ptr<RadianceCache> cache;  // radiance cache; null: not used

    // The samples of a picture.
    PictureInputs inputs;  // objects of the picture that is rendered
    Bands bands;
    CurrentSample sample;
    Pose pose;
    std::optional<SampleQueue> in_flight;  // samples on the device; set by the constructor
    graph::Executor executor;              // runs samples: their sums and the visibility state are its history

    // Pictures made of sums.
    graph::Executor composer;
    HandOver hand_over;
    std::optional<ViewKernel> view_kernel;
    std::optional<PreviewStage> preview;
    std::optional<DenoiseStage> denoiser;
    bool hierarchies_reported = false;  // an earlier picture's statistics count the hierarchies of this pose

    State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c, std::optional<ViewKernel> view,
          RenderSettings r, rays::BatchServer* callers_server, std::shared_ptr<RadianceCache> callers_cache);

    // The following functions are defined in render_state.cpp.

    const paging::PageSource* pages() const;  ///< Returns null if the geometry is in memory.
    FrameNeeds needs() const { return frame_needs(scene.buffers().needs(), options); }
    GraphInputs graph_inputs();
    /// Returns the graphs of band `index`; compiles them on first use.
    CompiledBand& compiled(int index);
    /// Compiles the graphs for an element of `places`.
    std::unique_ptr<CompiledBand> compile(std::uint32_t place);

    // The following functions are defined in render_samples.cpp.

    shared::Frame constants_of(const FrameSettings& frame, const SampleView& at) const;
    /// Poses scene and camera at a time of the shutter; none: at the time of the frame. Without motion blur, nothing
    /// changes.
    void set_pose(const FrameSettings& frame, std::optional<double> at);
    /// Uploads the frame constants of the graphs that run next.
    void upload_constants(const FrameSettings& frame, const SampleView& at);
    /// Adds a sample to a band.
    void add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with, SampleKind kind);
    /// Returns the sums of a graph that has run or been placed.
    SumBuffers sums_of(const SampleGraph& sample, int first_half);
    /// Reads a buffer; returns an empty vector for null.
    static std::vector<double> read(const gpu::Buffer* b);
    /// Reads the sums of emission, direct and indirect light.
    static Film::Sums light(const SumBuffers& sums);

    // The following functions are defined in render_develop.cpp.

    /// Adds the picture of the first `done` samples of band `index` to the film.
    void develop(const FrameSettings& frame, int index, int done, Film& film);
    /// Applies preview modes and the denoiser after all bands were developed.
    void apply_to_picture(const FrameSettings& frame, std::span<const int> samples, Film& film);
    /// Moves the pictures of the film to the result and fills in its statistics.
    void finish(RenderResult& result, Film& film, const FrameSettings& frame, std::span<const int> samples,
                const Stopwatch& watch, double compiled_before);
};

}  // namespace halflight
