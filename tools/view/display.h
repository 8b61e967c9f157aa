// The picture on the window's GL context: applies the view transform and draws into the window, alone or beside a
// comparison picture.
#pragma once

#include <map>
#include <optional>

#include "engine/color/color.h"
#include "engine/gpu/framebuffer.h"
#include "engine/gpu/program_cache.h"
#include "tools/view/layer_view.h"
#include "tools/view/window_layout.h"

namespace halflight::view {

/// Methods to show two pictures. flicker: one after the other, in turns.
enum class ComparisonMode { split, difference, flicker };

/// Owns the textures of the picture and of the comparison picture. Its context must be current during its lifetime.
class Display {
  public:
    Display() = default;

    void set_view(const ViewProcessor& view);
    /// Uploads a picture. Later changes of exposure and view need no further upload.
    void set_picture(const DisplayImage& seen);
    bool empty() const { return !picture_; }
    /// Keeps the current picture as comparison picture. Precondition: not empty().
    void keep_comparison();
    /// Takes a picture of a file as comparison picture.
    void set_comparison(const DisplayImage& seen);
    void close_comparison();
    /// Switches to the absolute difference of both pictures in place of the picture. Coarse pictures are compared with
    /// the nearest pixels. Linear pictures are subtracted before the view transform. Nothing changes unless
    /// can_subtract().
    void set_difference(bool on);
    /// Returns whether both pictures are there, and both are linear or both encoded.
    bool can_subtract() const { return picture_ && comparison_ && picture_->encoded == comparison_->encoded; }
    bool comparing() const { return comparison_.has_value(); }
    /// Rebuilds programs whose shaders have changed (HALFLIGHT_SHADERS). Throws what gpu::ProgramCache::reload()
    /// throws.
    void reload_shaders();

    /// Draws the picture into a rectangle of the window's framebuffer; everything else is black. A comparison picture
    /// is drawn to the right of `split`, a share of the width in [0, 1]. Both use the same view transform.
    void draw(const ivec2& framebuffer, const Rectangle& where, float split);
    /// Returns what draw() shows, at the resolution of the picture: RGB, display-encoded, 8 bits per channel.
    /// Precondition: not empty().
    Image read(float split);

  private:
    struct View {
        gpu::ShaderSource source;
        std::vector<std::pair<std::string, gpu::Texture>> luts;  // keyed by sampler
        float exposure_scale = 1;
    };
    struct Source {
        explicit Source(const gpu::TextureDesc& desc);
        gpu::Texture linear;  // picture as uploaded
        gpu::Texture shown;   // RGBA8, same size, top row first
        gpu::Framebuffer target;
        bool encoded = false;
        bool view_applied = false;  // `shown` is up to date with `linear` and the view transform
    };
    void apply_view(Source& picture);
    void upload(const DisplayImage& seen, std::optional<Source>& to);
    /// Applies the view and copies both pictures to a framebuffer. `left` and `right` are its columns at the edges,
    /// `top` and `bottom` its rows.
    void compose(GLuint framebuffer, int left, int right, int top, int bottom, float split);

    gpu::ProgramCache programs_;
    std::string view_id_;  // GpuShader::cache_id of `view_`
    std::optional<View> view_;
    std::optional<Source> picture_;
    std::optional<Source> comparison_;
    bool difference_ = false;
};

}  // namespace halflight::view
