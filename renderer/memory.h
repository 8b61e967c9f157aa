// How much memory a picture will take, by what takes it: for whoever has to ask for memory before there is a renderer.
// Pure: no OpenGL.
#pragma once

#include <cstddef>

#include "engine/tables/needs.h"
#include "renderer/render.h"

namespace halflight {

/// What a scene holds.
struct SceneSize {
    std::size_t geometry_bytes = 0;  // of meshes
    std::size_t texture_bytes = 0;   // of images, with the environment's map
    std::size_t traced = 0;          // triangles in the hierarchy (tables.h), instances that share one counted once
    std::size_t drawn = 0;           // triangles, instances counted each
    bool moves = false;              // there is an animation
};

/// What becomes of a picture.
struct PictureUse {
    bool exr = true;  // what it is written as
    bool png = false;
    bool shutter = false;  // it is the mean of several (renderer/shutter.h)
};

/// Bytes of a process that renders with a software driver, which keeps buffers and textures in the same memory. Each is
/// what there is at most, not always at the same time.
struct MemoryEstimate {
    std::size_t program = 0;  // with the driver and compiled shaders
    std::size_t scene = 0;    // as read, its tables and hierarchies, and buffers of both
    std::size_t band = 0;     // buffers of what is rendered at once, and its visibility state
    std::size_t reading = 0;  // what comes of a band: sums, records, counts of mattes
    std::size_t film = 0;     // the picture and its layers
    std::size_t preview = 0;  // textures as large as the picture (RenderSettings::preview), and the radiance cache
    std::size_t shutter = 0;  // sums of the pictures at several times, and the first of them
    std::size_t writing = 0;  // what is made ready for files
    std::size_t total() const { return program + scene + band + reading + film + preview + shutter + writing; }
};

/// From above, of as many samples as one likes. What the estimator leaves to a pilot is taken to be what costs most.
/// scene: with what is kept of it. Culling by the rasterizer is not counted.
MemoryEstimate estimate_memory(const SceneNeeds& scene, const SceneSize& size, RenderSettings settings,
                               const PictureUse& use);

}  // namespace halflight
