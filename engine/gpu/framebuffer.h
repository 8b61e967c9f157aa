// Framebuffers whose textures are owned elsewhere.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/gpu/texture.h"

namespace halflight::gpu {

class Framebuffer {
  public:
    /// Attaches colors[i] as colour attachment i; null entries are skipped. All must have the same size. Throws Error
    /// if the framebuffer is incomplete.
    Framebuffer(std::string name, std::span<const Texture* const> colors, const Texture* depth = nullptr);

    GLuint id() const { return object_.id(); }
    int width() const { return width_; }
    int height() const { return height_; }
    /// Makes this the draw framebuffer, with its whole area as viewport.
    void bind() const;
    void clear_color(int attachment, float r, float g, float b, float a) const;
    void clear_color_uint(int attachment, std::uint32_t value) const;
    void clear_depth(float depth) const;

  private:
    Object<delete_framebuffer> object_;
    int width_ = 0;   // width, pixels
    int height_ = 0;  // height, pixels
};

}  // namespace halflight::gpu
