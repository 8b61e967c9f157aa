// Estimate of the memory that rendering a picture takes, for job schedulers and `halflight info`. Pure: no OpenGL.
#pragma once

#include <cstddef>

#include "engine/scene/scene_size.h"
#include "engine/tables/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Files of a picture.
struct PictureUse {
    bool exr = true;   // the picture is written as .exr
    bool png = false;  // the picture is written as .png
    int exr_tile = 0;  // side of the tiles of the .exr, pixels; 0: it has lines
};

/// Bytes of a process that renders with a software driver, which keeps buffers and textures in main memory. Each field
/// is a peak; not all peaks coincide.
struct MemoryEstimate {
    std::size_t program = 0;     // program, driver and compiled shaders
    std::size_t scene = 0;       // scene_bytes()
    std::size_t band = 0;        // buffers of a band
    std::size_t visibility = 0;  // tile lists that are carried from sample to sample, of all bands
    std::size_t reading = 0;     // copies of results: sums, records, mattes; also what bands that grow together keep
    std::size_t film = 0;        // the picture and its layers
    std::size_t preview = 0;     // textures of picture size (RenderSettings::preview), and the radiance cache
    std::size_t writing = 0;     // buffers for writing files
    /// Returns the bytes that depend on the picture.
    std::size_t picture() const { return band + visibility + reading + film + preview + writing; }
    std::size_t total() const { return program + scene + picture(); }
};

/// Returns the bytes that a scene takes from loading to rendering: contents, tables, hierarchies, buffers.
std::size_t scene_bytes(const SceneSize& size);

/// Returns an upper estimate for any number of samples. What the estimator leaves to a pilot counts as its most
/// expensive choice. scene: includes kept parts. Raster culling is not counted.
MemoryEstimate estimate_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings settings,
                               const PictureUse& use);

/// Returns the bytes that every picture of these settings takes, whatever the scene and the bands. Sides that are not
/// set yet count as 1 pixel.
std::size_t least_picture_bytes(const RenderSettings& settings, const PictureUse& use);

/// Makes the bands and the visibility state of `settings` small enough for the picture to take `bytes` at most. The
/// picture does not depend on them. Returns its estimate, which is larger than `bytes` if even the smallest bands do
/// not fit.
MemoryEstimate fit_into_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings& settings,
                               const PictureUse& use, std::size_t bytes);

}  // namespace halflight
