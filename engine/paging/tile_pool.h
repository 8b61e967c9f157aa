// The tiles of textures that are in device memory, for scenes whose textures are not in memory.
//
// A kernel looks texels up through a table that has the slot of each tile. Invocations that miss a tile request it,
// store nothing and run again once the tile is there. Each texel has the bits that it has in memory. So results equal
// those of textures in memory, whatever is resident.
//
// If the tiles of a batch do not fit into the pool together, the invocations are sorted by the tiles that they miss.
// They run in portions, down to single invocations if need be. So every batch ends, and tiles are loaded about once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "engine/core/memory_ledger.h"
#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"
#include "engine/paging/page_statistics.h"
#include "engine/tables/shading_tables.h"

namespace halflight::paging {

/// Slots for tiles, and the table of their places. Tiles leave in the order in which they came, except for tiles of
/// pinned textures, which all stay. Any kernel can look these up; other textures need shade().
class TilePool {
  public:
    /// Bytes of a slot, which holds a tile of colour or of data.
    static constexpr std::size_t kSlotBytes = std::size_t{1} << 13;

    /// Uses `bytes` bytes of device memory for slots, or fewer if all tiles fit into them. At least one invocation
    /// gets its tiles beside those of pinned textures; Error if the memory budget has no room for so many.
    /// bank_shift: logarithm of the texels that a texture buffer has at most (SceneBuffers).
    TilePool(std::vector<TiledTexture> textures, std::size_t bytes, unsigned bank_shift);

    /// Adds the macros of kernels that look tiles up.
    void define(gpu::Defines& defines) const;
    void bind() const;  ///< Binds pool and table (shaders/shared/texture_units.h).

    /// Runs a kernel until no invocation misses a tile. `all` dispatches it for its whole batch of at most `most`
    /// invocations. The kernel has HALFLIGHT_TILE_REQUESTS as in shaders/resolve.comp, and its other resources are
    /// bound. Throws Error if tiles cannot be read.
    void shade(const gpu::Program& kernel, std::size_t most, const std::function<void()>& all);
    /// Returns the bytes that a batch of `invocations` takes on CPU and device.
    static std::size_t bytes_of_batch(std::size_t invocations) { return invocations * 5 * sizeof(std::uint32_t); }

    std::size_t bytes() const;  ///< Returns the size in device memory, bytes.
    const TileStatistics& statistics() const { return statistics_; }
    void reset_statistics();

  private:
    /// An invocation that misses a tile.
    struct Waiting {
        std::uint32_t invocation = 0;
        std::uint32_t tile = 0;  // lowest tile that is missing
    };
    void load(std::span<const std::uint32_t> tiles);
    void load_pinned();
    void write_changes();
    std::uint32_t free_slot();
    void upload(std::uint32_t slot, std::span<const std::uint8_t> texels);
    const TiledTexture& texture_of(std::uint32_t tile) const;
    /// Reads a tile in the layout of the pool. Returns the bytes that were read from the file.
    std::size_t read(std::uint32_t tile, std::span<std::uint8_t> texels) const;
    std::vector<Waiting> run(const gpu::Program& kernel, std::span<const Waiting> again,
                             const std::function<void()>& all);

    std::vector<TiledTexture> textures_;
    unsigned bank_shift_;  // logarithm of the data texels of a bank
    MemoryLedger::Entry memory_;
    std::vector<gpu::Buffer> banks_;
    gpu::Buffer table_;
    std::vector<std::uint32_t> slot_of_tile_;  // contents of `table_`
    std::vector<std::uint32_t> changed_;       // tiles whose slots `table_` does not have yet
    std::vector<std::uint32_t> free_;          // free slots
    std::deque<std::uint32_t> queue_;          // resident tiles that may leave, oldest first
    std::size_t lasting_ = 0;                  // slots for tiles that may leave
    std::vector<std::uint32_t> requested_;     // tiles that the last run requested
    gpu::Buffer requests_, bits_, waiting_, again_;
    TileStatistics statistics_;
};

}  // namespace halflight::paging
