// A render as files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "engine/color/color.h"
#include "engine/core/frames.h"
#include "renderer/render.h"

namespace halflight {

/// What an EXR tells beside its pixels.
struct PictureInfo {
    Camera camera;
    LinearSpace working_space;  // of the colour layers that are written; variances stay linear Rec.709
    bool half = false;          // beauty as half floats; the AOVs bring their own type
    std::string comments;
    std::string filter;         // that made the pixels
    std::string shutter;        // how long it was open; empty without motion blur
    std::string bias;           // why it would not converge to the light that there is; empty where it would
    std::string error;          // that the picture has, in words; empty where it is not known
    bool reproducible = false;  // without the date
    // Of a frame of a sequence:
    std::optional<FrameRate> frame_rate{};
    std::uint32_t frame = 0;
    std::string fingerprint{};  // fingerprint.h
};

/// The picture as .exr or .png, told by the extension.
void write_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info);

}  // namespace halflight
