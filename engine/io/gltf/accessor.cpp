#include "engine/io/gltf/accessor.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <functional>
#include <limits>
#include <type_traits>

namespace halflight {
namespace {

// Maximum count of an accessor without data, whose elements are all zero. Sparse accessors may lack data; any other
// accessor has at least one byte per element.
constexpr std::size_t kFewZeros = std::size_t{1} << 16;

std::string name(int accessor) {
    return fmt::format("accessors[{}]", accessor);
}

/// Returns the bytes of a component; 0 for unknown types.
std::size_t component_size(int type) {
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return 1;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return 2;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return 4;
        default:
            return 0;
    }
}

template <class T>
T load(const unsigned char* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

/// Converts a normalised integer (glTF 2.0, section 3.11).
template <class T>
float to_float(T value, bool normalized) {
    const auto x = static_cast<float>(value);
    if constexpr (std::is_floating_point_v<T>) {
        return x;
    } else {
        return normalized ? std::max(x / static_cast<float>(std::numeric_limits<T>::max()), -1.0f) : x;
    }
}

template <class T>
void load_floats(const unsigned char* from, int components, bool normalized, float* out) {
    for (int i = 0; i < components; ++i) out[i] = to_float(load<T>(from + sizeof(T) * i), normalized);
}

std::uint32_t load_unsigned(const unsigned char* from, int type) {
    if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return *from;
    if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return load<std::uint16_t>(from);
    return load<std::uint32_t>(from);
}

bool is_unsigned(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

/// Returns whether sparse values replace others.
bool replaces(const tinygltf::Accessor& accessor) {
    return accessor.sparse.isSparse && accessor.sparse.count > 0;
}

}  // namespace

std::set<int> views_of(const tinygltf::Model& model, int accessor) {
    const auto& a = model.accessors[static_cast<std::size_t>(accessor)];
    std::set<int> views{a.bufferView};
    if (replaces(a)) views.insert({a.sparse.indices.bufferView, a.sparse.values.bufferView});
    views.erase(kNone);
    return views;
}

const GltfDecodedAccessor* GltfAccessors::decoded(int accessor) const {
    if (!decoded_) return nullptr;
    const auto found = decoded_->find(accessor);
    return found == decoded_->end() ? nullptr : &found->second;
}

std::size_t GltfAccessors::count(int accessor) const {
    if (const GltfDecodedAccessor* elements = decoded(accessor)) return elements->count;
    return document_.model.accessors[static_cast<std::size_t>(accessor)].count;
}

int GltfAccessors::components(int accessor) const {
    const int type = document_.model.accessors[static_cast<std::size_t>(accessor)].type;
    return tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
}

std::size_t GltfAccessors::element_size(int accessor) const {
    const int type = document_.model.accessors[static_cast<std::size_t>(accessor)].componentType;
    const std::size_t size = component_size(type) * static_cast<std::size_t>(components(accessor));
    if (size == 0) document_.fail(name(accessor), "componentType {} is unknown", type);
    return size;
}

GltfAccessors::View GltfAccessors::packed(int buffer_view, std::uint64_t offset, std::uint64_t count,
                                          std::size_t element_size, const std::string& element) const {
    const std::uint64_t bytes = document_.view_size(buffer_view);
    const std::size_t given = document_.model.bufferViews[static_cast<std::size_t>(buffer_view)].byteStride;
    const std::size_t stride = given == 0 ? element_size : given;
    if (stride < element_size)
        document_.fail(element, "elements of {} bytes overlap, byteStride is {}", element_size, stride);
    // schema.h limits sizes to 2^53 and open_gltf() limits strides to 2^8, so nothing overflows.
    const std::uint64_t end = count == 0 ? offset : offset + (count - 1) * stride + element_size;
    if (end > bytes)
        document_.fail(element, "ends at byte {} of bufferViews[{}], which has {}", end, buffer_view, bytes);
    return {nullptr, buffer_view, offset, end - offset, element_size, stride};
}

GltfAccessors::View GltfAccessors::view(int accessor) const {
    const auto& a = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const std::size_t size = element_size(accessor);
    if (const GltfDecodedAccessor* elements = decoded(accessor))
        return {elements, kNone, 0, elements->bytes.size(), size, size};
    if (a.bufferView != kNone) return packed(a.bufferView, a.byteOffset, a.count, size, name(accessor));
    if (a.count > std::max<std::uint64_t>(kFewZeros, document_.bytes_of_files))
        document_.fail(name(accessor), "{} elements without a bufferView in a scene of {} bytes", a.count,
                       document_.bytes_of_files);
    return {};
}

template <class Read>
void GltfAccessors::for_each_in(const View& view, std::size_t first, std::size_t count, Read read) const {
    if (count == 0) return;
    const ByteSource all = view.decoded ? view.decoded->bytes : document_.view_bytes(view.buffer_view);
    const ByteSource source = all.part(view.offset, view.size);
    constexpr std::size_t kBlock = std::size_t{1} << 20;  // bytes that are in memory at once
    const std::size_t most = kBlock / view.stride;
    std::string buffer;
    for (std::size_t done = 0; done < count; done += most) {
        const std::size_t now = std::min(most, count - done);
        const std::string_view bytes =
            source.read((first + done) * view.stride, (now - 1) * view.stride + view.element_size, buffer);
        for (std::size_t i = 0; i < now; ++i)
            read(done + i, reinterpret_cast<const unsigned char*>(bytes.data()) + i * view.stride);
    }
}

template <class Read>
void GltfAccessors::for_each_element(int accessor, std::size_t first, std::size_t count, Read read) const {
    const auto& a = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const View base = view(accessor);
    if (base.stride > 0) for_each_in(base, first, count, read);
    if (!replaces(a) || base.decoded) return;

    const std::size_t size = component_size(a.componentType) * static_cast<std::size_t>(components(accessor));
    const auto replaced = static_cast<std::size_t>(a.sparse.count);
    const int index_type = a.sparse.indices.componentType;
    if (!is_unsigned(index_type))
        document_.fail(name(accessor), "sparse indices of componentType {} are not unsigned integers", index_type);
    const View indices = packed(a.sparse.indices.bufferView, static_cast<std::uint64_t>(a.sparse.indices.byteOffset),
                                replaced, component_size(index_type), name(accessor) + ".sparse.indices");
    const View values = packed(a.sparse.values.bufferView, static_cast<std::uint64_t>(a.sparse.values.byteOffset),
                               replaced, size, name(accessor) + ".sparse.values");
    std::vector<std::uint32_t> places;
    for_each_in(indices, 0, replaced, [&](std::size_t, const unsigned char* from) {
        places.push_back(load_unsigned(from, index_type));
        if (places.back() >= a.count)
            document_.fail(name(accessor), "sparse index {} of {} elements", places.back(), a.count);
    });
    if (std::ranges::adjacent_find(places, std::ranges::greater_equal()) != places.end()) {
        const std::scoped_lock lock(document_.decoded->mutex);
        document_.decoded->disordered.insert(accessor);
    }
    for_each_in(values, 0, replaced, [&](std::size_t i, const unsigned char* from) {
        if (places[i] >= first && places[i] - first < count) read(places[i] - first, from);
    });
}

std::size_t GltfAccessors::check_range(int accessor, std::size_t first, std::size_t count) const {
    check_data(accessor);  // refuses bad data before anything is allocated
    assert(first + count <= this->count(accessor));
    static_cast<void>(first);
    return count;
}

void GltfAccessors::check_type(int accessor, int expected, std::string_view purpose) const {
    if (components(accessor) != expected)
        document_.fail(name(accessor), "has {} components, {} needs {}", components(accessor), purpose, expected);
}

void GltfAccessors::read_floats(int accessor, std::size_t first, std::size_t count, bool normalize, float* out) const {
    const auto& a = document_.model.accessors[static_cast<std::size_t>(accessor)];
    const int n = components(accessor);
    const bool normalized = a.normalized || normalize;
    const auto read_as = [&]<class T>(T) {
        for_each_element(accessor, first, count, [&](std::size_t i, const unsigned char* from) {
            load_floats<T>(from, n, normalized, out + i * static_cast<std::size_t>(n));
        });
    };
    switch (a.componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return read_as(std::int8_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return read_as(std::uint8_t{});
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return read_as(std::int16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return read_as(std::uint16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return read_as(std::uint32_t{});
        default:
            return read_as(float{});
    }
}

std::vector<std::uint32_t> GltfAccessors::read_integers(int accessor, int expected, std::size_t first,
                                                        std::size_t count, std::string_view purpose) const {
    const auto& a = document_.model.accessors[static_cast<std::size_t>(accessor)];
    check_type(accessor, expected, purpose);
    if (!is_unsigned(a.componentType))
        document_.fail(name(accessor), "componentType {} is not an unsigned integer, {} needs one", a.componentType,
                       purpose);
    const std::size_t size = component_size(a.componentType);
    std::vector<std::uint32_t> values(check_range(accessor, first, count) * static_cast<std::size_t>(expected));
    for_each_element(accessor, first, count, [&](std::size_t i, const unsigned char* from) {
        for (int c = 0; c < expected; ++c)
            values[i * static_cast<std::size_t>(expected) + static_cast<std::size_t>(c)] =
                load_unsigned(from + size * static_cast<std::size_t>(c), a.componentType);
    });
    return values;
}

}  // namespace halflight
