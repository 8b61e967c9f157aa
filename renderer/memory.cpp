#include "renderer/memory.h"

#include <algorithm>

#include "engine/core/memory_ledger.h"
#include "engine/paging/page_server.h"
#include "engine/paging/row_gather.h"
#include "passes/picture/denoiser.h"
#include "passes/picture/shadow_catcher.h"
#include "passes/surface/raster_window.h"
#include "renderer/band_size.h"
#include "renderer/film.h"
#include "renderer/frame_options.h"
#include "renderer/noisy_frame.h"
#include "renderer/replicates.h"
#include "shaders/shared/aov_record.h"
#include "shaders/shared/cache_cells.h"
#include "shaders/shared/chain_records.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

using Source = LayerSource;

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr std::size_t kLeastTilePool = 16 * kMiB;
constexpr std::size_t kTexel = sizeof(vec4);
constexpr std::size_t kReplicatesBytes = 3 * (sizeof(double) + kReplicates * sizeof(float));  // bytes per path
constexpr std::size_t kLightSums = (4 + 6 + 6) * sizeof(double);  // bytes per path: emission, direct and indirect light
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

bool wants_records(const RenderSettings& s) {
    return asked_for(s, {Source::record}) || s.preview.temporal || neighbour_frames(s) > 0;
}

/// Replaces automatic choices by the most expensive choice of a pilot.
void settle_for_most(Estimator& e) {
    if (e.reuse == Reuse::automatic) e.reuse = Reuse::sixteen;
    if (e.camera == CameraRays::automatic) e.camera = CameraRays::sixteen;
    if (e.shadow == ShadowRays::automatic) e.shadow = ShadowRays::eight;
}

/// Returns the band that software drivers allow. Other drivers may allow larger bands, but have device memory for them.
Band band_of(const SceneNeeds& scene, const FrameNeeds& needs, const RenderSettings& s) {
    constexpr std::size_t kBlock = 128 * kMiB;
    std::size_t widest = std::max({scene.surface_record_bytes(), sizeof(shared::PathState), 6 * sizeof(double)});
    if (needs.halves) widest = std::max(widest, needs.halves.path_bytes);
    if (needs.light_groups) widest = std::max(widest, needs.light_groups.path_bytes);  // sum of its buffers
    if (needs.reuse) widest = std::max(widest, std::size_t(s.estimator.reuse) * sizeof(shared::Ray));
    if (needs.shadow) widest = std::max(widest, (std::size_t(s.estimator.shadow) + 1) * sizeof(shared::DirectLight));
    constexpr int kTextureSize = 16384;
    return first_band(s, std::min(s.band_pixels, kBlock / widest),
                      std::max({kTextureSize, s.width, rendered_window(s, s.camera.optics).size().x}));
}

/// Returns the bytes per path of the buffers of a band and of its sums. Few of these buffers share memory.
std::size_t path_bytes(const SceneNeeds& scene, const FrameNeeds& needs, const RenderSettings& s) {
    std::size_t bytes = scene.surface_record_bytes() + kLightSums;
    for (const FramePart& part : needs.parts())
        if (part) bytes += part.path_bytes;
    // Rays to the sun and their light exist for the first surface and for later vertices of paths.
    if (scene.sun) bytes += 2 * (sizeof(shared::Ray) + sizeof(shared::uint)) + sizeof(shared::DirectLight) + kTexel;
    if (scene.receivers()) bytes += sizeof(shared::Receiver);
    if (scene.sized_lights()) bytes += sizeof(shared::MetLamp);
    if (scene.texture_levels) bytes += sizeof(vec2);
    if (scene.volume) bytes += sizeof(vec4);
    if (scene.catchers) bytes += kCatcherSums * sizeof(double) + std::size_t(s.estimator.shadow) * sizeof(shared::uint);
    // Lists of rays that may meet panes: of shadow rays, of rays to the sun, and of scattered rays.
    if (scene.panes) bytes += (std::size_t(s.estimator.shadow) + 2) * sizeof(shared::uint);
    // Later vertices have records, which path reuse keeps in the memory of its rays.
    if ((needs.diffuse || needs.glossy) && !needs.reuse) bytes += scene.surface_record_bytes();
    // Runs of listed blocks trace camera rays.
    if (s.adaptive) bytes += scene.surface_record_bytes() + sizeof(shared::Ray) + sizeof(shared::Hit);
    if (s.preview.cache) bytes += kLightSums + sizeof(shared::CachePoint);
    if (wants_records(s)) bytes += sizeof(shared::AovRecord);
    if (needs.chains && neighbour_frames(s) > 0) bytes += sizeof(shared::ChainPlace);
    if (asked_for(s, {Source::debug})) bytes += sizeof(shared::DebugRecord);
    return bytes + (s.want_view ? 2 : 1) * kTexel;  // the last term is the picture
}

/// Returns the bytes of the tile lists for shadow rays of all bands. Rays to the sun have lists of their own. Entries
/// of instances have three boxes. Entries of a float hierarchy are twice as large as those of a grid hierarchy, within
/// the room counted for leftover rays.
std::size_t state_bytes(const SceneNeeds& scene, const SceneSize& size, const FrameNeeds& needs, const Band& band,
                        const RenderSettings& s) {
    if (!needs.tiles) return 0;
    const std::size_t boxes = size.drawn > traced(size) ? 3 : 1;
    const std::size_t each = (scene.sun ? 2 : 1) * boxes * needs.tiles.path_bytes * band.paths();
    const auto bands = static_cast<std::size_t>((band.image.y + band.rows - 1) / band.rows);
    return std::max(each, std::min(each * bands, s.state_bytes));
}

std::size_t reading_bytes(const FrameNeeds& needs, const RenderSettings& s) {
    std::size_t bytes = (s.want_view ? 2 : 1) * kTexel + mattes(s) * kMatte;
    if (s.error || asked_for(s, {Source::emission, Source::direct, Source::indirect, Source::squares}))
        bytes += kLightSums;
    if (needs.camera_hits && mattes(s) > 0) bytes += sizeof(shared::Hit);
    if (asked_for(s, {Source::squares})) bytes += needs.squares.path_bytes;
    bytes += 3 * sizeof(double) * light_group_layers(s).size();
    if (asked_for(s, {Source::features})) bytes += needs.features.path_bytes;
    if (wants_records(s)) bytes += sizeof(shared::AovRecord);
    if (needs.chains && neighbour_frames(s) > 0) bytes += sizeof(shared::ChainPlace);
    if (asked_for(s, {Source::debug})) bytes += sizeof(shared::DebugRecord);
    if (s.error) bytes += kReplicatesBytes;
    return bytes;
}

/// Returns the bytes per path of what bands keep that grow together: sums, replicates and mattes.
std::size_t kept_bytes(const FrameNeeds& needs, const RenderSettings& s) {
    if (!s.adaptive || !s.error) return 0;
    return kLightSums + 3 * sizeof(double) * light_group_layers(s).size() + needs.squares.path_bytes +
           needs.features.path_bytes + needs.halves.path_bytes + kReplicatesBytes + mattes(s) * kMatte;
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
    if (!s.denoise) return 0;
    const auto frames = static_cast<std::size_t>(near);
    const std::size_t mirrored = chains ? kDenoiserChainBytes + frames * kTexel : 0;  // properties and motion
    const std::size_t places = NoisyFrame::kPlaceBytes + (chains ? NoisyFrame::kMirroredBytes : 0);
    const std::size_t blurred = s.camera.lens.blurs() ? (frames + 1) * kDenoiserLensBytes : 0;
    return kDenoiserPixelBytes + mirrored + blurred + (near > 0 ? kDenoiserNeighbourBytes + places : 0) +
           frames * (denoiser_frame_bytes(near) + mirrored + film_bytes(s));
}

/// Returns the bytes that the largest window of the denoiser takes on top: copies, and transients of its margins.
std::size_t denoiser_window_bytes(const RenderSettings& s, bool chains) {
    if (!s.denoise) return 0;
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
    const FrameNeeds needs = frame_needs(scene, frame_options(s, asked));
    const Band band = band_of(scene, needs, s);
    const std::size_t paths = band.paths();
    constexpr std::size_t kRasterTexel = sizeof(uvec2) + sizeof(float);  // bytes per texel: visibility, depth
    const bool raster = s.primary == PrimaryVisibility::raster;
    const std::size_t window = raster ? kRasterTexel * std::size_t(s.width) * std::size_t(raster_window(band).rows) : 0;
    MemoryEstimate m{.program = kProgramBytes,
                     .scene = scene_bytes(size),
                     .band = (path_bytes(scene, needs, s) + paged) * paths + window,
                     .visibility = state_bytes(scene, size, needs, band, s),
                     .reading = reading_bytes(needs, s) * paths};
    add_whole_picture(m, s, use, bool(needs.chains));
    const auto bands = static_cast<std::size_t>((band.image.y + band.rows - 1) / band.rows);
    m.reading += (bands - 1) * paths * kept_bytes(needs, s);
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
