// The graphs of a band: samples, and layers at the pixels' centres. They are declared and compiled without OpenGL, also
// for estimates of memory.
#pragma once

#include <memory>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/graph/compile.h"
#include "engine/settings/render_settings.h"
#include "renderer/frame.h"

namespace halflight {

/// Objects that the graphs of a picture refer to. They outlive the graphs.
struct GraphInputs {
    gpu::ProgramCache& programs;
    const SceneBuffers& scene;
    const rays::TraceScene& trace;
    rays::Tracer* tracer;
    const RenderSettings& settings;  // all automatic choices are resolved
    const FrameOptions& options;     // options of samples without the radiance cache
    gpu::Buffer& frame_constants;
    std::vector<gpu::Buffer>& seen_constants;  // constants of camera rays for directly visible light
    gpu::Buffer* bad_values;
    gpu::Buffer* sampled_blocks = nullptr;  // SampledBlock of listed samples, for adaptive sampling
    RadianceCache* cache = nullptr;         // null: not used
    paging::RowGather* rows = nullptr;      // table rows of hits, for scenes that are loaded in pages; else null
    const Band* current = nullptr;          // band of the uploaded constants
};

/// Indices of what a band keeps in the executor's history.
struct BandPlace {
    std::uint32_t state = 0;        // visibility state
    std::uint32_t sums = 0;         // sums of samples
    std::uint32_t cached_sums = 1;  // sums of samples with the radiance cache
};

struct SampleGraph {
    graph::Graph graph;
    Frame frame;
    graph::CompiledGraph compiled;
};

/// The compiled graphs of a band, or of several bands that are rendered one after the other.
struct BandGraphs {
    SampleGraph sample;
    std::unique_ptr<SampleGraph> listed;  // adaptive sampling: samples of listed blocks; null: not used
    std::unique_ptr<SampleGraph> cached;  // sample with the radiance cache; null: none
    // Graphs of layers at the pixels' centres; empty unless requested
    graph::Graph data_graph;
    graph::BufferHandle aov;
    graph::BufferHandle chains;  // ChainPlace per path
    graph::CompiledGraph data;
    graph::Graph debug_graph;
    graph::BufferHandle debug;
    graph::CompiledGraph debug_data;

    /// Compiles all graphs that the settings ask for.
    BandGraphs(const GraphInputs& inputs, const Band& band, const BandPlace& place = {});

    std::vector<const graph::CompiledGraph*> all() const;
    std::size_t transient_bytes() const;  ///< Returns the bytes of the graph that takes most; one runs at a time.
    std::size_t carried_bytes() const;    ///< Returns the bytes that runs of the graphs carry on.
};

/// Returns the largest number of paths of a band whose buffers fit into storage blocks, and whose ray batches fit into
/// dispatches. culling: method of the rays, no server.
std::size_t most_paths(GraphInputs inputs, rays::Culling culling, const gpu::Limits& limits);

}  // namespace halflight
