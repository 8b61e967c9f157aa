#include "engine/gpu/texture.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <mutex>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/context.h"

namespace halflight::gpu {
namespace {

std::size_t texel_count(const TextureDesc& desc) {
    return static_cast<std::size_t>(desc.width) * static_cast<std::size_t>(desc.height) *
           static_cast<std::size_t>(desc.depth);
}

void check_size(const std::string& name, const TextureDesc& desc) {
    GLint largest = 0;
    glGetIntegerv(desc.target == GL_TEXTURE_3D ? GL_MAX_3D_TEXTURE_SIZE : GL_MAX_TEXTURE_SIZE, &largest);
    const bool flat = desc.target == GL_TEXTURE_3D || desc.depth == 1;
    const bool line = desc.target != GL_TEXTURE_1D || desc.height == 1;
    const auto [low, high] = std::minmax({desc.width, desc.height, desc.depth});
    if (low < 1 || high > largest || !flat || !line) {
        throw Error("texture '" + name + "'", "{} x {} x {} texels: the driver takes 1 to {} along an edge", desc.width,
                    desc.height, desc.depth, largest);
    }
}

[[maybe_unused]] bool holds(const TextureDesc& desc, std::size_t values) {
    return values == texel_count(desc) * static_cast<std::size_t>(format_info(desc.format).channels);
}

void upload_image(const Texture& texture, GLenum type, const void* data) {
    const TextureDesc& d = texture.desc();
    const GLenum format = format_info(d.format).format;
    if (d.target == GL_TEXTURE_1D) {
        glTextureSubImage1D(texture.id(), 0, 0, d.width, format, type, data);
    } else if (d.target == GL_TEXTURE_2D) {
        glTextureSubImage2D(texture.id(), 0, 0, 0, d.width, d.height, format, type, data);
    } else {
        glTextureSubImage3D(texture.id(), 0, 0, 0, 0, d.width, d.height, d.depth, format, type, data);
    }
}

/// Reads all texels, rows by rows: OpenGL counts the bytes of a call as GLsizei, which large pictures exceed.
template <class T>
std::vector<T> read_image(const Texture& texture, GLenum type) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 24;  // limit of a call
    const FormatInfo info = format_info(texture.desc().format);
    std::vector<T> values(texel_count(texture.desc()) * static_cast<std::size_t>(info.channels));
    glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT);
    const TextureDesc& d = texture.desc();
    const std::size_t slice = values.size() / static_cast<std::size_t>(d.depth),
                      row = slice / static_cast<std::size_t>(d.height);
    const auto rows =
        static_cast<int>(std::clamp<std::size_t>(kMostBytes / (row * sizeof(T)), 1, std::size_t(d.height)));
    for (int z = 0; z < d.depth; ++z) {
        for (int y = 0; y < d.height; y += rows) {
            const int count = std::min(rows, d.height - y);
            glGetTextureSubImage(texture.id(), 0, 0, y, z, d.width, count, 1, info.format, type,
                                 static_cast<GLsizei>(static_cast<std::size_t>(count) * row * sizeof(T)),
                                 &values[static_cast<std::size_t>(z) * slice + static_cast<std::size_t>(y) * row]);
        }
    }
    check_not_lost("texture '" + texture.name() + "'");  // a lost context reads anything
    return values;
}

}  // namespace

FormatInfo format_info(GLenum internal_format) {
    switch (internal_format) {
        case GL_R8:
            return {GL_RED, 1, 1, TexelKind::color};
        case GL_RG8:
            return {GL_RG, 2, 2, TexelKind::color};
        case GL_RGBA8:
        case GL_SRGB8_ALPHA8:
            return {GL_RGBA, 4, 4, TexelKind::color};
        case GL_R16F:
            return {GL_RED, 1, 2, TexelKind::color};
        case GL_RG16F:
            return {GL_RG, 2, 4, TexelKind::color};
        case GL_RGBA16F:
            return {GL_RGBA, 4, 8, TexelKind::color};
        case GL_R32F:
            return {GL_RED, 1, 4, TexelKind::color};
        case GL_RG32F:
            return {GL_RG, 2, 8, TexelKind::color};
        case GL_RGB32F:
            return {GL_RGB, 3, 12, TexelKind::color};
        case GL_RGBA32F:
            return {GL_RGBA, 4, 16, TexelKind::color};
        case GL_R16UI:
            return {GL_RED_INTEGER, 1, 2, TexelKind::integer};
        case GL_R32UI:
            return {GL_RED_INTEGER, 1, 4, TexelKind::integer};
        case GL_RG32UI:
            return {GL_RG_INTEGER, 2, 8, TexelKind::integer};
        case GL_RGBA32UI:
            return {GL_RGBA_INTEGER, 4, 16, TexelKind::integer};
        case GL_DEPTH_COMPONENT32F:
            return {GL_DEPTH_COMPONENT, 1, 4, TexelKind::depth};
        default:
            throw Error("texture format", "{:#06x} is not one of those in use", internal_format);
    }
}

std::size_t texture_bytes(const TextureDesc& desc) {
    return texel_count(desc) * static_cast<std::size_t>(format_info(desc.format).texel_bytes);
}

Texture::Texture(std::string name, const TextureDesc& desc) : name_(std::move(name)), desc_(desc) {
    static std::atomic<std::uint64_t> next_serial = 1;
    serial_ = next_serial++;
    check_size(name_, desc);
    GLuint id = 0;
    glCreateTextures(desc.target, 1, &id);
    object_ = Object<delete_texture>(id);
    label(GL_TEXTURE, id, name_);
    if (desc.target == GL_TEXTURE_1D) {
        glTextureStorage1D(id, 1, desc.format, desc.width);
    } else if (desc.target == GL_TEXTURE_2D) {
        glTextureStorage2D(id, 1, desc.format, desc.width, desc.height);
    } else {
        glTextureStorage3D(id, 1, desc.format, desc.width, desc.height, desc.depth);
    }
    GLint width = 0;
    glGetTextureLevelParameteriv(id, 0, GL_TEXTURE_WIDTH, &width);
    if (width != desc.width) {
        check_not_lost("texture '" + name_ + "'");
        glGetError();  // clears the GL error, which the exception reports
        throw Error("texture '" + name_ + "'", "the driver has no {} bytes", texture_bytes(desc));
    }
    set_filter(GL_NEAREST);
    set_wrap(GL_CLAMP_TO_EDGE, GL_CLAMP_TO_EDGE);
    zero();
}

void Texture::set_filter(GLenum filter) {
    glTextureParameteri(id(), GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
    glTextureParameteri(id(), GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
}

void Texture::set_wrap(GLenum wrap_s, GLenum wrap_t, GLenum wrap_r) {
    glTextureParameteri(id(), GL_TEXTURE_WRAP_S, static_cast<GLint>(wrap_s));
    glTextureParameteri(id(), GL_TEXTURE_WRAP_T, static_cast<GLint>(wrap_t));
    glTextureParameteri(id(), GL_TEXTURE_WRAP_R, static_cast<GLint>(wrap_r));
}

void Texture::upload(std::span<const float> values) {
    assert(holds(desc_, values.size()) && format_info(desc_.format).kind != TexelKind::integer);
    upload_image(*this, GL_FLOAT, values.data());
}

void Texture::upload(std::span<const std::uint8_t> values) {
    assert(holds(desc_, values.size()) && format_info(desc_.format).kind == TexelKind::color);
    upload_image(*this, GL_UNSIGNED_BYTE, values.data());
}

void Texture::upload(std::span<const std::uint32_t> values) {
    assert(holds(desc_, values.size()) && format_info(desc_.format).kind == TexelKind::integer);
    upload_image(*this, GL_UNSIGNED_INT, values.data());
}

std::vector<float> Texture::read_float() const {
    assert(format_info(desc_.format).kind != TexelKind::integer);
    return read_image<float>(*this, GL_FLOAT);
}

std::vector<std::uint32_t> Texture::read_uint() const {
    assert(format_info(desc_.format).kind == TexelKind::integer);
    return read_image<std::uint32_t>(*this, GL_UNSIGNED_INT);
}

void Texture::clear(float r, float g, float b, float a) {
    const FormatInfo info = format_info(desc_.format);
    assert(info.kind != TexelKind::integer);
    const std::array value{r, g, b, a};
    if (info.kind == TexelKind::depth) {
        // At its first call in a process, Mesa 22.3 fills a table of functions without a lock, though all contexts use it.
        static std::mutex filling;
        const std::lock_guard lock(filling);
        glClearTexImage(id(), 0, GL_DEPTH_COMPONENT, GL_FLOAT, value.data());
    } else {
        glClearTexImage(id(), 0, GL_RGBA, GL_FLOAT, value.data());
    }
}

void Texture::clear_uint(std::uint32_t value) {
    assert(format_info(desc_.format).kind == TexelKind::integer);
    const std::array values{value, value, value, value};
    glClearTexImage(id(), 0, GL_RGBA_INTEGER, GL_UNSIGNED_INT, values.data());
}

void Texture::zero() {
    if (format_info(desc_.format).kind == TexelKind::integer) {
        clear_uint(0);
    } else {
        clear();
    }
}

void Texture::bind(GLuint unit) const {
    glBindTextureUnit(unit, id());
}

void Texture::bind_image(GLuint unit, GLenum access) const {
    glBindImageTexture(unit, id(), 0, desc_.target == GL_TEXTURE_3D, 0, access, desc_.format);
}

}  // namespace halflight::gpu
