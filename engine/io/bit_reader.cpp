#include "engine/io/bit_reader.h"

#include <algorithm>
#include <array>

#include "engine/core/error.h"

namespace halflight {
namespace {

constexpr int kLongestCode = 16;  // bits

}  // namespace

std::uint32_t BitReader::peek(int count) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0, byte = at_ / 8; i < 3 && byte + i < bytes_.size(); ++i)
        value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes_[byte + i])) << 8 * i;
    return value >> at_ % 8 & ((1u << count) - 1);
}

void BitReader::skip(int count) {
    at_ += static_cast<std::size_t>(count);
    if (at_ > 8 * bytes_.size()) throw Error(subject_, "cannot be decoded: its compressed data ends too early");
}

std::uint32_t BitReader::take(int count) {
    const std::uint32_t value = peek(count);
    skip(count);
    return value;
}

HuffmanTable::HuffmanTable(const std::vector<std::uint8_t>& lengths, const std::string& subject) {
    std::array<std::uint32_t, kLongestCode + 2> next{};  // first code of each length (RFC 1951, section 3.2.2)
    for (const std::uint8_t length : lengths) {
        bits_ = std::max<int>(bits_, length);
        if (length > 0) ++next[length + 1u];
    }
    for (std::size_t length = 1; length < next.size(); ++length) {
        next[length] = (next[length - 1] + next[length]) << 1;
        if (next[length] > 1u << length)  // shorter codes take more than all prefixes
            throw Error(subject, "cannot be decoded: a Huffman table has too many codes");
    }
    entries_.resize(bits_ == 0 ? 0 : std::size_t{1} << bits_);
    for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
        const unsigned length = lengths[symbol];
        if (length == 0) continue;
        const std::uint32_t code = next[length]++;
        std::uint32_t reversed = 0;  // codes are stored from their highest bit on
        for (unsigned i = 0; i < length; ++i) reversed |= (code >> i & 1) << (length - 1 - i);
        for (std::size_t at = reversed; at < entries_.size(); at += std::size_t{1} << length)
            entries_[at] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint16_t>(length)};
    }
}

HuffmanTable::HuffmanTable(BitReader& bits) {
    static constexpr std::array<std::uint8_t, 21> kOrder{17, 18, 19, 20, 0,  8, 7,  9, 6,  10, 5,
                                                         11, 4,  12, 3,  13, 2, 14, 1, 15, 16};
    const std::uint32_t symbols = bits.take(14);
    if (symbols == 0) return;  // a table that nothing uses
    const std::uint32_t count = bits.take(5);
    if (count < 1 || count > kOrder.size())
        throw Error(bits.subject(), "cannot be decoded: a Huffman table has {} code lengths", count);
    std::vector<std::uint8_t> small(kOrder.size());
    for (std::uint32_t i = 0; i < count; ++i) small[kOrder[i]] = static_cast<std::uint8_t>(bits.take(3));
    const HuffmanTable codes(small, bits.subject());

    std::vector<std::uint8_t> lengths;
    while (lengths.size() < symbols) {
        const std::uint32_t symbol = codes.decode(bits);
        std::uint8_t length = 0;
        std::uint32_t run = 1;
        switch (symbol) {
            case 17:
                run = 3 + bits.take(3);
                break;
            case 18:
                run = 11 + bits.take(7);
                break;
            case 19:
            case 20:
                run = symbol == 19 ? 3 + bits.take(2) : 7 + bits.take(7);
                length = lengths.empty() ? 0 : lengths.back();
                if (length == 0) throw Error(bits.subject(), "cannot be decoded: a Huffman table repeats no code");
                break;
            default:
                length = static_cast<std::uint8_t>(symbol);
        }
        lengths.insert(lengths.end(), run, length);
    }
    if (lengths.size() > symbols) throw Error(bits.subject(), "cannot be decoded: a Huffman table is too long");
    *this = HuffmanTable(lengths, bits.subject());
}

std::uint32_t HuffmanTable::decode(BitReader& bits) const {
    const Entry entry = entries_.empty() ? Entry{} : entries_[bits.peek(bits_)];
    if (entry.length == 0) throw Error(bits.subject(), "cannot be decoded: its compressed data has an invalid code");
    bits.skip(entry.length);
    return entry.symbol;
}

}  // namespace halflight
