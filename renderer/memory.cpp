#include "renderer/memory.h"

#include <algorithm>

#include "engine/core/memory_ledger.h"
#include "engine/paging/page_server.h"
#include "engine/paging/row_gather.h"
#include "passes/light/radiance_cache.h"
#include "passes/picture/denoiser.h"
#include "renderer/band_graphs.h"
#include "renderer/band_size.h"
#include "renderer/film.h"
#include "renderer/frame_options.h"
#include "renderer/noisy_frame.h"
#include "renderer/replicates.h"
#include "renderer/sample_queue.h"
#include "shaders/shared/cache_cells.h"

namespace halflight {
namespace {

using Source = LayerSource;

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr std::size_t kLeastTilePool = 16 * kMiB;
constexpr std::size_t kTexel = sizeof(vec4);
/// Bytes per pixel of IdCoverage: a list head, and an entry for each visible object. Pixels at edges have several
/// entries. Twice as many entries as pixels are more than the pictures of scenes/ have after many samples. A growing
/// vector has room for twice as many again.
constexpr std::size_t kMatte = sizeof(std::uint32_t) + 2 * 2 * 3 * sizeof(std::uint32_t);

/// Returns the triangles in hierarchies (engine/tables/tables.h), shared ones counted once.
std::size_t traced(const SceneSize& size) {
    return std::min(size.drawn, std::max(size.stored, kFlattenLimit));
}

bool is_matte(const std::string& aov) {
    return find_aov(aov)->is_matte();
}

std::size_t mattes(const RenderSettings& s) {
    return static_cast<std::size_t>(std::ranges::count_if(s.aovs, is_matte));
}

/// Replaces automatic choices by the most expensive choice of a pilot.
void settle_for_most(Estimator& e) {
    if (e.reuse == Reuse::automatic) e.reuse = Reuse::sixteen;
    if (e.camera == CameraRays::automatic) e.camera = CameraRays::sixteen;
    if (e.shadow == ShadowRays::automatic) e.shadow = ShadowRays::eight;
}

constexpr gpu::Buffer::Unmade kUnmade{};
// Limits of software drivers. Others may allow larger bands, but have device memory for them.
constexpr gpu::Limits kLimits{.storage_block_bytes = 128 * kMiB, .texture_size = 16384, .workgroup_count = 65535};

/// The graphs of a band and what they refer to, without a device.
struct DeclaredBand {
    gpu::ProgramCache programs;
    SceneBuffers buffers;
    rays::TraceScene trace;
    FrameNeeds needs;
    rays::Tracer tracer;
    gpu::Buffer buffer{"", 0, kUnmade};
    std::vector<gpu::Buffer> seen;
    RadianceCache cache{kUnmade};
    GraphInputs inputs;
    Band band;
    BandGraphs graphs;

    /// settings: all automatic choices are resolved. two_level: rays::TraceStatistics::two_level.
    DeclaredBand(const SceneNeeds& scene, const RenderSettings& s, const FrameOptions& options, bool two_level)
        : buffers(scene),
          trace(scene, two_level),
          needs(frame_needs(scene, options)),
          tracer(trace, needs.tiles ? s.culling : rays::Culling::off),
          inputs{.programs = programs,
                 .scene = buffers,
                 .trace = trace,
                 .tracer = &tracer,
                 .settings = s,
                 .options = options,
                 .frame_constants = buffer,
                 .seen_constants = with_seen(options),
                 .bad_values = &buffer,
                 .sampled_blocks = &buffer,
                 .cache =
                     s.preview.cache && frame_needs(scene, cached_options(options)).radiance_cache ? &cache : nullptr},
          band(first_band(s, std::min(s.band_pixels, most_paths(inputs, rays::Culling::compute, kLimits)),
                          std::max({kLimits.texture_size, s.width, rendered_window(s, s.camera.optics).size().x}))),
          graphs(inputs, band) {}

    std::vector<gpu::Buffer>& with_seen(const FrameOptions& options) {
        for (int i = 0; needs.seen && i < options.camera_rays; ++i) seen.emplace_back("", 0, kUnmade);
        return seen;
    }
    std::size_t bands() const { return static_cast<std::size_t>((band.image.y + band.rows - 1) / band.rows); }
    /// Returns the bytes of tile lists, which runs carry on.
    std::size_t state_bytes() const {
        std::size_t bytes = 0;
        for (const rays::BatchStatistics& batch : tracer.statistics()) bytes += batch.state_bytes;
        return bytes;
    }
    /// Returns the bytes of the sums of samples, and of cached and other sums together (HandOver).
    std::size_t sum_bytes() const {
        const std::size_t carried = graphs.carried_bytes(), sums = carried - std::min(carried, state_bytes());
        return graphs.cached ? sums + sums / 2 : sums;
    }
    /// Returns the bytes of the results that are read for layers and the error.
    std::size_t reading_bytes(const RenderSettings& s) const {
        const auto bytes = [](const graph::Graph& g, std::initializer_list<graph::BufferHandle> handles) {
            std::size_t sum = 0;
            for (const graph::BufferHandle h : handles) sum += h ? g.desc(h).bytes : 0;
            return sum;
        };
        const graph::Graph& sample = graphs.sample.graph;
        const Accumulated& sums = graphs.sample.frame.sums;
        const bool squares = asked_for(s, {Source::squares});
        std::size_t read = bytes(sample, {sums.groups}) + bytes(graphs.data_graph, {graphs.aov, graphs.chains}) +
                           bytes(graphs.debug_graph, {graphs.debug});
        if (s.error || squares || asked_for(s, {Source::emission, Source::direct, Source::indirect}))
            read += bytes(sample, {sums.emission, sums.direct, sums.indirect});
        if (squares) read += bytes(sample, {sums.squares});
        if (asked_for(s, {Source::features})) read += bytes(sample, {sums.features});
        const std::size_t hits = bytes(sample, {graphs.sample.frame.gbuffer.hits});
        return read + (mattes(s) > 0 ? (1 + SampleQueue::kInFlight) * hits : 0);
    }
};

/// Returns the bytes per path of the replicates of an error target.
std::size_t replicates_bytes(const SceneNeeds& scene, const RenderSettings& s) {
    return s.error ? BandReplicates::bytes(scene.catchers ? Shadows::in_alpha : Shadows::none) : 0;
}

/// Returns the bytes per pixel; see PreviewPicture.
std::size_t preview_bytes(const Preview& p) {
    if (!p.of_picture()) return 0;
    constexpr std::size_t kPixels = 5 + 2;           // halves, guide, albedo, beauty; new beauty twice
    constexpr std::size_t kEarlier = 1 + 2 * 4 + 3;  // place; pictures of halves, guide and place; earlier places
    return (kPixels + (p.temporal ? kEarlier : 0)) * kTexel + (p.filter ? kPreviewFilterBytes : 0);
}

/// Returns the bytes per pixel of the denoiser. A frame of a sequence waits with its layers for those after it. chains:
/// whether specular chains are followed.
std::size_t denoiser_bytes(const RenderSettings& s, bool chains) {
    const int near = 2 * neighbour_frames(s);
    if (!has_halves(s)) return 0;
    const auto frames = static_cast<std::size_t>(near);
    const std::size_t mirrored = chains ? kDenoiserChainBytes + frames * kTexel : 0;  // properties and motion
    const std::size_t places = NoisyFrame::kPlaceBytes + (chains ? NoisyFrame::kMirroredBytes : 0);
    const std::size_t blurred = s.camera.lens.blurs() ? (frames + 1) * kDenoiserLensBytes : 0;
    constexpr std::size_t kReplaced = 9 * kTexel;  // measured: pictures and weights, and the driver's copies
    const std::size_t held = denoiser_frame_bytes(near) + mirrored + film_bytes(s);
    // A frame is read from a file, which its process keeps or another one has written: the file, and its channels.
    const std::size_t file = s.keep_noisy || near > 0 ? 2 * held : 0;
    return kDenoiserPixelBytes + kReplaced + mirrored + blurred + (near > 0 ? kDenoiserNeighbourBytes + places : 0) +
           frames * held + file;
}

/// Returns the bytes that the largest window of the denoiser takes on top: copies, and transients of its margins.
std::size_t denoiser_window_bytes(const RenderSettings& s, bool chains) {
    if (!has_halves(s)) return 0;
    const PixelWindow rendered = rendered_window(s, s.camera.optics);
    std::size_t most = 0;
    for (const DenoiserWindow& w : denoiser_windows(s.camera.optics, {s.width, s.height}, rendered)) {
        if (w.margin == 0 && w.size == rendered.size()) continue;
        const auto frames = static_cast<std::size_t>(2 * neighbour_frames(s));
        const auto rows = static_cast<std::size_t>(w.size.y), margins = static_cast<std::size_t>(2 * w.margin);
        most = std::max(most, rows * ((static_cast<std::size_t>(w.size.x) + margins) *
                                          ((frames + 1) * kDenoiserWindowBytes + frames * kDenoiserWindowMotionBytes) +
                                      margins * denoiser_bytes(s, chains)));
    }
    return most;
}

std::size_t writing_bytes(const RenderSettings& s, const PictureUse& use) {
    // Colour rows are converted at once to another space and to half: at least a row of tiles.
    const std::size_t rows = static_cast<std::size_t>(std::max(256, use.exr_tile));
    // Channels of a .png are there as float, as 8 bits, and compressed.
    const std::size_t png = (s.transparent ? 4 : 3) * (sizeof(float) + 1 + 1);
    std::size_t colors = 4;
    for (const std::string& aov : s.aovs)
        if (find_aov(aov)->is_color()) colors += 3;
    const ivec2 size = data_window(s).size();
    const auto width = static_cast<std::size_t>(size.x), height = static_cast<std::size_t>(size.y);
    const std::size_t exr = std::min(rows, height) * width * colors * (sizeof(float) + sizeof(std::uint16_t));
    const bool views = s.camera.optics.stereo == Stereo::views;  // the layers are copied, each eye apart
    return (use.exr ? exr + (views ? film_bytes(s) * width * height : 0) : 0) + (use.png ? width * height * png : 0);
}

/// Fills in the parts that belong to the whole picture.
void add_whole_picture(MemoryEstimate& m, const RenderSettings& s, const PictureUse& use, bool chains) {
    const ivec2 size = rendered_window(s, s.camera.optics).size();
    const std::size_t pixels = std::size_t(size.x) * std::size_t(size.y);
    constexpr std::size_t kHeldOut = 3 * kTexel;  // the two pictures, and the film of the second one
    m.film = (film_bytes(s) + (s.denoise_error > 0 ? kHeldOut : 0)) * pixels;
    m.preview = preview_bytes(s.preview) * pixels + denoiser_bytes(s, chains) * pixels +
                denoiser_window_bytes(s, chains) +
                (s.preview.cache ? std::size_t{shared::kCacheCells} * sizeof(shared::CacheCell) : 0);
    m.writing = writing_bytes(s, use);
}

}  // namespace

std::size_t scene_bytes(const SceneSize& size) {
    // Measured with scenes/, cities and triangles without common edges, and rounded up. Per triangle: corners,
    // hierarchy, tables, nodes for native tracing (9 bytes; 30 in scenes that move). Hierarchies of scenes that move
    // are kept.
    const std::size_t per_triangle = size.moves ? 380 : 200;
    constexpr std::size_t kPools = 2;               // bytes of half floats per byte of an image
    const std::size_t copies = size.moves ? 4 : 2;  // contents of the file and of poses, but for images
    // Textures in tiles share a pool, which holds those of alpha tests and lights as half floats, and some others.
    const std::size_t pool = size.tile_bytes > 0 ? 2 * size.pinned_bytes + kLeastTilePool : 0;
    return std::max(per_triangle * traced(size) + copies * (size.contents() - size.texture_bytes) +
                        (1 + kPools) * size.texture_bytes + pool,
                    size.contents() + size.decoding_bytes);
}

MemoryEstimate estimate_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings s,
                               const PictureUse& use) {
    const Estimator asked = s.estimator;
    settle_for_most(s.estimator);
    std::size_t paged = 0;  // bytes per path of rays that wait for pages, and of table rows
    if (size.paged) {
        s.primary = PrimaryVisibility::traced;
        if (s.page_schedule != paging::PageSchedule::queries) s.culling = rays::Culling::off;
        paged = paging::PageServer::kRayBytes *
                    std::max({std::size_t{1}, std::size_t(s.estimator.reuse), std::size_t(s.estimator.shadow)}) +
                paging::RowGather::bytes_per_path(static_cast<std::uint32_t>(scene.vertex_stride()));
    }
    s.primary = resolved(s.primary, size.drawn, ivec2(s.width, s.height),
                         shown_by_tracing(s.camera.optics, s.camera.lens.blurs(), has_overscan(s)));
    s.want_view = use.png;
    s.pictures = 0;
    const std::size_t pictures = (s.want_view ? 2 : 1) * kTexel;  // bytes per path of the picture and its view
    const FrameOptions options = frame_options(s, asked);
    const DeclaredBand band(scene, s, options, size.drawn > traced(size));
    const std::size_t paths = band.band.paths(), bands = band.bands(), state = band.state_bytes();
    const std::size_t matte = mattes(s) * kMatte, replicates = replicates_bytes(scene, s);
    MemoryEstimate m{.program = kProgramBytes,
                     .scene = scene_bytes(size),
                     .band = band.graphs.transient_bytes() + band.sum_bytes() + (paged + pictures) * paths,
                     .visibility = std::max(state, std::min(state * bands, s.state_bytes)),
                     .reading = band.reading_bytes(s) + (pictures + matte + replicates) * paths};
    add_whole_picture(m, s, use, bool(band.needs.chains));
    // Bands that grow together keep their sums, replicates and mattes.
    const bool together = s.adaptive && (s.error || s.time_limit > 0);
    if (together) m.reading += (bands - 1) * (band.sum_bytes() + (matte + replicates) * paths);
    if (s.parts > 1) m.reading += (together ? bands : 1) * (band.sum_bytes() + replicates * paths);  // totals of parts
    return m;
}

std::size_t least_picture_bytes(const RenderSettings& settings, const PictureUse& use) {
    RenderSettings s = settings;
    s.width = std::max(s.width, 1), s.height = std::max(s.height, 1);
    s.want_view = use.png;
    MemoryEstimate m;
    add_whole_picture(m, s, use, false);
    return m.picture();
}

MemoryEstimate fit_into_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings& settings,
                               const PictureUse& use, std::size_t bytes) {
    constexpr std::size_t kSmallestBand = std::size_t{1} << 12;  // pixels; one row of blocks if that is more
    const auto too_large = [&](const MemoryEstimate& m) { return m.picture() > bytes; };
    MemoryEstimate m = estimate_memory(scene, size, settings, use);
    if (!too_large(m)) return m;
    const std::size_t others = m.picture() - m.visibility;
    settings.state_bytes = bytes - std::min(bytes, others);  // at least the lists of one band are kept
    m = estimate_memory(scene, size, settings, use);
    for (; too_large(m) && settings.band_pixels > kSmallestBand; m = estimate_memory(scene, size, settings, use))
        settings.band_pixels /= 2;
    return m;
}

}  // namespace halflight
