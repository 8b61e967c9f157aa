#include "engine/io/gltf/meshopt.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/io/gltf/meshopt_codec.h"

namespace halflight {
namespace {

using Json = nlohmann::json;
using Mode = GltfMeshoptView::Mode;
using Filter = GltfMeshoptView::Filter;

constexpr const char* kModes[] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
constexpr const char* kFilters[] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"};

/// Returns the extension object of a buffer or buffer view, or null.
const Json* find_extension(const Json& object) {
    if (!object.contains("extensions")) return nullptr;
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        const auto found = object["extensions"].find(name);
        if (found != object["extensions"].end()) return &*found;
    }
    return nullptr;
}

template <class Value, std::size_t kCount>
Value find_name(const char* const (&names)[kCount], const std::string& name, const char* what,
                const std::string& subject) {
    const auto found = std::ranges::find(names, name);
    if (found == std::end(names)) throw Error(subject, "{} '{}' of its compressed data is unknown", what, name);
    return static_cast<Value>(found - std::begin(names));
}

/// Checks the rules of the extension's section "JSON schema updates", without which the library must not be called.
void check_layout(const GltfMeshoptView& view, std::uint64_t byte_length, const std::string& subject) {
    const bool attributes = view.mode == Mode::attributes;
    const bool fits_mode = attributes ? view.stride % 4 == 0 && view.stride > 0 && view.stride <= 256
                                      : view.stride == 2 || view.stride == 4;
    const bool fits_filter = view.filter == Filter::none || view.filter == Filter::exponential || view.stride == 8 ||
                             (view.stride == 4 && view.filter != Filter::quaternion);
    if (!fits_mode || !fits_filter || (view.filter != Filter::none && !attributes))
        throw Error(subject, "its compressed data cannot have mode {}, filter {} and byteStride {}",
                    kModes[static_cast<std::size_t>(view.mode)], kFilters[static_cast<std::size_t>(view.filter)],
                    view.stride);
    if (view.mode == Mode::triangles && view.count % 3 != 0)
        throw Error(subject, "its compressed data has {} indices of triangles, which is no multiple of 3", view.count);
    if (view.size() != byte_length)
        throw Error(subject, "byteLength is {}, but its compressed data has {} elements of {} bytes", byte_length,
                    view.count, view.stride);
}

}  // namespace

void GltfMeshoptView::check_length(unsigned char first_byte, const std::string& subject) const {
    // Attributes have at least two bits for 16 bytes (version 1: for 256), triangles and indices have a byte each, and
    // all have tails.
    const bool newer = first_byte == kMeshoptAttributes1;
    const std::uint64_t least = mode == Mode::attributes
                                    ? 1 + size() / (newer ? 1024 : 64) + std::max<std::size_t>(stride, newer ? 24 : 32)
                                : mode == Mode::triangles ? 1 + count / 3 + 16
                                                          : 1 + count + 4;
    if (length < least)
        throw Error(subject, "{} elements of {} bytes need at least {} bytes of compressed data, it has {}", count,
                    stride, least, length);
}

std::string GltfMeshoptView::decode(std::string_view compressed, const std::string& subject) const {
    const auto* const from = reinterpret_cast<const unsigned char*>(compressed.data());
    std::string bytes(size(), '\0');
    int failure = 0;
    switch (mode) {
        case Mode::attributes:
            failure = !compressed.empty() && from[0] == kMeshoptAttributes1
                          ? !decode_meshopt_attributes(bytes, stride, compressed)
                          : meshopt_decodeVertexBuffer(bytes.data(), count, stride, from, compressed.size());
            break;
        case Mode::triangles:
            failure = meshopt_decodeIndexBuffer(bytes.data(), count, stride, from, compressed.size());
            break;
        case Mode::indices:
            failure = meshopt_decodeIndexSequence(bytes.data(), count, stride, from, compressed.size());
            break;
    }
    if (failure != 0) throw Error(subject, "its compressed data is damaged");
    if (filter == Filter::octahedral) meshopt_decodeFilterOct(bytes.data(), count, stride);
    if (filter == Filter::quaternion) meshopt_decodeFilterQuat(bytes.data(), count, stride);
    if (filter == Filter::exponential) meshopt_decodeFilterExp(bytes.data(), count, stride);
    if (filter == Filter::color) decode_meshopt_colors(bytes, stride);
    return bytes;
}

std::optional<GltfMeshoptView> read_meshopt_view(const Json& view, const std::string& subject) {
    const Json* const from = find_extension(view);
    if (!from) return std::nullopt;
    GltfMeshoptView compressed;
    compressed.buffer = from->at("buffer");
    compressed.offset = from->value("byteOffset", std::uint64_t{0});
    compressed.length = from->at("byteLength");
    compressed.count = from->at("count");
    compressed.stride = from->at("byteStride");
    if (const auto stride = view.find("byteStride"); stride != view.end() && *stride != compressed.stride)
        throw Error(subject, "its byteStride {} is not that of its compressed data, {}", stride->dump(),
                    compressed.stride);
    compressed.mode = find_name<Mode>(kModes, from->at("mode"), "mode", subject);
    compressed.filter = find_name<Filter>(kFilters, from->value("filter", "NONE"), "filter", subject);
    check_layout(compressed, view.at("byteLength"), subject);
    return compressed;
}

bool is_meshopt_fallback(const Json& buffer) {
    const Json* const extension = find_extension(buffer);
    return extension && extension->value("fallback", false);
}

}  // namespace halflight
