// Page files: pages and table rows of a scene that is larger than memory. No OpenGL is used.
//
//   header   64 bytes: magic, version, places and checksums
//   blocks   table rows of kTrianglesPerBlock consecutive triangles each, and pages, in any order
//   index    PageIndex, and the sizes and places of blocks
//
// Blocks and index are Zstandard frames with checksums. Numbers are little-endian. The header is written last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/paging/page_codec.h"
#include "engine/paging/pages.h"

namespace halflight::paging {

inline constexpr std::uint32_t kPageFileVersion = 9;

/// Sizes of a page file.
struct PageFileSizes {
    std::uint64_t file = 0;    // bytes of the file
    std::uint64_t pages = 0;   // bytes of all pages
    std::uint64_t tables = 0;  // bytes of all table rows
    std::uint64_t index = 0;   // bytes of the index
};

/// Writes a page file in one pass.
class PageFileWriter {
  public:
    /// Opens an empty file, which write_unnamed() has made. Errors name `subject`.
    PageFileWriter(const std::filesystem::path& temporary, std::string subject);
    /// Appends the encoded block of the next kTrianglesPerBlock triangles; the last block may have fewer.
    void add_block(std::string_view encoded);
    /// Appends the next page. `size` is its size before encoding.
    void add_page(std::string_view encoded, const PageIndex::Size& size);
    /// Returns the number of pages so far.
    std::uint32_t pages() const { return static_cast<std::uint32_t>(page_sizes_.size()); }
    /// Writes index and header. PageIndex::pages are filled in. Throws the error of an earlier failure again.
    PageFileSizes finish(PageIndex index);

  private:
    struct Place {
        std::uint64_t offset;  // bytes from the start of the file
        std::uint64_t bytes;
    };
    Place append(std::string_view bytes);

    std::string subject_;
    CheckedFile file_;
    std::uint64_t end_;
    std::vector<Place> blocks_, pages_;
    std::vector<PageIndex::Size> page_sizes_;
};

/// Returns whether a file starts like a page file of any version. Throws Error if it cannot be read.
bool is_page_file(const std::filesystem::path& path);

/// Error of a file that is truncated, damaged, of another kind or of another version.
class DamagedPages : public Error {
  public:
    using Error::Error;
};

/// Fate of a file in which a page or a block turns out to be damaged.
enum class WhenDamaged { keep, remove };

/// A page file, opened for reading. It stays open, so another file may take its name. Damage is detected when the part
/// is read, and is a DamagedPages that names the file.
class PageFile final : public PageSource {
  public:
    /// Reads the index. `cache_bytes` is the limit of the cache of table rows. Throws DamagedPages, and Error for files
    /// that cannot be read.
    explicit PageFile(const std::filesystem::path& path, WhenDamaged when_damaged = WhenDamaged::keep,
                      std::size_t cache_bytes = kCacheBytes);
    PageFile(PageFile&&) noexcept;
    ~PageFile() override;
    static constexpr std::size_t kCacheBytes = std::size_t{32} << 20;

    const std::filesystem::path& path() const;
    std::string subject() const override;
    const PageIndex& index() const override;
    Page read(std::uint32_t page) const override;
    void read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const override;
    PageFileSizes sizes() const;
    /// Reads all pages and table rows, and throws DamagedPages if one is damaged. Calls `pulse` before each part,
    /// from several threads; it may throw to stop.
    void check(const std::function<void()>& pulse) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace halflight::paging
