// A hall with any number of textures of any size, for textures that do not fit into memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "engine/core/math.h"

namespace halflight::scenes {

struct HallOptions {
    int textures = 200;       // number of textures, >= 1: a colour, a normal and a roughness map for each material
    int texture_size = 4096;  // texels along an edge, >= 1
};

/// Materials of the hall; each texture set has a seed of its own.
enum class HallSurface : std::uint8_t { marble, brick, limestone, wood, painting };
/// Maps of a texture set.
enum class HallMap : std::uint8_t { color, normal, roughness };

/// Returns the bytes of a JPEG, in which the texels of `size` x `size` are made row by row. The maps tile.
std::string hall_texture(HallSurface surface, HallMap map, std::uint32_t seed, int size);

/// Writes `path` and its textures, one after the other, into the folder `path` without its extension. Returns the
/// number of triangles.
std::uint64_t write_hall(const std::filesystem::path& path, const HallOptions& options);

}  // namespace halflight::scenes
