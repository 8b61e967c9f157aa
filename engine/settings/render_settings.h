// All settings of a renderer. SceneSettings are its scene. FrameSettings and PictureSettings say how the picture is
// made. ScheduleSettings say how the work is scheduled, which never changes the picture. constraints.h says which
// settings cannot be combined. No OpenGL is used.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/view_transform.h"
#include "engine/paging/page_schedule.h"
#include "engine/rays/culling.h"
#include "engine/settings/data_window.h"
#include "engine/settings/estimator.h"
#include "engine/settings/frame_settings.h"
#include "engine/settings/preview.h"
#include "engine/settings/visibility.h"
#include "engine/tables/needs.h"

namespace halflight {

inline constexpr int kMaxSide = 65536;  ///< pixels; drivers may allow less
inline constexpr int kMaxBounces = 1024;
/// PictureSettings::bounces that are left open, in scenes without and with solid glass. A solid takes two to be
/// crossed.
inline constexpr int kBounces = 8, kBouncesOfSolids = 32;
inline constexpr int kMaxDenoiseFrames = 4;
inline constexpr int kDenoiseFrames = 2;  ///< PictureSettings::denoise_frames of a sequence that leaves them open

/// Settings that decide the pixels and hold for all pictures of a renderer. settings_table.h lists names and ranges.
struct PictureSettings {
    int width = 1280;  // pixels, > 0
    int height = 720;  // pixels, > 0
    // Projection and eyes of the pictures of a FrameRenderer, which makes its cameras by them. A Renderer uses those of
    // its cameras.
    Optics optics{};
    // Rectangle that is rendered instead of the whole picture, whose size and camera stay. It may reach beyond the
    // picture's edges. Its pixels have the bits of the whole picture. None: the whole picture.
    std::optional<PixelWindow> crop{};
    int overscan = 0;  // pixels that are added on each side of crop or picture, >= 0
    // Reflections and refractions along a path, >= 0; 0: emission only, 1: direct light; none: default_bounces() if
    // a FrameRenderer renders, else kBounces.
    std::optional<int> bounces{};
    // Largest luminance of a sample of a pixel's indirect light; 0: not clamped. Brighter samples keep their hue and
    // are scaled down. Clamping is a bias, which RenderStats names.
    float clamp = 0;
    // Lookups choose mip levels by the footprint of the ray (docs/textures.md), a bias that RenderStats names. The
    // scene must have been loaded with mip levels (GltfOptions::mip_levels).
    bool texture_lod = false;
    // Filters noise out of the finished picture (passes/picture/denoiser.h), a bias that RenderStats names.
    // Layers and error targets refer to the mean of the samples.
    bool denoise = false;
    // Prepares noisy frames as files (api/sequence/noisy_files.h): halves and properties are summed as for `denoise`.
    // Without `denoise`, the picture stays the mean of the samples.
    bool keep_noisy = false;
    // Number of frames before and after a frame that the denoiser uses, too; none: kDenoiseFrames in sequences, 0 in
    // single pictures and crops.
    std::optional<int> denoise_frames{};
    // Samples per pixel of each of two further pictures, from which the error of the denoised picture is estimated
    // (renderer/held_out.h); 0: it is not.
    int denoise_error = 0;
    // Gives blocks of pixels samples by their noise (passes/picture/adaptive.h). FrameSettings::samples is then the
    // mean number. It changes no expectation. With an error target, the sums of all bands are kept in memory.
    bool adaptive = false;
    std::vector<std::string> aovs;  // names of known_aovs(); Error for others
    bool half_color = false;        // colour layers as half floats; data stays float32
    // Leaves the environment out where the camera sees it directly; alpha tells how much of a pixel is covered. Colours
    // are premultiplied by alpha, and those of the view are not.
    bool transparent = false;
    // Camera rays see points, spots and directional lights that have a size. They hide nothing, and have no alpha.
    bool show_lamps = false;
    Backfaces backfaces = Backfaces::automatic;  // rays that pass back faces of single-sided materials
    bool want_view = false;                      // true: the picture through `view` is made, too
    ViewTransform view;
    PrimaryVisibility primary = PrimaryVisibility::automatic;  // method for camera rays
    // Ignored when renderers share a PreparedScene; its own estimator applies.
    Estimator estimator{};
    // Preview modes, which are biases that RenderStats names. Layers are unbiased, except for the radiance cache.
    Preview preview{};
};

/// Settings that decide time and memory and never change the picture.
struct ScheduleSettings {
    rays::Culling culling = rays::Culling::automatic;  // culling method of rays
    // Parts that are built although the scene has no use for them: passes, buffers, tables, shader code. Ignored when
    // renderers share a PreparedScene; its own setting applies.
    Kept kept{};
    int pictures = 0;      // upper limit of the pictures that will be rendered, of `samples` each; 0: unknown
    bool measure = false;  // waits for the GPU after each pass to time it, and counts rays and culling (slower)
    // Pixels of a band, the rows that are rendered at once: whole rows of 16x16 blocks, at least one such row. The
    // default needs half a gigabyte of buffers for a large picture.
    std::size_t band_pixels = std::size_t{1} << 20;
    // Bytes of visibility state. Each band has its own while there is room; the remaining bands share one.
    std::size_t state_bytes = std::size_t{256} << 20;
    // Bytes of device memory for the pages of a scene that is loaded in pages; 0: half of what the memory budget has
    // left.
    std::size_t pool_bytes = 0;
    paging::PageSchedule page_schedule = paging::kDefaultPageSchedule;  // how such pages are found
    // Bytes of device memory for tiles of textures that are not in memory; 0: half of what the memory budget has left.
    std::size_t tile_bytes = 0;
    // Adds one sample to every band before the next sample, so that there is a whole picture after each sample
    // (RenderProgress::picture). Keeps the sums of all bands in memory, up to 200 bytes per pixel. An error target
    // disables it.
    bool in_turns = false;
};

struct RenderSettings : FrameSettings, PictureSettings, ScheduleSettings {};

inline int bounces_of(const PictureSettings& settings) {
    return settings.bounces.value_or(kBounces);
}

/// Returns whether samples are summed in two halves, with properties of surfaces, for the denoiser.
inline bool has_halves(const PictureSettings& settings) {
    return settings.denoise || settings.keep_noisy;
}

/// Returns the number of frames before and after each frame that the denoiser uses.
inline int neighbour_frames(const PictureSettings& settings) {
    return has_halves(settings) ? settings.denoise_frames.value_or(0) : 0;
}

}  // namespace halflight
