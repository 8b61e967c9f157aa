// GPU buffers, and their views as texture buffers.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/gpu/object.h"

namespace halflight::gpu {

/// A device buffer of fixed size. Changing its contents needs a non-const object; binding does not. A buffer of 0 bytes
/// can be bound like any other one; it is backed by 16 zero bytes.
class Buffer {
  public:
    /// Creates a buffer from the `bytes` bytes at `data`; zeros if `data` is null. Throws Error if memory runs out.
    Buffer(std::string name, std::size_t bytes, const void* data = nullptr);
    struct Unmade {};
    /// Describes a buffer without making it, for graphs that are compiled and never run. Needs no context.
    Buffer(std::string name, std::size_t bytes, Unmade) : name_(std::move(name)), bytes_(bytes) {}

    template <class T>
    static Buffer from(std::string name, std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        return Buffer(std::move(name), values.size_bytes(), values.data());
    }
    template <class T>
    static Buffer from(std::string name, const std::vector<T>& values) {
        return from(std::move(name), std::span<const T>(values));
    }

    GLuint id() const { return object_.id(); }
    std::size_t bytes() const { return bytes_; }
    const std::string& name() const { return name_; }

    void write(std::size_t offset, std::size_t bytes, const void* data);
    template <class T>
    void write(std::span<const T> values, std::size_t first = 0) {
        write(first * sizeof(T), values.size_bytes(), values.data());
    }
    /// Reads bytes from `offset` on, after all earlier commands. Throws ContextLost. Precondition: the buffer has them.
    void read_bytes(std::size_t offset, std::size_t bytes, void* to) const;
    /// Returns `count` elements from `first` on; by default all that fit.
    template <class T>
    std::vector<T> read(std::size_t first = 0, std::size_t count = ~std::size_t{0}) const {
        static_assert(std::is_trivially_copyable_v<T>);
        const std::size_t whole = bytes_ / sizeof(T);
        assert(first <= whole && (count == ~std::size_t{0} || count <= whole - first));
        std::vector<T> values(std::min(count, whole - first));
        read_bytes(first * sizeof(T), values.size() * sizeof(T), values.data());
        return values;
    }
    void clear() { fill(0); }
    /// Sets every 32-bit word of the buffer to `word`.
    void fill(std::uint32_t word);

    void bind_storage(GLuint index) const;  ///< Binds a shader storage block.
    void bind_uniform(GLuint index) const;  ///< Binds a uniform block.
    /// Binds a view as a texture buffer ("samplerBuffer") with a sized format: GL_RGBA32F, GL_R32UI, ...
    void bind_texture(GLuint unit, GLenum format) const;
    /// Returns the texture of bind_texture(), which is created on first use and owned by the buffer. Each context that
    /// shares the buffer has a texture of its own (ProgramCache::compile_ahead()). Throws Error if
    /// it has more texels than the driver can address. textureSize() is exact for buffers created from data or empty.
    /// Views of other buffers have some more texels, which are zero.
    GLuint texture(GLenum format) const;

  private:
    std::string name_;
    std::size_t bytes_ = 0;
    bool from_data_ = false;  // created from data; views then have its exact size
    Object<delete_buffer> object_;
    struct View {
        GLenum format;
        void* context;  // EGLContext
        Object<delete_texture> texture;
    };
    mutable std::vector<View> views_;
};

/// Replaces the contents of a buffer. If `last` holds the current contents, writes only the range from the first to the
/// last different value. A buffer of another size is created anew, with the same name.
template <class T>
void replace(Buffer& buffer, std::span<const T> now, const std::vector<T>* last = nullptr) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (buffer.bytes() != now.size_bytes()) {
        buffer = Buffer::from(buffer.name(), now);
        return;
    }
    std::size_t first = 0, end = now.size();
    if (last && last->size() == now.size()) {  // bits are compared, because some floats hold words
        const auto same = [&](std::size_t i) { return std::memcmp(&now[i], &(*last)[i], sizeof(T)) == 0; };
        while (first < end && same(first)) ++first;
        while (first < end && same(end - 1)) --end;
    }
    if (first < end) buffer.write(now.subspan(first, end - first), first);
}
template <class T>
void replace(Buffer& buffer, const std::vector<T>& values, const std::vector<T>* last = nullptr) {
    replace(buffer, std::span<const T>(values), last);
}

}  // namespace halflight::gpu
