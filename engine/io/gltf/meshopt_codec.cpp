#include "engine/io/gltf/meshopt_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

namespace halflight {
namespace {

constexpr std::size_t kGroup = 16;          // elements whose deltas have the same number of bits
constexpr std::size_t kMostElements = 256;  // elements of a block

/// Bytes that are taken from the front. After it has ended, it is false and gives zeros.
class Input {
  public:
    explicit Input(std::string_view bytes) : bytes_(bytes) {}
    std::string_view take(std::size_t count) {
        whole_ = whole_ && count <= bytes_.size();
        const std::string_view taken = bytes_.substr(0, whole_ ? count : 0);
        bytes_.remove_prefix(taken.size());
        return taken;
    }
    explicit operator bool() const { return whole_; }
    bool ended() const { return bytes_.empty(); }

  private:
    std::string_view bytes_;
    bool whole_ = true;
};

unsigned byte_at(std::string_view bytes, std::size_t index) {
    return static_cast<unsigned char>(bytes[index]);
}

/// Returns the i-th pair of bits.
unsigned pair_at(std::string_view bytes, std::size_t i) {
    return byte_at(bytes, i / 4) >> i % 4 * 2 & 3;
}

/// Reads the deltas of a group, `bits` bits each. The largest value stands for a byte that follows the group.
void read_group(Input& input, unsigned bits, std::uint8_t* deltas) {
    const std::string_view packed = input.take(bits * kGroup / 8);
    if (bits == 0 || !input) return;
    const unsigned largest = (1u << bits) - 1;
    for (std::size_t i = 0; i < kGroup; ++i) {
        const std::size_t place = i * bits % 8;
        const std::size_t shift = bits == 1 ? place : 8 - bits - place;  // single bits begin at the lowest one
        unsigned delta = byte_at(packed, i * bits / 8) >> shift & largest;
        if (bits < 8 && delta == largest) {
            const std::string_view whole = input.take(1);
            if (!input) return;
            delta = byte_at(whole, 0);
        }
        deltas[i] = static_cast<std::uint8_t>(delta);
    }
}

/// Reads the deltas of one byte of each element. `deltas` are zeros, in whole groups.
void read_deltas(Input& input, unsigned control, std::size_t elements, std::uint8_t* deltas) {
    constexpr std::array<unsigned, 4> kBits[] = {{0, 1, 2, 4}, {1, 2, 4, 8}};
    if (control == 2) return;
    if (control == 3) {
        const std::string_view bytes = input.take(elements);
        std::memcpy(deltas, bytes.data(), bytes.size());
        return;
    }
    const std::size_t groups = (elements + kGroup - 1) / kGroup;
    const std::string_view header = input.take((groups + 3) / 4);
    for (std::size_t g = 0; input && g < groups; ++g)
        read_group(input, kBits[control][pair_at(header, g)], deltas + g * kGroup);
}

/// Adds up the deltas of a channel, whose four bytes are one value of type T or several. last: the four bytes of the
/// element before.
template <std::unsigned_integral T>
void add_up(const std::array<std::array<std::uint8_t, kMostElements>, 4>& deltas, unsigned mode, std::size_t elements,
            std::size_t stride, std::uint8_t* last, char* to) {
    const bool exclusive = (mode & 15) == 2;
    for (std::size_t first = 0; first < 4; first += sizeof(T)) {
        T value = 0;
        for (std::size_t b = 0; b < sizeof(T); ++b) value = static_cast<T>(value | T{last[first + b]} << 8 * b);
        for (std::size_t i = 0; i < elements; ++i) {
            T delta = 0;
            for (std::size_t b = 0; b < sizeof(T); ++b)
                delta = static_cast<T>(delta | T{deltas[first + b][i]} << 8 * b);
            const T half = static_cast<T>(delta >> 1);
            value = exclusive ? static_cast<T>(value ^ std::rotr(delta, static_cast<int>(mode >> 4)))
                              : static_cast<T>(value + ((delta & 1) != 0 ? static_cast<T>(~half) : half));
            for (std::size_t b = 0; b < sizeof(T); ++b)
                to[i * stride + first + b] = static_cast<char>(value >> 8 * b & 255);
        }
        for (std::size_t b = 0; b < sizeof(T); ++b) last[first + b] = static_cast<std::uint8_t>(value >> 8 * b & 255);
    }
}

template <std::unsigned_integral T>
void decode_colors(std::span<char> elements) {
    using Signed = std::make_signed_t<T>;
    constexpr float kLargest = std::numeric_limits<T>::max();
    for (std::size_t at = 0; at + 4 * sizeof(T) <= elements.size(); at += 4 * sizeof(T)) {
        std::array<T, 4> c;
        std::memcpy(c.data(), &elements[at], sizeof c);
        const int one = (1 << std::bit_width(c[3])) - 1;  // the highest bit of alpha tells the number of bits
        const int y = c[0], co = static_cast<Signed>(c[1]), cg = static_cast<Signed>(c[2]), low = c[3] & one >> 1;
        const std::array<int, 4> rgba = {y + co - cg, y + cg, y - co - cg, low << 1 | (low & 1)};
        for (std::size_t i = 0; i < 4; ++i)
            c[i] = static_cast<T>(std::lround(std::clamp(
                static_cast<float>(rgba[i]) * kLargest / static_cast<float>(std::max(one, 1)), 0.0f, kLargest)));
        std::memcpy(&elements[at], c.data(), sizeof c);
    }
}

}  // namespace

bool decode_meshopt_attributes(std::span<char> elements, std::size_t stride, std::string_view data) {
    const std::size_t channels = stride / 4, tail = stride + channels, padded = std::max<std::size_t>(tail, 24);
    if (data.size() < 1 + padded || byte_at(data, 0) != kMeshoptAttributes1) return false;
    const std::string_view modes = data.substr(data.size() - channels);
    for (std::size_t c = 0; c < channels; ++c)
        if (const unsigned mode = byte_at(modes, c); mode > 1 && (mode & 15) != 2) return false;
    std::array<std::uint8_t, 256> last{};
    std::memcpy(last.data(), &data[data.size() - tail], stride);
    Input input(data.substr(1, data.size() - 1 - padded));
    const std::size_t most = std::min((8192 / stride) & ~(kGroup - 1), kMostElements);
    while (!elements.empty()) {
        const std::size_t count = std::min(elements.size() / stride, most);
        const std::string_view controls = input.take(channels);
        for (std::size_t c = 0; input && c < channels; ++c) {
            std::array<std::array<std::uint8_t, kMostElements>, 4> deltas{};
            for (std::size_t b = 0; b < 4; ++b)
                read_deltas(input, pair_at(controls, 4 * c + b), count, deltas[b].data());
            const unsigned mode = byte_at(modes, c);
            const auto add = mode == 0   ? add_up<std::uint8_t>
                             : mode == 1 ? add_up<std::uint16_t>
                                         : add_up<std::uint32_t>;
            add(deltas, mode, count, stride, &last[4 * c], &elements[4 * c]);
        }
        if (!input) return false;
        elements = elements.subspan(count * stride);
    }
    return input.ended();
}

void decode_meshopt_colors(std::span<char> elements, std::size_t stride) {
    stride == 4 ? decode_colors<std::uint8_t>(elements) : decode_colors<std::uint16_t>(elements);
}

}  // namespace halflight
