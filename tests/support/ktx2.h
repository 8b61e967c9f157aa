// Makes KTX2 files for tests (KTX 2.0, and "BasisLZ/ETC1S Bitstream Specification").
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

namespace halflight::test {

/// Contents of a KTX2 file of one level.
struct Ktx2 {
    std::uint32_t format = 0;  // VkFormat
    std::uint32_t width = 4, height = 4, depth = 0, layers = 0, faces = 1;
    std::uint32_t supercompression = 0;
    unsigned model = 166;  // UASTC
    unsigned primaries = 1, transfer = 2, flags = 0;
    std::vector<unsigned> channels{0};
    unsigned bits = 8;   // Bits of each channel
    std::string values;  // key/value data
    std::string pixels;
    std::uint64_t inflated = 0;
    std::string global;
};

inline void put(std::string& bytes, std::uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes += static_cast<char>(i < 8 ? value >> 8 * i & 255 : 0);
}

inline std::string encode(const Ktx2& k) {
    constexpr std::uint32_t kDescriptor = 80 + 24;
    const auto descriptor_bytes = static_cast<std::uint32_t>(4 + 24 + 16 * k.channels.size());
    const std::uint32_t values = kDescriptor + descriptor_bytes;
    const std::size_t global = values + k.values.size(), pixels = global + k.global.size();
    std::string bytes("\xabKTX 20\xbb\r\n\x1a\n", 12);
    for (const std::uint32_t word :
         {k.format, 1u, k.width, k.height, k.depth, k.layers, k.faces, 1u, k.supercompression, kDescriptor,
          descriptor_bytes, k.values.empty() ? 0u : values, static_cast<std::uint32_t>(k.values.size())})
        put(bytes, word, 4);
    for (const std::uint64_t word : {k.global.empty() ? std::size_t{0} : global, k.global.size(), pixels,
                                     k.pixels.size(), static_cast<std::size_t>(k.inflated)})
        put(bytes, word, 8);
    put(bytes, descriptor_bytes, 4);
    put(bytes, 0, 4);
    put(bytes, 2, 2);
    put(bytes, descriptor_bytes - 4, 2);
    for (const unsigned byte : {k.model, k.primaries, k.transfer, k.flags}) put(bytes, byte, 1);
    bytes.append(12, '\0');
    for (const unsigned channel : k.channels) put(bytes, std::uint64_t{channel} << 24 | (k.bits - 1) << 16, 16);
    return bytes + k.values + k.global + k.pixels;
}

class BitWriter {
  public:
    void put(std::uint32_t value, int count) {
        for (int i = 0; i < count; ++i, ++size_) {
            if (size_ % 8 == 0) bytes_ += '\0';
            bytes_.back() = static_cast<char>(bytes_.back() | (value >> i & 1) << size_ % 8);
        }
    }
    /// Writes a Huffman table in which `symbols` symbols have codes of equal length.
    void put_table(std::uint32_t symbols) {
        constexpr int kOrder[] = {17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16};
        put(symbols, 14);
        put(21, 5);
        for (const int length : kOrder) put(length == code_length(symbols), 3);
        for (std::uint32_t i = 0; i < symbols; ++i) put(0, 1);
    }
    /// Writes a symbol of such a table.
    void put_symbol(std::uint32_t symbol, std::uint32_t symbols) {
        for (int i = code_length(symbols) - 1; i >= 0; --i) put(symbol >> i & 1, 1);
    }
    /// Writes a number in chunks of `bits` bits.
    void put_chunks(std::uint32_t value, int bits) {
        for (; value >> bits != 0; value >>= bits) put((value & ((1u << bits) - 1)) | 1u << bits, bits + 1);
        put(value, bits + 1);
    }
    const std::string& bytes() const { return bytes_; }

  private:
    static int code_length(std::uint32_t symbols) { return std::max(1, static_cast<int>(std::bit_width(symbols - 1))); }

    std::string bytes_;
    std::size_t size_ = 0;  // bits
};

/// A picture in ETC1S. Every slice has an endpoint and a selector for each block of 4 x 4 texels.
struct Etc1s {
    using Endpoint = std::array<std::uint32_t, 4>;  // intensity table, then base colour of 5 bits
    using Selector = std::array<std::uint8_t, 16>;  // modifier of each texel, 0 to 3
    struct Block {
        std::uint32_t endpoint = 0, selector = 0;
    };

    std::uint32_t columns = 1, rows = 1;  // blocks
    std::vector<Endpoint> endpoints;
    std::vector<Selector> selectors;
    std::vector<std::vector<Block>> slices;
};

/// Compresses with BasisLZ: predictions, runs and the history of selectors are used wherever they apply.
inline Ktx2 encode_basis_lz(const Etc1s& picture) {
    constexpr std::uint32_t kHistory = 2;
    const auto endpoints = static_cast<std::uint32_t>(picture.endpoints.size());
    const auto selectors = static_cast<std::uint32_t>(picture.selectors.size());
    const std::uint32_t selector_symbols = selectors + kHistory + 1;

    BitWriter endpoint_bits;
    for (const std::uint32_t symbols : {32, 32, 32, 8}) endpoint_bits.put_table(symbols);
    endpoint_bits.put(0, 1);
    Etc1s::Endpoint last{0, 16, 16, 16};
    for (const Etc1s::Endpoint& endpoint : picture.endpoints) {
        endpoint_bits.put_symbol((endpoint[0] - last[0]) & 7, 8);
        for (std::size_t c = 1; c < 4; ++c) endpoint_bits.put_symbol((endpoint[c] - last[c]) & 31, 32);
        last = endpoint;
    }

    BitWriter selector_bits;
    selector_bits.put(0, 3);
    selector_bits.put_table(256);
    std::array<std::uint32_t, 4> before{};
    for (std::size_t i = 0; i < picture.selectors.size(); ++i) {
        for (std::size_t y = 0; y < 4; ++y) {
            std::uint32_t row = 0;
            for (std::size_t x = 0; x < 4; ++x) row |= std::uint32_t{picture.selectors[i][4 * y + x]} << 2 * x;
            i == 0 ? selector_bits.put(row, 8) : selector_bits.put_symbol(row ^ before[y], 256);
            before[y] = row;
        }
    }

    BitWriter table_bits;
    for (const std::uint32_t symbols : {257u, endpoints, selector_symbols, 64u}) table_bits.put_table(symbols);
    table_bits.put(kHistory, 13);

    Ktx2 file;
    file.width = 4 * picture.columns, file.height = 4 * picture.rows;
    file.supercompression = 1;
    file.model = 163;
    std::vector<std::uint64_t> places;
    for (const std::vector<Etc1s::Block>& blocks : picture.slices) {
        const auto at = [&](std::uint32_t x, std::uint32_t y) { return blocks[y * picture.columns + x]; };
        const auto prediction = [&](std::uint32_t x, std::uint32_t y) -> std::uint32_t {
            if (x >= picture.columns || y >= picture.rows) return 3;
            const std::uint32_t endpoint = at(x, y).endpoint;
            if (x > 0 && endpoint == at(x - 1, y).endpoint) return 0;
            if (y > 0 && endpoint == at(x, y - 1).endpoint) return 1;
            return x > 0 && y > 0 && endpoint == at(x - 1, y - 1).endpoint ? 2 : 3;
        };
        std::vector<std::uint32_t> groups;
        for (std::uint32_t y = 0; y < picture.rows; y += 2)
            for (std::uint32_t x = 0; x < picture.columns; x += 2)
                groups.push_back(prediction(x, y) | prediction(x + 1, y) << 2 | prediction(x, y + 1) << 4 |
                                 prediction(x + 1, y + 1) << 6);
        BitWriter bits;
        std::uint32_t group = 0, group_run = 0, selector_run = 0, last_endpoint = 0;
        for (std::uint32_t i = 0; i < blocks.size(); ++i) {
            const std::uint32_t x = i % picture.columns, y = i / picture.columns;
            if (x % 2 == 0 && y % 2 == 0) {
                std::uint32_t run = 0;
                while (group > 0 && group + run < groups.size() && groups[group + run] == groups[group - 1]) ++run;
                if (group_run > 0) {
                    --group_run;
                } else if (run >= 3) {
                    bits.put_symbol(256, 257);
                    bits.put_chunks(run - 3, 4);
                    group_run = run - 1;
                } else {
                    bits.put_symbol(groups[group], 257);
                }
                ++group;
            }
            if (prediction(x, y) == 3)
                bits.put_symbol((blocks[i].endpoint + endpoints - last_endpoint) % endpoints, endpoints);
            last_endpoint = blocks[i].endpoint;
            std::uint32_t run = 0;  // blocks with selector 0, which stays in the history's first place
            while (i + run < blocks.size() && blocks[i + run].selector == 0) ++run;
            if (selector_run > 0) {
                --selector_run;
            } else if (run >= 3) {
                bits.put_symbol(selectors + kHistory, selector_symbols);
                bits.put_symbol(std::min(run - 3, 63u), 64);
                if (run - 3 >= 63) bits.put_chunks(run - 3, 7);
                selector_run = run - 1;
            } else {
                bits.put_symbol(run > 0 ? selectors : blocks[i].selector, selector_symbols);
            }
        }
        places.push_back(file.pixels.size());
        places.push_back(bits.bytes().size());
        file.pixels += bits.bytes();
    }
    places.resize(4);
    put(file.global, endpoints, 2);
    put(file.global, selectors, 2);
    for (const BitWriter* part : {&endpoint_bits, &selector_bits, &table_bits})
        put(file.global, part->bytes().size(), 4);
    put(file.global, 0, 8);  // no extended data, no flags
    for (const std::uint64_t place : places) put(file.global, place, 4);
    for (const BitWriter* part : {&endpoint_bits, &selector_bits, &table_bits}) file.global += part->bytes();
    if (picture.slices.size() == 2) file.channels = {0, 15};
    return file;
}

}  // namespace halflight::test
