// Reading of bits and canonical Huffman codes, as BasisLZ stores them (KTX 2.0, "BasisLZ/ETC1S Bitstream
// Specification").
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// Reads bits from the first byte's least significant bit on. Throws Error with `subject` at the end of the bytes.
class BitReader {
  public:
    BitReader(std::string_view bytes, const std::string& subject) : bytes_(bytes), subject_(subject) {}

    std::uint32_t take(int count);        ///< count: 0 to 16
    std::uint32_t peek(int count) const;  ///< Returns the next bits; those after the end are 0. count: 0 to 16
    void skip(int count);
    const std::string& subject() const { return subject_; }

  private:
    std::string_view bytes_;
    const std::string& subject_;
    std::size_t at_ = 0;  // bits from the start
};

/// A Huffman code ("Compressed Huffman Tables").
class HuffmanTable {
  public:
    HuffmanTable() = default;  ///< Makes a table without codes.
    /// Reads a table. Throws Error for code lengths that make no prefix code.
    explicit HuffmanTable(BitReader& bits);

    /// Reads a symbol. Throws Error for bits that are no code.
    std::uint32_t decode(BitReader& bits) const;

  private:
    struct Entry {
        std::uint16_t symbol = 0;
        std::uint16_t length = 0;  // bits of the code; 0: no code
    };

    explicit HuffmanTable(const std::vector<std::uint8_t>& lengths, const std::string& subject);

    int bits_ = 0;                // length of the longest code
    std::vector<Entry> entries_;  // entry of each value of the next `bits_` bits
};

}  // namespace halflight
