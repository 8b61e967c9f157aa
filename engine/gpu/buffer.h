// Buffers of the GPU and their views as texture buffers.
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

/// Fixed size, in device memory. Not const: its content; binding is const. A buffer of 0 bytes can be bound like any
/// other (16 zero bytes back it).
class Buffer {
  public:
    /// data: `bytes` bytes, or nullptr for zeros. Throws Error where the driver has not got the memory.
    Buffer(std::string name, std::size_t bytes, const void* data = nullptr);

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
    /// Content from `offset` on, after all commands so far. offset + bytes <= bytes().
    void read_bytes(std::size_t offset, std::size_t bytes, void* to) const;
    /// `count` elements from `first` on; by default all that fit.
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
    /// Every 32-bit word of the buffer becomes `word`.
    void fill(std::uint32_t word);

    void bind_storage(GLuint index) const;  ///< shader storage block
    void bind_uniform(GLuint index) const;  ///< uniform block
    /// As a texture buffer of a sized format ("samplerBuffer"): GL_RGBA32F, GL_R32UI, ...
    void bind_texture(GLuint unit, GLenum format) const;
    /// The texture behind bind_texture, made on first use and owned by the buffer. Throws Error where it has more
    /// texels than the driver can address.
    GLuint texture(GLenum format) const;

  private:
    std::string name_;
    std::size_t bytes_ = 0;
    Object<delete_buffer> object_;
    mutable std::vector<std::pair<GLenum, Object<delete_texture>>> views_;
};

/// Makes a buffer hold other values, at best by writing what lies between the first and the last that differ. last:
/// what it holds, or null where that is not known. A buffer of another size is made anew, under the same name.
template <class T>
void replace(Buffer& buffer, const std::vector<T>& values, const std::vector<T>* last = nullptr) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<const T> now(values);
    if (buffer.bytes() != now.size_bytes()) {
        buffer = Buffer::from(buffer.name(), now);
        return;
    }
    std::size_t first = 0, end = now.size();
    if (last && last->size() == now.size()) {  // bit by bit: some values are words in floats
        const auto same = [&](std::size_t i) { return std::memcmp(&now[i], &(*last)[i], sizeof(T)) == 0; };
        while (first < end && same(first)) ++first;
        while (first < end && same(end - 1)) --end;
    }
    if (first < end) buffer.write(now.subspan(first, end - first), first);
}

}  // namespace halflight::gpu
