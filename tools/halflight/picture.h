// A render as files.
#pragma once

#include <filesystem>
#include <string>

#include "engine/color/color.h"
#include "passes/render.h"

namespace halflight {

/// What an EXR tells beside its pixels.
struct PictureInfo {
    Camera camera;
    LinearSpace working_space;  // of the colour layers that are written; variances stay linear Rec.709
    bool half = false;          // beauty as half floats; the AOVs bring their own type
    std::string comments;
    std::string error;  // that the picture has, in words; empty where it is not known
};

/// The picture as .exr or .png, told by the extension.
void write_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info);

}  // namespace halflight
