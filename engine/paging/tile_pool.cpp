#include "engine/paging/tile_pool.h"

#include <epoxy/gl.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cstring>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/scene/image_tiles.h"
#include "engine/scene/material_properties.h"
#include "engine/tables/shading_textures.h"
#include "shaders/shared/texture_rows.h"
#include "shaders/shared/texture_units.h"

namespace halflight::paging {
namespace {

constexpr unsigned kDataSlotShift = shared::kTileRowShift + shared::kDataTileShift;  // data texels of a slot
constexpr unsigned kColorSlotShift = shared::kTileRowShift + shared::kColorTileShift;
static_assert(TilePool::kSlotBytes == std::size_t{4} << kDataSlotShift);
static_assert(TilePool::kSlotBytes == std::size_t{8} << kColorSlotShift);
static_assert(ImageTiles::kSide == 1 << shared::kTileRowShift && ImageTiles::kSide == 1 << shared::kColorTileShift &&
              2 * ImageTiles::kSide == 1 << shared::kDataTileShift);

constexpr std::size_t kPortion = 1024;  // tiles that are read before they are uploaded
constexpr std::size_t kHeader = 2;      // words before the list of requests

std::size_t tiles_of(const TiledTexture& texture) {
    return static_cast<std::size_t>(texture.tile_count().x) * static_cast<std::size_t>(texture.tile_count().y);
}

/// Creates a buffer of at least `bytes` bytes if there is a smaller one.
void reserve(gpu::Buffer& buffer, std::size_t bytes) {
    if (buffer.bytes() < bytes) buffer = gpu::Buffer(buffer.name(), bytes);
}

}  // namespace

TilePool::TilePool(std::vector<TiledTexture> textures, std::size_t bytes, unsigned bank_shift)
    : textures_(std::move(textures)),
      bank_shift_(bank_shift),
      table_("slots of tiles", 0),
      requests_("requested tiles", 0),
      bits_("bits of requested tiles", 0),
      waiting_("hits that wait for tiles", 0),
      again_("hits that are shaded again", 0) {
    std::size_t tiles = 0, pinned = 0;
    for (const TiledTexture& texture : textures_) {
        assert(texture.first_tile == tiles);
        tiles += tiles_of(texture);
        if (texture.pinned) pinned += tiles_of(texture);
    }
    // An invocation looks up each kind of texture once, at up to four tiles.
    const std::size_t least = std::min(tiles, pinned + 4 * material_textures().size());
    if (bank_shift_ < kDataSlotShift) throw Error("textures", "the driver's texture buffers have no room for a tile");
    const std::size_t in_bank = std::size_t{1} << (bank_shift_ - kDataSlotShift);
    const std::size_t most = shared::kMostBanks * in_bank - 1;  // without the blank slot
    if (least > most) {
        throw Error("textures", "need {} tiles at a time; {} texture buffers of the driver end at {}", least,
                    shared::kMostBanks, most);
    }
    const std::size_t slots = std::clamp(bytes / kSlotBytes, least, std::min(tiles, most));
    const std::size_t tables = tiles * 4 * sizeof(std::uint32_t);
    MemoryLedger::process().check(slots * kSlotBytes + tables, "textures",
                                  fmt::format("pool of tiles {}, of which tests of alpha and lights need {}",
                                              text_of_bytes(slots * kSlotBytes), text_of_bytes(pinned * kSlotBytes)));
    memory_ = {MemoryLedger::process(), MemoryPart::textures, slots * kSlotBytes + tables};

    for (std::size_t first = 0; first <= slots; first += in_bank)
        banks_.emplace_back("texture tiles", std::min(in_bank, slots + 1 - first) * kSlotBytes);
    constexpr std::uint16_t kOne = 0x3c00;  // a half float
    static_assert(shared::kBlankSlot == 0);
    banks_[0].write(std::span<const std::uint16_t>(std::vector<std::uint16_t>(kSlotBytes / sizeof kOne, kOne)));
    for (std::size_t slot = slots; slot > 0; --slot) free_.push_back(static_cast<std::uint32_t>(slot));
    slot_of_tile_.assign(tiles, shared::kBlankSlot);
    table_ = gpu::Buffer::from(table_.name(), slot_of_tile_);
    reserve(requests_, (kHeader + tiles) * sizeof(std::uint32_t));
    reserve(bits_, (tiles + 31) / 32 * sizeof(std::uint32_t));
    bits_.clear();
    lasting_ = slots - pinned;
    statistics_.tiles = tiles;
    statistics_.slots = slots;
    load_pinned();
}

void TilePool::define(gpu::Defines& defines) const {
    defines.set("HALFLIGHT_TILED_TEXTURES");
    defines.set("HALFLIGHT_COLOR_BANK_SHIFT", std::to_string(bank_shift_ - 1));
    defines.set("HALFLIGHT_DATA_BANK_SHIFT", std::to_string(bank_shift_));
    for (std::size_t i = 1; i < banks_.size(); ++i) {
        defines.set(fmt::format("HALFLIGHT_COLOR_BANK_{}", i));
        defines.set(fmt::format("HALFLIGHT_DATA_BANK_{}", i));
    }
}

void TilePool::bind() const {
    for (std::size_t i = 0; i < banks_.size(); ++i) {
        const auto more = static_cast<GLuint>(i);
        banks_[i].bind_texture(i == 0 ? shared::kUnitColorTexels : shared::kUnitColorBanks + more - 1, GL_RGBA16F);
        banks_[i].bind_texture(i == 0 ? shared::kUnitDataTexels : shared::kUnitDataBanks + more - 1, GL_RGBA8);
    }
    table_.bind_texture(shared::kUnitTileSlots, GL_R32UI);
}

// --- Loading ---------------------------------------------------------------------------------------------------------

const TiledTexture& TilePool::texture_of(std::uint32_t tile) const {
    return *std::prev(std::ranges::upper_bound(textures_, tile, {}, &TiledTexture::first_tile));
}

std::size_t TilePool::read(std::uint32_t tile, std::span<std::uint8_t> texels) const {
    const TiledTexture& texture = texture_of(tile);
    const auto index = static_cast<int>(tile - texture.first_tile);
    const ivec2 place(index % texture.tile_count().x, index / texture.tile_count().x);
    std::array<std::uint8_t, ImageTiles::kBytes> rgba;
    const auto as_color = [&](const std::uint8_t* from, std::size_t count) {
        TextureImage format;
        format.deep = texture.deep;
        const ColorHalves& halves = color_halves(texture.deep);
        for (std::size_t i = 0; i < count; ++i) {
            const std::array<std::uint16_t, 4> texel = halves.of(format, from + i * format.texel_bytes());
            std::memcpy(&texels[i * sizeof texel], texel.data(), sizeof texel);
        }
    };
    constexpr std::size_t kTexels = std::size_t{ImageTiles::kSide} * ImageTiles::kSide;
    if (texture.is_color && !texture.deep) {
        const std::size_t bytes = texture.tiles->read(place, rgba);
        as_color(rgba.data(), kTexels);
        return bytes;
    }
    // Tiles of data, and of deep colour, are two tiles of the image wide.
    constexpr std::size_t kRow = std::size_t{4} * ImageTiles::kSide;
    const int columns = ImageTiles::count(texture.is_color ? 2 * texture.size.x : texture.size.x);
    std::size_t bytes = 0;
    for (int side = 0; side < 2; ++side) {
        const ivec2 half(2 * place.x + side, place.y);
        if (half.x >= columns) break;  // no lookup goes there
        bytes += texture.tiles->read(half, rgba);
        for (std::size_t y = 0; y < ImageTiles::kSide; ++y)
            std::memcpy(&texels[(2 * y + static_cast<std::size_t>(side)) * kRow], &rgba[y * kRow], kRow);
    }
    if (texture.is_color) as_color(texels.data(), kTexels);  // in place: both texels have 8 bytes
    return bytes;
}

std::uint32_t TilePool::free_slot() {
    if (free_.empty()) {
        const std::uint32_t tile = queue_.front();
        queue_.pop_front();
        free_.push_back(std::exchange(slot_of_tile_[tile], shared::kBlankSlot));
        changed_.push_back(tile);
        ++statistics_.evicted;
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
}

void TilePool::upload(std::uint32_t slot, std::span<const std::uint8_t> texels) {
    const std::size_t in_bank = std::size_t{1} << (bank_shift_ - kDataSlotShift);
    banks_[slot / in_bank].write(slot % in_bank * kSlotBytes, kSlotBytes, texels.data());
}

void TilePool::write_changes() {
    constexpr std::uint32_t kGap = 256;  // tiles; writing so many more takes less time than another call
    std::ranges::sort(changed_);
    for (std::size_t i = 0, next = 0; i < changed_.size(); i = next) {
        next = i + 1;
        while (next < changed_.size() && changed_[next] - changed_[next - 1] < kGap) ++next;
        const std::size_t first = changed_[i], count = changed_[next - 1] + 1 - first;
        table_.write(std::span<const std::uint32_t>(slot_of_tile_).subspan(first, count), first);
    }
    changed_.clear();
}

void TilePool::load(std::span<const std::uint32_t> tiles) {
    const Stopwatch watch;
    std::vector<std::uint8_t> texels(std::min(kPortion, tiles.size()) * kSlotBytes);
    const auto place = [&](std::size_t i) { return std::span(texels).subspan(i * kSlotBytes, kSlotBytes); };
    for (std::size_t first = 0; first < tiles.size(); first += kPortion) {
        const std::size_t count = std::min(kPortion, tiles.size() - first);
        std::atomic<std::uint64_t> bytes = 0;
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { bytes += read(tiles[first + i], place(i)); });
        statistics_.loaded += count;
        statistics_.bytes += bytes;
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t tile = tiles[first + i], slot = free_slot();
            upload(slot, place(i));
            slot_of_tile_[tile] = slot;
            changed_.push_back(tile);
            if (!texture_of(tile).pinned) queue_.push_back(tile);
        }
        write_changes();
    }
    statistics_.seconds += watch.seconds();
}

void TilePool::load_pinned() {
    std::vector<std::uint32_t> tiles;
    for (const TiledTexture& texture : textures_)
        for (std::size_t i = 0; texture.pinned && i < tiles_of(texture); ++i)
            tiles.push_back(texture.first_tile + static_cast<std::uint32_t>(i));
    load(tiles);
}

// --- Shading ---------------------------------------------------------------------------------------------------------

std::vector<TilePool::Waiting> TilePool::run(const gpu::Program& kernel, std::span<const Waiting> again,
                                             const std::function<void()>& all) {
    ++statistics_.rounds;
    requests_.write(std::span<const std::uint32_t>(std::array<std::uint32_t, kHeader>{}));
    std::vector<std::uint32_t> invocations;
    for (const Waiting& w : again) invocations.push_back(w.invocation);
    again_.write(std::span<const std::uint32_t>(invocations));
    kernel.bind_storage("TileRequests", requests_);
    kernel.bind_storage("TileBits", bits_);
    kernel.bind_storage("TileWaiting", waiting_);
    kernel.bind_storage("TileAgain", again_);
    kernel.set("again_count", static_cast<std::uint32_t>(again.size()));
    if (again.empty())
        all();
    else
        kernel.dispatch(static_cast<std::uint32_t>((again.size() + 63) / 64));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);

    const std::vector<std::uint32_t> counts = requests_.read<std::uint32_t>(0, kHeader);
    requested_ = requests_.read<std::uint32_t>(kHeader, counts[0]);
    std::ranges::sort(requested_);  // tiles that lie together in the file are read together
    if (!requested_.empty()) bits_.clear();
    statistics_.again += counts[1];
    return waiting_.read<Waiting>(0, counts[1]);
}

void TilePool::shade(const gpu::Program& kernel, std::size_t most, const std::function<void()>& all) {
    ++statistics_.batches;
    reserve(waiting_, most * sizeof(Waiting));
    reserve(again_, most * sizeof(std::uint32_t));
    std::vector<Waiting> portion = run(kernel, {}, all);
    std::vector<std::vector<Waiting>> later;  // portions that have not run yet, the next one last
    std::size_t loaded = 0;                   // tiles loaded for this portion
    std::size_t whole = portion.size();       // invocations of this portion when it began
    for (;;) {
        interruption_point();
        if (!portion.empty() && loaded + requested_.size() <= lasting_) {
            load(requested_);
            loaded += requested_.size();
            portion = run(kernel, portion, all);
            continue;
        }
        if (!portion.empty() && whole == 1) throw Error("textures", "a hit needs more tiles than the pool has");
        if (!portion.empty()) {
            // The portion needs more tiles than there are slots. Tiles leave in the order in which they came. So a
            // portion whose tiles fit would have loaded each of them at most once.
            ++statistics_.splits;
            std::ranges::sort(portion, {}, [](const Waiting& w) { return std::pair(w.tile, w.invocation); });
            const std::size_t wanted = 2 * ((loaded + requested_.size()) / lasting_ + 1);
            const std::size_t parts = std::min(wanted, portion.size());
            const std::size_t each = (portion.size() + parts - 1) / parts;
            for (std::size_t end = portion.size(); end > 0; end -= std::min(each, end)) {
                const std::size_t first = end - std::min(each, end);
                later.emplace_back(portion.begin() + static_cast<std::ptrdiff_t>(first),
                                   portion.begin() + static_cast<std::ptrdiff_t>(end));
            }
        }
        if (later.empty()) return;
        loaded = 0;
        whole = later.back().size();
        portion = run(kernel, later.back(), all);
        later.pop_back();
    }
}

std::size_t TilePool::bytes() const {
    std::size_t sum = table_.bytes() + requests_.bytes() + bits_.bytes() + waiting_.bytes() + again_.bytes();
    for (const gpu::Buffer& bank : banks_) sum += bank.bytes();
    return sum;
}

void TilePool::reset_statistics() {
    statistics_ = {.tiles = statistics_.tiles, .slots = statistics_.slots};
}

}  // namespace halflight::paging
