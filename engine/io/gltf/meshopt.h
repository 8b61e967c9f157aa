// Buffer views compressed by meshoptimizer: EXT_meshopt_compression and KHR_meshopt_compression.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace halflight {

/// Compressed content of a buffer view. The functions throw Error about `subject`, the file and the view.
struct GltfMeshoptView {
    enum class Mode { attributes, triangles, indices };
    enum class Filter { none, octahedral, quaternion, exponential, color };
    int buffer = 0;            // index of the buffer with the compressed data
    std::uint64_t offset = 0;  // bytes from the start of that buffer
    std::uint64_t length = 0;  // bytes of compressed data
    std::uint64_t count = 0;   // elements
    std::size_t stride = 0;    // bytes per element, 2 to 256
    Mode mode = Mode::attributes;
    Filter filter = Filter::none;

    /// Returns the bytes after decompression.
    std::uint64_t size() const { return count * stride; }
    /// Throws Error if the compressed data are too short for the elements, whatever their values. The first byte of the
    /// data tells the version of the codec.
    void check_length(unsigned char first_byte, const std::string& subject) const;
    std::string decode(std::string_view compressed, const std::string& subject) const;
};

/// Reads the extension of a buffer view, which the schema has checked. Returns none if the view has none.
std::optional<GltfMeshoptView> read_meshopt_view(const nlohmann::json& view, const std::string& subject);

/// Returns whether the extension marks a buffer as fallback, which holds what compressed views contain.
bool is_meshopt_fallback(const nlohmann::json& buffer);

}  // namespace halflight
