// The picture on the window's own context: through the view transform, and onto the window, alone or beside another
// one.
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
    bool empty() const { return !picture_; }
    /// Keeps the picture as it is now as the other one. Not empty().
    void keep();
    void drop_other() { other_.reset(); }
    bool comparing() const { return other_.has_value(); }
    /// Shaders that have changed (HALFLIGHT_SHADERS). Throws what gpu::ProgramCache::reload() throws.
    void reload_shaders();

    /// Fills the window's framebuffer of this size, whatever size the picture has; black without a picture. The other
    /// one, if there is such, is what is right of `split`, a share of the width; both go through the same view.
    void draw(const ivec2& framebuffer, float split);
    /// What is drawn, pixel by pixel as the picture has them: RGB, display-encoded, 8 bits each. Not empty().
    Image read(float split);

  private:
    struct View {
        gpu::ShaderSource source;
        std::vector<std::pair<std::string, gpu::Texture>> luts;  // by sampler
        float exposure_scale = 1;
    };
    struct Side {
        explicit Side(const gpu::TextureDesc& desc);
        gpu::Texture linear;  // as it came
        gpu::Texture shown;   // RGBA8, of the same size; first row: the picture's upper one
        gpu::Framebuffer target;
        bool encoded = false;
        bool developed = false;  // `shown` is `linear` through the view
    };
    void develop(Side& picture);
    /// Both pictures, developed, onto a framebuffer; `from`, `to`: its rows at the picture's upper and lower edge.
    void compose(GLuint framebuffer, int width, int from, int to, float split);

    gpu::ProgramCache programs_;
    std::string view_id_;  // GpuShader::cache_id of `view_`
    std::optional<View> view_;
    std::optional<Side> picture_;
    std::optional<Side> other_;
};

}  // namespace halflight::view
