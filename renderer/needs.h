// What a frame is made of: which of its parts have something to contribute, decided in one place from facts about the
// scene and from what was asked for. Pure: no OpenGL.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/settings/preview.h"
#include "engine/settings/visibility.h"
#include "engine/tables/needs.h"

namespace halflight {

/// What was asked for.
struct FrameOptions {
    int bounces = 8;             // >= 0
    bool want_squares = false;   // for the variance
    bool want_features = false;  // albedo and normal
    bool want_hits = false;      // of camera rays
    rays::Culling culling = rays::Culling::automatic;
    std::uint64_t runs = 0;  // of each band at most: samples of all pictures; 0: any number
    Kept kept{};             // parts that contribute nothing and are there all the same
    float clamp = 0;         // > 0: the most luminance of a sample's indirect light
    PrimaryVisibility primary = PrimaryVisibility::raster;  // not automatic
    int group_size = 1;                                     // pixels that share their paths; 1: none do, 4, 8, 16
    bool group_size_piloted = false;                        // what these are came of a pilot
    bool camera_rays_piloted = false;
    int camera_rays = 1;          // of each sample, for light that is seen directly; > 0
    int shadow_rays = 1;          // of each sample, from the surface that the camera sees; > 0
    bool radiance_cache = false;  // for the samples of Preview::cache that use it; goes without reuse
    Preview preview{};            // of the whole picture
};

/// A part of a frame.
struct FramePart {
    const char* name;
    std::size_t path_bytes = 0;      // of the buffers that are its own, for each path of a band
    const char* left_out = nullptr;  // the fact that makes it contribute nothing; null: it is there
    explicit operator bool() const { return left_out == nullptr; }
};

struct FrameNeeds {
    FramePart shadow, diffuse, glossy, continuation;  // passes
    FramePart later_light;                            // light samples where paths have been reflected
    FramePart reuse;                                  // of paths, by the pixels of a group
    FramePart radiance_cache;                         // in which paths end
    FramePart camera_rays, camera_hits;               // outputs of the G-buffer
    FramePart seen;                                   // light, through camera rays of its own
    FramePart clamp;                                  // of indirect light
    FramePart squares, features;                      // sums
    FramePart tiles;                                  // lists of the shadow rays of surfaces that the camera sees
    std::array<FramePart, 14> parts() const {
        return {shadow,      diffuse,     glossy, continuation, later_light, reuse,    radiance_cache,
                camera_rays, camera_hits, seen,   clamp,        squares,     features, tiles};
    }
};
/// scene: with what is kept of it. A part that is kept brings along those that it cannot do without.
FrameNeeds frame_needs(const SceneNeeds& scene, const FrameOptions& options);

/// Something that a frame does without.
struct LeftOut {
    std::string what;
    std::string fact;       // that allows it
    std::size_t bytes = 0;  // of its buffers, before passes share memory in turns; 0: it is code alone
    bool operator==(const LeftOut&) const = default;
};
struct FrameSize {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t paths = 0;   // of a band
    std::size_t pixels = 0;  // of the picture
};
/// Parts of the frame first, then those of the whole picture, then what the scene's tables and shaders are without.
std::vector<LeftOut> left_out(const SceneNeeds& scene, const FrameOptions& options, const FrameSize& size);

/// What can be kept, in the order of that list. Parts that were not asked for by their own option stay out all the
/// same: bounces, culling.
std::vector<std::string> keepable_names();

}  // namespace halflight
