// The picture on the window's own context: through the view transform, and onto the window.
#pragma once

#include <map>
#include <optional>

#include "engine/color/color.h"
#include "engine/gpu/framebuffer.h"
#include "engine/gpu/program.h"
#include "tools/view/seen.h"

namespace halflight::view {

/// Needs its context current for as long as it lives.
class Display {
  public:
    Display() = default;

    void set_view(const ViewProcessor& view);
    /// Exposure and view may change afterwards; nothing is uploaded again.
    void set_picture(const Seen& seen);
    bool empty() const { return !linear_; }

    /// Fills the window's framebuffer of this size, whatever size the picture has; black without a picture.
    void draw(const ivec2& framebuffer);
    /// What is drawn, pixel by pixel as the picture has them: RGB, display-encoded, 8 bits each. Not empty().
    Image read();

  private:
    struct View {
        gpu::ShaderSource source;
        std::vector<std::pair<std::string, gpu::Texture>> luts;  // by sampler
        float exposure_scale = 1;
    };
    void develop();

    gpu::ProgramCache programs_;
    std::string view_id_;  // GpuShader::cache_id of `view_`
    std::optional<View> view_;
    bool encoded_ = false;
    bool developed_ = false;              // shown_ is linear_ through the view
    std::optional<gpu::Texture> linear_;  // as it came
    std::optional<gpu::Texture> shown_;   // RGBA8, of the same size; first row: the picture's upper one
    std::optional<gpu::Framebuffer> target_;
};

}  // namespace halflight::view
