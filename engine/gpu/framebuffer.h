// Framebuffers over textures that somebody else owns.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/gpu/texture.h"

namespace halflight::gpu {

class Framebuffer {
  public:
    /// Colour attachment i is colors[i]; a null one is left out. All of one size. Throws Error if it is not complete.
    Framebuffer(std::string name, std::span<const Texture* const> colors, const Texture* depth = nullptr);

    GLuint id() const { return object_.id(); }
    int width() const { return width_; }
    int height() const { return height_; }
    /// Draws go here from now on, the viewport is the whole.
    void bind() const;
    void clear_color(int attachment, float r, float g, float b, float a) const;
    void clear_color_uint(int attachment, std::uint32_t value) const;
    void clear_depth(float depth) const;

  private:
    Object<delete_framebuffer> object_;
    int width_ = 0;   // pixels
    int height_ = 0;  // pixels
};

}  // namespace halflight::gpu
