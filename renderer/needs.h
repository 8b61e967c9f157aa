// The parts of a frame that contribute to the picture, decided in one place from facts about the scene and from the
// options. Pure: no OpenGL.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/rays/culling.h"
#include "engine/settings/preview.h"
#include "engine/settings/visibility.h"
#include "engine/tables/needs.h"

namespace halflight {

/// Requested properties of a frame.
struct FrameOptions {
    int bounces = 8;             // >= 0
    bool want_squares = false;   // requests sums of squares, for the variance
    bool want_features = false;  // requests sums of albedo and normal
    bool denoise = false;        // requests sums of half the samples, and the denoiser of the picture
    bool adaptive = false;       // requests two sets of sums, with their squares
    bool want_hits = false;      // requests hits of camera rays as an output
    rays::Culling culling = rays::Culling::automatic;
    std::uint64_t runs = 0;  // upper limit of the samples of a band in all pictures; 0: unknown
    bool native = false;     // native tracing is offered, so trials of tiles pay later
    Kept kept{};             // parts that are built although they contribute nothing
    int light_groups = 0;    // number of light groups whose light is summed apart; 0: none
    float clamp = 0;         // largest luminance of a sample's indirect light; 0: not clamped
    PrimaryVisibility primary = PrimaryVisibility::raster;  // method used; never `automatic`
    Backfaces backfaces = Backfaces::automatic;             // rays that pass back faces
    int group_size = 1;                                     // pixels that share paths: 4, 8 or 16; 1: no path reuse
    bool group_size_piloted = false;                        // a pilot chose group_size
    bool camera_rays_piloted = false;                       // a pilot chose camera_rays
    int camera_rays = 1;                                    // camera rays per sample for directly visible light, > 0
    bool lens = false;                                      // camera rays start on a lens
    bool optics = false;                                    // camera rays follow shaders/shared/ray_projections.h
    bool show_lamps = false;                                // camera rays see the lamps that have a size
    int shadow_rays = 1;                                    // shadow rays per sample from the first surface, > 0
    bool radiance_cache = false;  // samples end paths in the radiance cache; excludes path reuse
    Preview preview{};            // modes of the whole picture
};

/// A part of a frame that is built or left out as a whole: passes, buffers or shader code.
struct FramePart {
    const char* name;
    std::size_t path_bytes = 0;      // bytes of the part's own buffers per path of a band
    const char* left_out = nullptr;  // reason why the part contributes nothing; null: the part is built
    explicit operator bool() const { return left_out == nullptr; }
};

struct FrameNeeds {
    FramePart shadow, diffuse, glossy, continuation;  // passes
    FramePart later_light;                            // light samples at later vertices of paths
    FramePart reuse;                                  // path reuse by the pixels of a group
    FramePart radiance_cache;                         // cache in which paths end
    FramePart camera_rays, camera_hits;               // outputs of the G-buffer
    FramePart lens, optics;                           // camera rays that start on a lens, or follow optics
    FramePart seen;                                   // additional camera rays for directly visible light
    FramePart shown_lamps;                            // lamps that camera rays see
    FramePart clamp;                                  // clamp of indirect light
    FramePart chains;                                 // surfaces seen in mirrors and through clear glass
    FramePart squares, features, halves;              // sums
    FramePart light_groups;                           // sums of light groups, and their light along paths
    FramePart tiles;                                  // tile lists of first shadow rays
    std::array<FramePart, 20> parts() const {
        return {shadow,      diffuse,     glossy,   continuation, later_light,  reuse,       radiance_cache,
                camera_rays, camera_hits, lens,     optics,       seen,         shown_lamps, clamp,
                chains,      squares,     features, halves,       light_groups, tiles};
    }
};
/// Decides which parts are built. scene: includes kept parts. A kept part also keeps the parts that it depends on.
FrameNeeds frame_needs(const SceneNeeds& scene, const FrameOptions& options);

/// A part that a frame leaves out.
struct LeftOut {
    std::string what;
    std::string fact;       // reason why the part contributes nothing
    std::size_t bytes = 0;  // size of the part's buffers before passes share memory, bytes; 0: code only
    bool operator==(const LeftOut&) const = default;
};
struct FrameSize {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t paths = 0;   // number of paths of a band
    std::size_t pixels = 0;  // number of pixels of the picture
};
/// Lists the parts left out: those of the frame, then of the whole picture, then of the scene's tables and shaders.
std::vector<LeftOut> left_out(const SceneNeeds& scene, const FrameOptions& options, const FrameSize& size);

/// Returns the names that can be kept, in the order of left_out(). A kept name has no effect on a part that an option
/// disables (bounces, culling).
std::vector<std::string> keepable_names();

}  // namespace halflight
