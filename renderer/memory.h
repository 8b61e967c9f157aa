// Estimate of the memory that rendering a picture takes, for job schedulers and `halflight info`. Pure: no OpenGL.
#pragma once

#include <cstddef>

#include "engine/tables/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Size of a scene.
struct SceneSize {
    std::size_t geometry_bytes = 0;  // meshes
    std::size_t texture_bytes = 0;   // images and the environment map
    std::size_t traced = 0;          // triangles in hierarchies (tables.h), shared ones counted once
    std::size_t drawn = 0;           // triangles of all instances
    bool moves = false;              // the scene is animated
};

/// Use of a picture: files and motion blur.
struct PictureUse {
    bool exr = true;       // the picture is written as .exr
    bool png = false;      // the picture is written as .png
    bool shutter = false;  // the picture is the mean of pictures at several shutter times (renderer/shutter.h)
};

/// Bytes of a process that renders with a software driver, which keeps buffers and textures in main memory. Each field
/// is a peak; not all peaks coincide.
struct MemoryEstimate {
    std::size_t program = 0;  // program, driver and compiled shaders
    std::size_t scene = 0;    // scene as read, tables, hierarchies, and buffers of these
    std::size_t band = 0;     // buffers of a band, and its visibility state
    std::size_t reading = 0;  // copies of a band's results: sums, records, counts of mattes
    std::size_t film = 0;     // the picture and its layers
    std::size_t preview = 0;  // textures of picture size (RenderSettings::preview), and the radiance cache
    std::size_t shutter = 0;  // sums of the pictures at several times, and the first of them
    std::size_t writing = 0;  // buffers for writing files
    std::size_t total() const { return program + scene + band + reading + film + preview + shutter + writing; }
};

/// Returns an upper estimate for any number of samples. What the estimator leaves to a pilot counts as its most
/// expensive choice. scene: includes kept parts. Raster culling is not counted.
MemoryEstimate estimate_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings settings,
                               const PictureUse& use);

}  // namespace halflight
