#include "engine/io/uastc.h"

#include <algorithm>
#include <bit>

namespace halflight {
namespace {

enum class Channels : std::uint8_t { luminance_alpha, rgb, rgba };

/// Layout of a mode (tables "UASTC Mode Index encoding", "Endpoint bits for each mode", "UASTC weight bits for each
/// mode" and "Block configuration bits").
struct Mode {
    unsigned code;  // the block's first bits
    int code_bits;
    int hint_bits;  // bits for transcoders, which decoding skips
    Channels channels;
    int subsets;
    int planes;
    unsigned radix;  // 3: endpoints with trits, 5: with quints, 1: with bits alone
    int endpoint_bits;
    int weight_bits;
};

constexpr std::size_t kSolid = 8;  // the mode of blocks of one colour
constexpr std::array<Mode, 19> kModes{{
    {0x01, 4, 15, Channels::rgb, 1, 1, 3, 6, 4},
    {0x35, 6, 15, Channels::rgb, 1, 1, 1, 8, 2},
    {0x1d, 5, 15, Channels::rgb, 2, 1, 1, 4, 3},
    {0x03, 5, 15, Channels::rgb, 3, 1, 3, 2, 2},
    {0x13, 5, 15, Channels::rgb, 2, 1, 5, 3, 2},
    {0x0b, 5, 15, Channels::rgb, 1, 1, 1, 8, 3},
    {0x1b, 5, 15, Channels::rgb, 1, 2, 5, 5, 2},
    {0x07, 5, 15, Channels::rgb, 2, 1, 5, 3, 2},
    {0x17, 5, 0, Channels::rgba, 1, 1, 1, 8, 0},
    {0x0f, 5, 23, Channels::rgba, 2, 1, 1, 4, 2},
    {0x02, 3, 17, Channels::rgba, 1, 1, 3, 4, 4},
    {0x00, 2, 17, Channels::rgba, 1, 2, 3, 4, 2},
    {0x06, 3, 17, Channels::rgba, 1, 1, 3, 6, 3},
    {0x1f, 5, 23, Channels::rgba, 1, 2, 1, 8, 1},
    {0x0d, 5, 23, Channels::rgba, 1, 1, 1, 8, 2},
    {0x05, 7, 23, Channels::luminance_alpha, 1, 1, 1, 8, 4},
    {0x15, 6, 23, Channels::luminance_alpha, 2, 1, 1, 8, 2},
    {0x25, 6, 23, Channels::luminance_alpha, 1, 2, 1, 8, 2},
    {0x09, 4, 15, Channels::rgb, 1, 1, 1, 5, 5},
}};

// Partition patterns: bit i is the subset of texel i. Patterns of three subsets have two bits per texel.
constexpr std::uint16_t kPatternsOfTwo[] = {0xcccc, 0x8888, 0x1111, 0xecc8, 0x377f, 0xfeec, 0x0137, 0x137f,
                                            0xc800, 0x0013, 0xfe80, 0x17ff, 0x0017, 0x00ff, 0xfff0, 0x0fff,
                                            0xff71, 0x8eff, 0x08ce, 0x008c, 0x7310, 0xceff, 0x7331, 0x088c,
                                            0xceef, 0x6666, 0xf00f, 0x5555, 0x0f0f, 0x36c9};
constexpr std::uint16_t kPatternsOfMode7[] = {0x00f0, 0x4444, 0x0133, 0xcc80, 0xf0ff, 0x2222, 0xffc8,
                                              0xccce, 0x3c03, 0x00ee, 0x7700, 0x3003, 0x00ce, 0xff80,
                                              0x6fff, 0x1333, 0x11ff, 0x136c, 0x00ef};
constexpr std::uint32_t kPatternsOfThree[] = {0xa5a50000, 0xaa005555, 0xaa000055, 0x0000aa55, 0x25252525, 0x94949494,
                                              0x58585858, 0x56560202, 0x92929292, 0x55aa0055, 0xa05050a0};

using Subsets = std::array<std::uint8_t, 16>;  // subset of each texel

template <class Word, std::size_t N>
bool read_pattern(const Word (&patterns)[N], unsigned index, int bits, Subsets& subsets) {
    if (index >= N) return false;
    for (int i = 0; i < 16; ++i) subsets[i] = patterns[index] >> (bits * i) & ((1u << bits) - 1);
    return true;
}

/// Reads bits from the first byte's least significant bit on.
class Bits {
  public:
    explicit Bits(const std::uint8_t* bytes) : bytes_(bytes) {}

    /// count: 0 to 8
    unsigned take(int count) {
        unsigned value = 0;
        for (int i = 0; i < count; ++i, ++at_) value |= (bytes_[at_ / 8] >> at_ % 8 & 1u) << i;
        return value;
    }
    void skip(int count) { at_ += static_cast<std::size_t>(count); }

  private:
    const std::uint8_t* bytes_;
    std::size_t at_ = 0;
};

constexpr std::size_t kNoMode = kModes.size();

/// Returns the mode of every value of a block's first 7 bits; kNoMode: none.
constexpr std::array<std::uint8_t, 128> modes_by_code() {
    std::array<std::uint8_t, 128> modes{};
    modes.fill(kNoMode);
    for (std::size_t m = 0; m < kModes.size(); ++m)
        for (unsigned rest = 0; rest < 128u >> kModes[m].code_bits; ++rest)
            modes[rest << kModes[m].code_bits | kModes[m].code] = static_cast<std::uint8_t>(m);
    return modes;
}

/// Repeats the highest bits of a value of `bits` bits until it has `wanted` bits.
unsigned replicate(unsigned value, int bits, int wanted) {
    unsigned result = 0;
    for (int shift = wanted - bits; shift > -bits; shift -= bits)
        result |= shift >= 0 ? value << shift : value >> -shift;
    return result;
}

/// Returns an endpoint as 8 bits: 18.13 of the chapter on ASTC, "Color endpoint unquantization". digit: trit or quint.
unsigned unquantize_endpoint(unsigned digit, unsigned bits, const Mode& mode) {
    if (mode.radix == 1) return replicate(bits, mode.endpoint_bits, 8);
    const unsigned b = bits >> 1 & 1, c = bits >> 2 & 1;
    const unsigned high = bits >> 1;  // all but the lowest bit
    unsigned factor = 0, offset = 0;  // C and B of the specification
    switch (mode.radix == 3 ? mode.endpoint_bits : 10 * mode.endpoint_bits) {
        case 2:  // b000b0bb0
            factor = 93, offset = b * 0x116;
            break;
        case 4:  // dcb000dcb
            factor = 22, offset = high << 6 | high;
            break;
        case 6:  // fedcb000f
            factor = 5, offset = high << 4 | high >> 4;
            break;
        case 30:  // cb0000cbc
            factor = 26, offset = c * 0x105 | b * 0x82;
            break;
        case 50:  // edcb0000e
            factor = 6, offset = high << 5 | high >> 3;
            break;
    }
    const unsigned flip = bits & 1 ? 0x1ff : 0;  // A of the specification
    const unsigned value = (digit * factor + offset) ^ flip;
    return (flip & 0x80) | value >> 2;
}

/// Endpoints of a subset, low and high, as 8 bits in R, G, B, A.
using Endpoints = std::array<std::array<unsigned, 2>, 4>;

std::array<Endpoints, 3> read_endpoints(Bits& bits, const Mode& mode) {
    const int pairs = mode.channels == Channels::rgba ? 4 : mode.channels == Channels::rgb ? 3 : 2;
    const int count = 2 * pairs * mode.subsets;
    std::array<unsigned, 18> digits{};
    // Full groups are 5 trits in 8 bits or 3 quints in 7; a shorter last group has the bits that it needs.
    for (int i = 0; mode.radix != 1 && i < count;) {
        const int group = std::min(mode.radix == 3 ? 5 : 3, count - i);
        unsigned values = 1;
        for (int k = 0; k < group; ++k) values *= mode.radix;
        unsigned packed = bits.take(std::bit_width(values - 1));
        for (int k = 0; k < group; ++k, ++i, packed /= mode.radix) digits[i] = packed % mode.radix;
    }
    std::array<Endpoints, 3> endpoints{};
    for (int i = 0; i < count; ++i) {
        Endpoints& subset = endpoints[i / (2 * pairs)];
        const int channel = i / 2 % pairs, side = i % 2;
        const unsigned value = unquantize_endpoint(digits[i], bits.take(mode.endpoint_bits), mode);
        if (mode.channels == Channels::luminance_alpha && channel == 0)
            subset[0][side] = subset[1][side] = subset[2][side] = value;
        else
            subset[mode.channels == Channels::luminance_alpha ? 3 : channel][side] = value;
        if (mode.channels == Channels::rgb) subset[3][side] = 255;
    }
    return endpoints;
}

/// Returns the weights of the planes, 0 to 64. The highest bit of a subset's first texel is 0 and not stored.
std::array<std::array<unsigned, 16>, 2> read_weights(Bits& bits, const Mode& mode, const Subsets& subsets) {
    std::array<std::array<unsigned, 16>, 2> weights{};
    unsigned seen = 0;  // bit s: subset s has had a texel
    for (int i = 0; i < 16; ++i) {
        const bool first = !(seen >> subsets[i] & 1);
        seen |= 1u << subsets[i];
        for (int plane = 0; plane < mode.planes; ++plane) {
            const unsigned weight = replicate(bits.take(mode.weight_bits - first), mode.weight_bits, 6);
            weights[plane][i] = weight + (weight > 32);
        }
    }
    return weights;
}

}  // namespace

bool decode_uastc(const std::uint8_t* bytes, bool srgb, TexelBlock& texels) {
    static constexpr std::array<std::uint8_t, 128> kModeByCode = modes_by_code();
    const std::size_t index = kModeByCode[bytes[0] & 0x7f];
    if (index == kNoMode) return false;
    const Mode& mode = kModes[index];
    Bits bits(bytes);
    bits.skip(mode.code_bits);
    if (index == kSolid) {
        for (std::size_t c = 0; c < 4; ++c) texels[c] = static_cast<std::uint8_t>(bits.take(8));
        for (std::size_t i = 4; i < texels.size(); ++i) texels[i] = texels[i - 4];
        return true;
    }
    bits.skip(mode.hint_bits);
    Subsets subsets{};
    if (mode.subsets == 3 && !read_pattern(kPatternsOfThree, bits.take(4), 2, subsets)) return false;
    if (mode.subsets == 2) {
        const unsigned pattern = bits.take(5);
        if (!(index == 7 ? read_pattern(kPatternsOfMode7, pattern, 1, subsets)
                         : read_pattern(kPatternsOfTwo, pattern, 1, subsets)))
            return false;
    }
    unsigned second = 4;  // the channel with the weights of the second plane; 4: none
    if (mode.planes == 2) second = mode.channels == Channels::luminance_alpha ? 3 : bits.take(2);
    const std::array<Endpoints, 3> endpoints = read_endpoints(bits, mode);
    const std::array<std::array<unsigned, 16>, 2> weights = read_weights(bits, mode, subsets);
    for (std::size_t i = 0; i < 16; ++i) {
        for (unsigned c = 0; c < 4; ++c) {
            const auto [low, high] = endpoints[subsets[i]][c];
            const unsigned w = weights[c == second][i];
            const auto widen = [&](unsigned v) { return v << 8 | (srgb ? 0x80 : v); };
            texels[4 * i + c] = static_cast<std::uint8_t>((widen(low) * (64 - w) + widen(high) * w + 32) >> 14);
        }
    }
    return true;
}

}  // namespace halflight
