// What a Renderer works with, and its steps: graphs of bands (render_graphs.cpp), samples (render_samples.cpp),
// pictures made of them (render_develop.cpp).
#pragma once

#include <chrono>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/raster.h"
#include "engine/rays/tracer.h"
#include "passes/light/radiance_cache.h"
#include "passes/picture/composite.h"
#include "renderer/cryptomatte.h"
#include "renderer/film.h"
#include "renderer/frame.h"
#include "renderer/frame_constants.h"
#include "renderer/hand_over.h"
#include "renderer/preview_stage.h"
#include "renderer/render.h"
#include "renderer/replicates.h"
#include "renderer/sample_queue.h"

namespace halflight {

/// A sample, and where it is added.
struct CompiledSample {
    graph::Graph graph;
    Frame frame;
    graph::CompiledGraph compiled;
    SumBuffers sums;  // once one was added
};

/// The graphs of a band, or of several that come one after the other.
struct CompiledBand {
    explicit CompiledBand(std::shared_ptr<Mattes> m) : mattes(std::move(m)) {}
    std::shared_ptr<Mattes> mattes;  // of bands that come one after the other the same
    CompiledSample sample;
    std::unique_ptr<CompiledSample> cached;  // with the radiance cache; or none
    // AOVs through the pixels' centres; empty unless asked for
    graph::Graph data_graph;
    graph::BufferHandle aov;
    graph::BufferHandle debug;
    graph::CompiledGraph data;
};

struct Renderer::State {
    using Clock = std::chrono::steady_clock;

    std::unique_ptr<PreparedScene> own;  // or none
    PreparedScene& scene;
    const ColorConfig colors;
    const RenderSettings asked;
    RenderSettings settings;  // with what the scene makes of them
    std::optional<rays::RasterCulling> raster;
    std::optional<rays::Tracer> tracer;
    std::optional<ViewKernel> view_kernel;
    std::optional<PreviewStage> preview;
    gpu::Buffer frame_constants_buffer{"frame constants", sizeof(shared::Frame)};
    std::vector<gpu::Buffer> seen_constants;  // of camera rays for light alone
    std::shared_ptr<RadianceCache> cache;     // null without
    HandOver hand_over;
    std::optional<SampleQueue> in_flight;  // from the constructor on
    Band band;
    Band current;  // of the constants
    int bands = 0;
    std::size_t states = 1;  // places in visibility state
    // Bands that have visibility state or, in turns, sums of their own; made when needed.
    std::vector<std::unique_ptr<CompiledBand>> places;
    graph::Executor executor;  // of samples: their sums and the visibility state are its history
    graph::Executor composer;
    bool told = false;  // what became of the hierarchies

    State(std::unique_ptr<PreparedScene> o, PreparedScene& s, const ColorConfig& c, std::optional<ViewKernel> view,
          RenderSettings r);

    // render_graphs.cpp
    FrameOptions frame_options() const;   ///< of samples without the radiance cache
    FrameOptions cached_options() const;  ///< of those with it
    FrameNeeds needs() const;
    Band band_at(int index) const;
    /// Of band number `index`.
    CompiledBand& compiled(int index);
    /// For that place in `places`.
    std::unique_ptr<CompiledBand> compile(std::uint32_t place);
    /// further_sums: how many sums are not its own.
    void compile(CompiledSample& sample, std::uint32_t place, std::uint32_t further_sums, const FrameOptions& options);
    /// AOVs through the pixels' centres.
    void add_data(CompiledBand& to, std::uint32_t place);
    SceneView view(graph::Graph& graph, std::uint32_t place);

    // render_samples.cpp
    static double seconds_since(Clock::time_point start);
    /// Uploads the frame constants of the graphs that run next.
    void upload_constants(const FrameSettings& frame, const SampleView& at);
    /// Sample number `done` of a picture, from 0.
    void add_sample(const FrameSettings& frame, const Band& where, int done, CompiledBand& with);
    void add_sample(const FrameSettings& frame, const SampleView& at, CompiledBand& with, CompiledSample& sample);
    /// Told how many samples of a band are done, and how many there will be as far as is known; false: stop.
    using AfterSample = std::function<bool(int done, int total)>;
    /// Adds samples to a band until there are enough, time is up, or the callback says stop. Returns how many.
    int render_band(const FrameSettings& frame, const Band& where, CompiledBand& with, double time_limit,
                    const AfterSample& after_sample);
    /// The same until the band's error is below the target, too, which is then below it in the whole picture. Adds what
    /// it knows of the error to that of the picture.
    int render_band_to_error(const FrameSettings& frame, const Band& where, CompiledBand& with, double time_limit,
                             const AfterSample& after_sample, PictureError& picture_error);
    /// Adds samples to all bands in turns, until there are enough, time is up, or the callback says stop; it is told of
    /// each band by itself. `done`: samples of each.
    void render_in_turns(const FrameSettings& frame, double time_limit, std::vector<int>& done,
                         const std::function<bool()>& after_sample);
    /// Empty for none.
    static std::vector<double> read(const gpu::Buffer* b);
    /// Emission, direct and indirect light.
    static Film::Sums light(const SumBuffers& sums);

    // render_develop.cpp
    /// The picture of a band's first `done` samples.
    void develop(const FrameSettings& frame, const Band& where, const CompiledBand& with, int done, Film& film);
    /// After all bands were developed.
    void apply_preview(const FrameSettings& frame, std::span<const int> samples, Film& film);
    /// Of bands whose sums are there; `samples`: of each.
    void develop(const FrameSettings& frame, std::span<const int> samples, Film& film);
    /// Takes the film's pictures, and tells what there is to tell of them and of how they came about.
    void finish(RenderResult& result, Film& film, const FrameSettings& frame, std::span<const int> samples,
                Clock::time_point start, double compiled_before);
};

}  // namespace halflight
