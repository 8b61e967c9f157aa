// Accessors (glTF 2.0, section 3.6.2): typed elements in buffers, validated before they are read.
#pragma once

#include <cstdint>
#include <set>
#include <string_view>
#include <vector>

#include "engine/io/gltf/document.h"

namespace halflight {

/// Elements that replace those of an accessor: packed, and of the accessor's type.
struct GltfDecodedAccessor {
    ByteSource bytes;
    std::size_t count = 0;
    MemoryLedger::Entry memory;
};
using GltfDecodedAccessors = std::map<int, GltfDecodedAccessor>;  // by index of the accessor

/// Returns the buffer views of an accessor and of its sparse elements.
std::set<int> views_of(const tinygltf::Model& model, int accessor);

class GltfAccessors {
  public:
    /// Both arguments must outlive the object; `decoded` may be null.
    explicit GltfAccessors(const GltfDocument& document, const GltfDecodedAccessors* decoded = nullptr)
        : document_(document), decoded_(decoded) {}

    std::size_t count(int accessor) const;
    int components(int accessor) const;  ///< Returns the number of components per element, 1 to 16.
    /// Returns the bytes of an element without padding. Throws Error for an unknown type.
    std::size_t element_size(int accessor) const;
    /// Throws Error that names `purpose` for elements of another number of components.
    void check_type(int accessor, int components, std::string_view purpose) const;
    /// Throws Error if the data is shorter than the count requires.
    void check_data(int accessor) const { view(accessor); }

    /// Reads elements [first, first + count) as V: float, vec2, vec3, vec4 or mat4. Integers are converted, or mapped
    /// to [0, 1] or [-1, 1] if the accessor is normalized or `normalize` is set. Throws Error that names `purpose` for
    /// elements of another type, damaged data, and ranges out of bounds.
    template <class V>
    std::vector<V> read(int accessor, std::size_t first, std::size_t count, std::string_view purpose,
                        bool normalize = false) const {
        constexpr int kComponents = sizeof(V) / sizeof(float);
        check_type(accessor, kComponents, purpose);
        std::vector<V> values(check_range(accessor, first, count));
        read_floats(accessor, first, count, normalize, reinterpret_cast<float*>(values.data()));
        return values;
    }
    template <class V>
    std::vector<V> read(int accessor, std::string_view purpose) const {
        return read<V>(accessor, 0, count(accessor), purpose);
    }

    /// Reads unsigned integers, `components` per element.
    std::vector<std::uint32_t> read_integers(int accessor, int components, std::size_t first, std::size_t count,
                                             std::string_view purpose) const;

  private:
    /// Elements, `stride` bytes apart, in a buffer view or in `decoded`.
    struct View {
        const GltfDecodedAccessor* decoded = nullptr;
        int buffer_view = kNone;
        std::uint64_t offset = 0;  // bytes from the start of the view
        std::uint64_t size = 0;    // bytes
        std::size_t element_size = 0;
        std::size_t stride = 0;  // 0: all elements are zero
    };
    const GltfDecodedAccessor* decoded(int accessor) const;
    template <class Read>
    void for_each_in(const View& view, std::size_t first, std::size_t count, Read read) const;
    template <class Read>
    void for_each_element(int accessor, std::size_t first, std::size_t count, Read read) const;
    View view(int accessor) const;
    View packed(int buffer_view, std::uint64_t offset, std::uint64_t count, std::size_t element_size,
                const std::string& element) const;
    std::size_t check_range(int accessor, std::size_t first, std::size_t count) const;
    void read_floats(int accessor, std::size_t first, std::size_t count, bool normalize, float* out) const;

    const GltfDocument& document_;
    const GltfDecodedAccessors* decoded_;
};

}  // namespace halflight
