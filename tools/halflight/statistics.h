// What a run was and what it cost, as JSON.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "engine/device/deform.h"
#include "engine/gpu/context.h"
#include "renderer/render.h"
#include "tools/halflight/arguments.h"

namespace halflight {

/// Seconds of wall time that the steps around the renderer took.
struct StepTimes {
    double context = 0;  // colour config and OpenGL context
    double load = 0;     // waiting for scene and environment, which are read meanwhile
    double render = 0;   // Renderer: preparing, compiling, sampling, reading back
    double write = 0;    // files
    double total = 0;    // since the program's start
};

/// Most memory that the program has had at a time, resident.
std::uint64_t peak_memory_bytes();

/// "none", or the environment's name, with its radiance where it is constant.
std::string environment_name(const Environment& environment);

/// The settings as one line, for the picture's comments.
std::string settings_line(const RenderArguments& arguments, const RenderSettings& settings, const Scene& scene,
                          const RenderStats& stats);

/// "shadow gave 3 NaN, 1 infinite and 0 negative values" for each pass that gave any; empty where none did.
std::string describe_bad_values(const RenderStats& stats);
/// "relmse 0.0098, 0.0095 to 0.0101 at 95 %, target 0.01 reached".
std::string error_line(const AchievedError& error);

/// deformed: of scenes in which meshes deform (FrameRenderer).
nlohmann::ordered_json run_statistics(const RenderArguments& arguments, const RenderSettings& settings,
                                      const Scene& scene, const gpu::Context& context, const RenderStats& stats,
                                      const StepTimes& times, const std::optional<DeformStatistics>& deformed);

}  // namespace halflight
