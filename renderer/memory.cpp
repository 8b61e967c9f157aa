#include "renderer/memory.h"

#include <algorithm>

#include "passes/preview/denoise.h"
#include "passes/surface/raster_window.h"
#include "renderer/band_size.h"
#include "renderer/cryptomatte.h"
#include "renderer/film.h"
#include "renderer/frame_options.h"
#include "renderer/replicates.h"
#include "shaders/shared/aov.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path.h"
#include "shaders/shared/radiance_cache.h"
#include "shaders/shared/rays.h"
#include "shaders/shared/reuse.h"
#include "shaders/shared/surface.h"

namespace halflight {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr std::size_t kTexel = sizeof(vec4);
constexpr std::size_t kLightSums = (4 + 6 + 6) * sizeof(double);  // emission, direct, indirect
/// IdCoverage: a head, and an entry for each object seen. Edges have several; twice as many as pixels are more than the
/// pictures of scenes/ have after many samples. A vector that grows has room for twice as many again.
constexpr std::size_t kMatte = sizeof(std::uint32_t) + 2 * 2 * 3 * sizeof(std::uint32_t);

bool is_matte(const std::string& aov) {
    return !cryptomatte_layer(aov).empty();
}

std::size_t mattes(const RenderSettings& s) {
    return static_cast<std::size_t>(std::ranges::count_if(s.aovs, is_matte));
}

bool wants_records(const RenderSettings& s) {
    const auto at_centre = [](const std::string& aov) { return find_aov(aov)->at_centre && !find_aov(aov)->debug; };
    return std::ranges::any_of(s.aovs, at_centre) || s.preview.of_picture();
}

/// What costs most of all that a pilot may choose.
void settle_for_most(Estimator& e) {
    if (e.reuse == Reuse::automatic) e.reuse = Reuse::sixteen;
    if (e.camera == CameraRays::automatic) e.camera = CameraRays::sixteen;
    if (e.shadow == ShadowRays::automatic) e.shadow = ShadowRays::eight;
}

std::size_t surface_bytes(const SceneNeeds& n) {
    return shared::surface_rows(n.glossy, n.transmission, n.clearcoat) * kTexel;
}

/// As software drivers have it; others, which may take larger bands, have memory of their own for them.
Band band_of(const SceneNeeds& scene, const FrameNeeds& needs, const RenderSettings& s) {
    constexpr std::size_t kBlock = 128 * kMiB;
    std::size_t widest = std::max({surface_bytes(scene), sizeof(shared::PathState), 6 * sizeof(double)});
    if (needs.reuse) widest = std::max(widest, std::size_t(s.estimator.reuse) * sizeof(shared::Ray));
    if (needs.shadow) widest = std::max(widest, (std::size_t(s.estimator.shadow) + 1) * sizeof(shared::DirectLight));
    constexpr int kTextureSize = 16384;
    return first_band(s, std::min(s.band_pixels, kBlock / widest), std::max(kTextureSize, s.width));
}

/// Of the buffers of a band and of its sums. Few of them share memory in turns.
std::size_t path_bytes(const SceneNeeds& scene, const FrameNeeds& needs, const RenderSettings& s) {
    std::size_t bytes = surface_bytes(scene) + kLightSums;
    for (const FramePart& part : needs.parts())
        if (part) bytes += part.path_bytes;
    // For rays to the sun, and their light: of the first surface, and along paths.
    if (scene.sun) bytes += 2 * (sizeof(shared::Ray) + sizeof(shared::uint)) + sizeof(shared::DirectLight) + kTexel;
    if (scene.light_tree) bytes += sizeof(shared::Receiver);
    // Records of later vertices; with path reuse they share the memory of its rays.
    if ((needs.diffuse || needs.glossy) && !needs.reuse) bytes += surface_bytes(scene);
    if (s.preview.cache) bytes += kLightSums + sizeof(shared::CachePoint);
    if (wants_records(s)) bytes += sizeof(shared::AovRecord);
    if (asked_for(s, {"nodes", "culling"})) bytes += sizeof(shared::DebugRecord);
    return bytes + (s.want_view ? 2 : 1) * kTexel;  // of the picture
}

/// Of lists for the shadow rays of each band; the sun's rays have lists of their own. An instance's entries have three
/// boxes. A float hierarchy's are twice as large as those of a grid, which is what the rays left over have room for.
std::size_t state_bytes(const SceneNeeds& scene, const SceneSize& size, const FrameNeeds& needs, const Band& band,
                        const RenderSettings& s) {
    if (!needs.tiles) return 0;
    const std::size_t boxes = size.drawn > size.traced ? 3 : 1;
    const std::size_t each = (scene.sun ? 2 : 1) * boxes * needs.tiles.path_bytes * band.paths();
    const auto bands = static_cast<std::size_t>((s.height + band.rows - 1) / band.rows);
    return std::max(each, std::min(each * bands, s.state_bytes));
}

std::size_t reading_bytes(const FrameNeeds& needs, const RenderSettings& s) {
    std::size_t bytes = (s.want_view ? 2 : 1) * kTexel + mattes(s) * kMatte;
    if (asked_for(s,
                  {"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse", "indirect_glossy", "variance"}) ||
        s.error)
        bytes += kLightSums;
    if (needs.camera_hits && mattes(s) > 0) bytes += sizeof(shared::Hit);
    if (asked_for(s, {"variance"})) bytes += needs.squares.path_bytes;
    if (asked_for(s, {"albedo", "normal"})) bytes += needs.features.path_bytes;
    if (wants_records(s)) bytes += sizeof(shared::AovRecord);
    if (asked_for(s, {"nodes", "culling"})) bytes += sizeof(shared::DebugRecord);
    if (s.error) bytes += 3 * (sizeof(double) + kReplicates * sizeof(float));
    return bytes;
}

/// By pixel; see PreviewPicture.
std::size_t preview_bytes(const Preview& p) {
    if (!p.of_picture()) return 0;
    constexpr std::size_t kPixels = 5 + 2;       // light, guide, place, albedo, beauty; the new beauty, here and there
    constexpr std::size_t kEarlier = 2 * 3 + 3;  // pictures of light, guide and place; where places were
    return (kPixels + (p.temporal ? kEarlier : 0) + (p.filter ? kDenoiseLevels + 2 : 0)) * kTexel;
}

/// By pixel: sums in double, and the first picture; a picture of the frame's own time counts as another one.
std::size_t shutter_bytes(const RenderSettings& s) {
    std::size_t channels = 4;
    for (const std::string& aov : s.aovs)
        if (!is_matte(aov) && !find_aov(aov)->at_centre) channels += layer_channels(*find_aov(aov));
    return channels * sizeof(double) + film_bytes(s) + mattes(s) * kMatte;
}

std::size_t writing_bytes(const RenderSettings& s, const PictureUse& use) {
    constexpr std::size_t kRows = 256;                         // of colour at once, in another space and as halves
    constexpr std::size_t kPng = 3 * (sizeof(float) + 1 + 1);  // without alpha, in 8 bits, compressed
    std::size_t colors = 4;
    for (const std::string& aov : s.aovs)
        if (find_aov(aov)->channels == "RGB") colors += 3;
    const auto width = static_cast<std::size_t>(s.width), height = static_cast<std::size_t>(s.height);
    const std::size_t exr = std::min(kRows, height) * width * colors * (sizeof(float) + sizeof(std::uint16_t));
    return (use.exr ? exr : 0) + (use.png ? width * height * kPng : 0);
}

}  // namespace

MemoryEstimate estimate_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings s,
                               const PictureUse& use) {
    // Seen of scenes/ and of a city of 10^6 triangles, rounded up; of the program, of the first run, which compiles
    // all.
    constexpr std::size_t kProgram = 160 * kMiB;
    constexpr std::size_t kTriangle = 320;  // corners, hierarchy, tables
    const Estimator asked = s.estimator;
    settle_for_most(s.estimator);
    s.primary = resolved(s.primary, size.drawn, ivec2(s.width, s.height));
    s.want_view = use.png;
    s.pictures = 0;
    const FrameNeeds needs = frame_needs(scene, frame_options(s, asked));
    const Band band = band_of(scene, needs, s);
    const std::size_t paths = band.paths(), pixels = std::size_t(s.width) * std::size_t(s.height);
    constexpr std::size_t kRasterTexel = sizeof(uvec2) + sizeof(float);  // visibility, depth
    const bool raster = s.primary == PrimaryVisibility::raster;
    const std::size_t window = raster ? kRasterTexel * std::size_t(s.width) * std::size_t(raster_window(band).rows) : 0;
    const std::size_t copies = size.moves ? 4 : 2;  // the file's, and those of poses
    return {.program = kProgram,
            .scene = kTriangle * size.traced + copies * (size.geometry_bytes + size.texture_bytes),
            .band = path_bytes(scene, needs, s) * paths + window + state_bytes(scene, size, needs, band, s),
            .reading = reading_bytes(needs, s) * paths,
            .film = film_bytes(s) * pixels,
            .preview = preview_bytes(s.preview) * pixels +
                       (s.preview.cache ? std::size_t{shared::kCacheCells} * sizeof(shared::CacheCell) : 0),
            .shutter = use.shutter ? (shutter_bytes(s) + film_bytes(s)) * pixels : 0,
            .writing = writing_bytes(s, use)};
}

}  // namespace halflight
