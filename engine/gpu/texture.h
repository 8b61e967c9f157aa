// Textures without mip levels, and the formats in use.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/gpu/object.h"

namespace halflight::gpu {

struct TextureDesc {
    int width = 1;                  // width, texels, >= 1
    int height = 1;                 // height, texels, >= 1; 1 for 1D
    GLenum format = GL_RGBA32F;     // sized internal format that format_info() knows
    int depth = 1;                  // depth, texels, >= 1; 1 unless 3D
    GLenum target = GL_TEXTURE_2D;  // GL_TEXTURE_1D, GL_TEXTURE_2D or GL_TEXTURE_3D
    bool operator==(const TextureDesc&) const = default;
};

enum class TexelKind : std::uint8_t { color, integer, depth };

struct FormatInfo {
    GLenum format;    // pixel format: GL_RGBA, GL_RED_INTEGER, ...
    int channels;     // channels per texel, 1 to 4
    int texel_bytes;  // bytes per texel in device memory; drivers may pad formats of three channels
    TexelKind kind;   // kind of texels; color: float or normalised
};
/// Returns the properties of a format; throws Error for a format that is not in use. Needs no context.
FormatInfo format_info(GLenum internal_format);
/// Returns width x height x depth x bytes per texel. Needs no context.
std::size_t texture_bytes(const TextureDesc& desc);

/// A texture with nearest filter, clamped to the edge, unless set otherwise.
class Texture {
  public:
    /// Creates a texture of zeros. Throws Error if the size exceeds the driver's limits.
    Texture(std::string name, const TextureDesc& desc);

    GLuint id() const { return object_.id(); }
    const std::string& name() const { return name_; }
    const TextureDesc& desc() const { return desc_; }
    std::uint64_t serial() const { return serial_; }  ///< Returns a number unique in the process.

    void set_filter(GLenum filter);  ///< Sets GL_NEAREST or GL_LINEAR.
    void set_wrap(GLenum wrap_s, GLenum wrap_t, GLenum wrap_r = GL_CLAMP_TO_EDGE);

    /// Uploads the whole image, channels interleaved, first row first. The number of values must match the texture.
    void upload(std::span<const float> values);                      ///< Uploads color or depth.
    void upload(std::span<const std::uint8_t> values);               ///< Uploads color; 0 to 255 stand for 0 to 1.
    void upload(std::span<const std::uint32_t> values);              ///< Uploads integers.
    std::vector<float> read_float() const;                           ///< Reads color or depth, all channels.
    std::vector<std::uint32_t> read_uint() const;                    ///< Reads integers.
    void clear(float r = 0, float g = 0, float b = 0, float a = 0);  ///< Clears color or depth (r).
    void clear_uint(std::uint32_t value);                            ///< Clears all channels of integer formats.
    void zero();                                                     ///< Clears any format to zeros.

    void bind(GLuint unit) const;                       ///< Binds to a sampler's unit.
    void bind_image(GLuint unit, GLenum access) const;  ///< Takes GL_READ_ONLY, GL_WRITE_ONLY or GL_READ_WRITE.

  private:
    std::string name_;
    TextureDesc desc_;
    std::uint64_t serial_ = 0;
    Object<delete_texture> object_;
};

}  // namespace halflight::gpu
