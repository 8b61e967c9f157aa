// Blender's Cycles as a command.
#pragma once

#include <filesystem>
#include <string>

#include "engine/core/image.h"

namespace halflight::peer {

struct CyclesRun {
    Image image;         // RGB, scene-linear
    double seconds = 0;  // in the renderer, as the script tells: without Blender's start and the import
};

struct CyclesSettings {
    std::filesystem::path script;  // renders SCENE to OUT.exr, prints a JSON line with "seconds"
    std::string camera;            // empty: the first
    int width = 256;               // pixels
    int height = 256;              // pixels
    int samples = 64;
    int reflections = 8;  // along a path; Cycles calls one less its bounces
    int seed = 0;
    bool imported_metals = false;  // as Blender imports them, rather than in our model (tools/cycles_materials.py)
};

/// Throws Error where Blender or the script fail.
CyclesRun render_with_cycles(const std::filesystem::path& scene, const CyclesSettings& settings);

}  // namespace halflight::peer
