// Files of texture tiles, for scenes whose textures do not fit into memory.
//
// Tiles are in a temporary file without a name, or in a cache with a file for each image. The cache has a file's tiles
// at the next start, too. A file of the cache is complete or does not exist:
//
//   tiles    Zstandard frames with checksums, of level 0, the levels as colour and the levels as data
//   index    Zstandard frame: key, sizes of the levels, places and sizes of their tiles
//   footer   magic, place and size of the index
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string_view>

#include "engine/io/files.h"
#include "engine/scene/image_tiles.h"
#include "engine/scene/texture_levels.h"

namespace halflight {

/// Owns the temporary file, which ends with the last image that has tiles in it. Thread-safe.
class TextureStore : public std::enable_shared_from_this<TextureStore> {
  public:
    /// Creates the temporary file in a folder. Throws Error if that fails. cache: folder of the cache, which is
    /// created; empty: none. A cache that cannot be used is ignored.
    explicit TextureStore(const std::filesystem::path& folder, std::filesystem::path cache = {});

    /// Returns the key of an encoded image whose levels are for these uses.
    static std::uint64_t key(std::string_view encoded, const LevelUses& uses);
    /// Takes size, tiles and levels of an image from the cache. Returns false if the cache lacks them, or if its
    /// file is not intact.
    bool find(std::uint64_t key, TextureImage& image);
    /// Moves the texels of an image and of its mip levels into the cache, under `key` if it is not 0, else into the
    /// temporary file. Throws Error that names the folder if that cannot be written, for example on a full disk.
    void take(TextureImage& image, std::uint64_t key = 0);
    /// Deletes files of the cache that were used least recently (trim_cache()).
    void trim() const;
    std::uint64_t bytes() const;  ///< Returns the size of the temporary file.

  private:
    class Tiles;
    struct Source;
    struct Scratch;
    struct Cached;
    std::filesystem::path file_of(std::uint64_t key) const;
    bool add_to_cache(const TextureImage& image, std::uint64_t key) const;

    std::filesystem::path cache_;
    std::shared_ptr<Scratch> scratch_;
    std::atomic<int> open_{0};  // files of the cache that this store has opened
};

}  // namespace halflight
