// Pictures through the view transform from scene-linear .exr files, without rendering.
#pragma once

#include <filesystem>
#include <optional>

#include "api/halflight/picture_file.h"
#include "engine/color/color.h"
#include "engine/gpu/context.h"
#include "engine/gpu/program_cache.h"
#include "engine/settings/render_settings.h"
#include "passes/picture/composite.h"
#include "renderer/render_result.h"

namespace halflight {

/// Returns whether .exr files of these settings hold the colours of pictures bit for bit. Half floats, lossy
/// compression and other working spaces round them.
bool holds_bits(const RenderSettings& settings, const OutputOptions& output, const ColorConfig& colors);

/// Applies a view to pictures of .exr files. The context must be current when an object is used or destroyed.
class Developer {
  public:
    /// settings: those of the pictures, with their exposure.
    Developer(gpu::Context& context, const ColorConfig& colors, const RenderSettings& settings,
              const OutputOptions& output);
    /// Returns the picture of a file with its view: that which rendering makes, bit for bit if holds_bits(). Throws
    /// Error for a file that cannot be read.
    RenderResult develop(const std::filesystem::path& exr);

  private:
    Image view_of(const Image& beauty, bool replaced);

    const RenderSettings& settings_;
    mat3 to_rec709_;
    std::optional<ViewProcessor> view_;
    std::optional<ViewKernel> kernel_;
    gpu::ProgramCache programs_;
};

}  // namespace halflight
