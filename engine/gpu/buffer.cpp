#include "engine/gpu/buffer.h"

#include <epoxy/egl.h>

#include <algorithm>
#include <bit>
#include <mutex>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/gl_string.h"
#include "engine/gpu/mapping.h"
#include "engine/gpu/texture.h"

namespace halflight::gpu {
namespace {

constexpr std::size_t kRounding = 16;  // bytes: the largest texel and vector, and the size that backs an empty buffer

/// Returns the size of a buffer's storage. llvmpipe 22.3 describes texture buffers in the key of compiled code as if
/// they were images. The key holds whether the size is a power of two, and whether the last mip level is 0. The mip
/// level lies where a buffer has bits 8 to 15 of its view's size. With this padding, all sizes share one key.
std::size_t backing(std::size_t bytes) {
    std::size_t size = std::max(kRounding, (bytes + kRounding - 1) / kRounding * kRounding);
    while (std::has_single_bit(size) || (size & 0xff00u) == 0) size += 256 + kRounding;
    return size;
}

/// Returns the flags of a buffer's storage. Drivers that render on the processor can map it at no cost (mapping.h).
GLbitfield storage_flags() {
    return GL_DYNAMIC_STORAGE_BIT | (renders_on_processor() ? GL_MAP_READ_BIT | GL_MAP_WRITE_BIT : 0);
}

/// NVIDIA's driver 580.159 does not order a clear of a buffer before a later write of more than 64 KiB to it: the clear
/// has overwritten texels of such writes.
void wait_for_clear() {
    if (gl_string(GL_VENDOR).starts_with("NVIDIA")) glFinish();
}

void fill_range(GLuint id, std::size_t offset, std::size_t bytes, std::uint32_t word) {
    glClearNamedBufferSubData(id, GL_R32UI, static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes),
                              GL_RED_INTEGER, GL_UNSIGNED_INT, &word);
    wait_for_clear();
}

}  // namespace

Buffer::Buffer(std::string name, std::size_t bytes, const void* data)
    : name_(std::move(name)), bytes_(bytes), from_data_(data != nullptr) {
    GLuint id = 0;
    glCreateBuffers(1, &id);
    object_ = Object<delete_buffer>(id);
    label(GL_BUFFER, id, name_);
    const std::size_t size = backing(bytes);
    const bool whole = data != nullptr && size == bytes;
    glNamedBufferStorage(id, static_cast<GLsizeiptr>(size), whole ? data : nullptr, storage_flags());
    GLint64 got = 0;
    glGetNamedBufferParameteri64v(id, GL_BUFFER_SIZE, &got);
    if (static_cast<std::size_t>(got) != size) {
        check_not_lost("buffer '" + name_ + "'");
        glGetError();  // clears the GL error, which the exception reports
        throw Error("buffer '" + name_ + "'", "the driver has no {} bytes", size);
    }
    if (whole) return;
    const std::size_t kept = data == nullptr ? 0 : bytes / kRounding * kRounding;
    fill_range(id, kept, size - kept, 0);
    if (data != nullptr) write(0, bytes, data);
}

void Buffer::write(std::size_t offset, std::size_t bytes, const void* data) {
    assert(offset + bytes <= bytes_);
    if (bytes == 0) return;
    glNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), data);
}

void Buffer::read_bytes(std::size_t offset, std::size_t bytes, void* to) const {
    assert(offset + bytes <= bytes_);
    if (bytes == 0) return;
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(id(), static_cast<GLintptr>(offset), static_cast<GLsizeiptr>(bytes), to);
    check_not_lost("buffer '" + name_ + "'");  // a lost context reads anything
}

void Buffer::fill(std::uint32_t word) {
    fill_range(id(), 0, backing(bytes_), word);
}

void Buffer::bind_storage(GLuint index) const {
    // Binds the range, not the base, so that .length() of a runtime array gives the requested size.
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, index, id(), 0,
                      static_cast<GLsizeiptr>(bytes_ == 0 ? kRounding : bytes_));
}

void Buffer::bind_uniform(GLuint index) const {
    glBindBufferBase(GL_UNIFORM_BUFFER, index, id());
}

GLuint Buffer::texture(GLenum format) const {
    // Programs that are compiled ahead get their textures on another thread (program_cache.h). Mesa 22.3 counts the
    // references to a buffer texture without a lock, and may lose one if another context uses the texture for the
    // first time. It then frees memory that is in use.
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    void* const context = eglGetCurrentContext();
    const auto known =
        std::ranges::find_if(views_, [&](const View& v) { return v.format == format && v.context == context; });
    if (known != views_.end()) return known->texture.id();
    // Drivers silently clip texture buffers at the limit.
    const std::size_t texels = bytes_ / static_cast<std::size_t>(format_info(format).texel_bytes);
    GLint limit = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
    if (texels > static_cast<std::size_t>(limit)) {
        throw Error("buffer '" + name_ + "'", "{} texels; the driver's texture buffers end at {}", texels, limit);
    }
    GLuint view = 0;
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &view);
    views_.push_back({format, context, Object<delete_texture>(view)});
    label(GL_TEXTURE, view, name_);
    if (from_data_ || bytes_ == 0) {  // the view has the exact size, for textureSize()
        glTextureBufferRange(view, format, id(), 0, static_cast<GLsizeiptr>(bytes_ == 0 ? kRounding : bytes_));
    } else {
        glTextureBuffer(view, format, id());
    }
    return view;
}

void Buffer::bind_texture(GLuint unit, GLenum format) const {
    glBindTextureUnit(unit, texture(format));
}

}  // namespace halflight::gpu
