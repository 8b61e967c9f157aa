// A temporary file of texture tiles, for scenes whose textures do not fit into memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>

#include "engine/io/files.h"
#include "engine/scene/image_tiles.h"

namespace halflight {

/// Owns a file without a name, which ends with the last image that has tiles in it. Each tile is a Zstandard frame with
/// a checksum. Thread-safe.
class TextureStore : public std::enable_shared_from_this<TextureStore> {
  public:
    /// Creates the file in a folder. Throws Error where that fails.
    explicit TextureStore(const std::filesystem::path& folder);

    /// Moves the texels of an image and of its mip levels into the file. Throws Error that names the image where the file cannot be written,
    /// for example on a full disk.
    void take(TextureImage& image);
    std::uint64_t bytes() const;  ///< Returns the size of the file.

  private:
    class Tiles;
    std::filesystem::path folder_;
    ScratchFile file_;
    mutable std::mutex mutex_;  // held while the file grows
};

}  // namespace halflight
