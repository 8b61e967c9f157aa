#include "engine/io/etc1s.h"

#include <algorithm>
#include <utility>

#include "engine/core/error.h"

namespace halflight {
namespace {

/// Recently used selectors: an approximate move-to-front list.
class SelectorHistory {
  public:
    explicit SelectorHistory(std::size_t size) : values_(size), rover_(size / 2) {}

    std::size_t size() const { return values_.size(); }
    void add(std::uint32_t selector) {
        if (values_.empty()) return;
        values_[rover_++] = selector;
        if (rover_ == values_.size()) rover_ = values_.size() / 2;
    }
    /// Returns a selector and moves it towards the front.
    std::uint32_t use(std::size_t index) {
        const std::uint32_t selector = values_[index];
        std::swap(values_[index], values_[index / 2]);
        return selector;
    }

  private:
    std::vector<std::uint32_t> values_;
    std::size_t rover_;
};

/// Reads a number in chunks of `bits` bits, each with a bit that tells whether another follows.
std::uint32_t read_chunks(BitReader& reader, int bits) {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += bits) {
        const std::uint32_t chunk = reader.take(bits + 1);
        value |= (chunk & ((1u << bits) - 1)) << shift;
        if (chunk >> bits == 0) return value;
    }
    throw Error(reader.subject(), "cannot be decoded: a run is too long");
}

}  // namespace

Etc1sDecoder::Etc1sDecoder(const Etc1sSource& source, const std::string& subject) : subject_(subject) {
    BitReader bits(source.tables, subject_);
    for (HuffmanTable* table : {&endpoint_prediction_, &endpoint_delta_, &selector_, &selector_run_})
        *table = HuffmanTable(bits);
    history_size_ = bits.take(13);
    read_endpoints(source);
    read_selectors(source);
}

void Etc1sDecoder::read_endpoints(const Etc1sSource& source) {
    BitReader bits(source.endpoints, subject_);
    const HuffmanTable deltas[] = {HuffmanTable(bits), HuffmanTable(bits), HuffmanTable(bits)};
    const HuffmanTable table_deltas(bits);
    const bool grey = bits.take(1) != 0;
    Endpoint last{{16, 16, 16}, 0};
    const auto read_channel = [&](std::uint8_t& value) {
        const HuffmanTable& delta = deltas[value <= 9 ? 0 : value <= 21 ? 1 : 2];
        value = static_cast<std::uint8_t>((value + delta.decode(bits)) & 31);
    };
    for (std::size_t i = 0; i < source.endpoint_count; ++i) {
        last.table = static_cast<std::uint8_t>((last.table + table_deltas.decode(bits)) & 7);
        read_channel(last.base[0]);
        if (grey)
            last.base.fill(last.base[0]);
        else
            read_channel(last.base[1]), read_channel(last.base[2]);
        endpoints_.push_back(last);
    }
}

void Etc1sDecoder::read_selectors(const Etc1sSource& source) {
    BitReader bits(source.selectors, subject_);
    if (bits.take(2) != 0) throw Error(subject_, "cannot be decoded: its selectors are of an unknown kind");
    const auto read_raw = [&] {
        Selector selector;
        for (std::uint8_t& row : selector) row = static_cast<std::uint8_t>(bits.take(8));
        selectors_.push_back(selector);
    };
    if (bits.take(1) != 0) {
        for (std::size_t i = 0; i < source.selector_count; ++i) read_raw();
        return;
    }
    const HuffmanTable deltas(bits);
    if (source.selector_count > 0) read_raw();
    while (selectors_.size() < source.selector_count) {
        Selector selector = selectors_.back();
        for (std::uint8_t& row : selector) row = static_cast<std::uint8_t>(row ^ deltas.decode(bits));
        selectors_.push_back(selector);
    }
}

std::array<Etc1sDecoder::Rgb, 4> Etc1sDecoder::colors_of(const Endpoint& endpoint) {
    // Modifiers -b, -a, a and b of each intensity table ("ETC1S Selector Codebooks"; Data Format, table of ETC1).
    static constexpr int kSmall[] = {2, 5, 9, 13, 18, 24, 33, 47};
    static constexpr int kLarge[] = {8, 17, 29, 42, 60, 80, 106, 183};
    const int modifiers[] = {-kLarge[endpoint.table], -kSmall[endpoint.table], kSmall[endpoint.table],
                             kLarge[endpoint.table]};
    std::array<Rgb, 4> colors{};
    for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            const int base = endpoint.base[c] << 3 | endpoint.base[c] >> 2;
            colors[i][c] = static_cast<std::uint8_t>(std::clamp(base + modifiers[i], 0, 255));
        }
    }
    return colors;
}

template <class Store>
void Etc1sDecoder::decode_blocks(std::string_view slice, std::size_t columns, std::size_t rows,
                                 const Store& store) const {
    constexpr std::uint32_t kRepeatPrediction = 256;  // after the predictions of 2 x 2 blocks, 2 bits each
    constexpr std::uint32_t kShortestRun = 3;
    constexpr std::uint32_t kLongRun = 63;
    const auto fail = [&](const char* what) { throw Error(subject_, "cannot be decoded: {}", what); };
    BitReader bits(slice, subject_);
    SelectorHistory history(history_size_);
    const std::size_t first_of_history = selectors_.size(), run_of_history = first_of_history + history_size_;
    std::vector<std::uint32_t> above(
        columns);  // endpoints of the blocks of the row above, replaced by those of this row
    std::vector<std::uint32_t> predictions(columns);  // predictions of 2 x 2 blocks, those of the lower row
    std::uint32_t last_prediction = 0, prediction_run = 0, selector_run = 0, last_endpoint = 0;
    for (std::size_t y = 0; y < rows; ++y) {
        std::uint32_t prediction = 0, above_left = 0;
        for (std::size_t x = 0; x < columns; ++x, prediction >>= 2) {
            if (x % 2 == 0 && y % 2 == 1) prediction = predictions[x / 2];
            if (x % 2 == 0 && y % 2 == 0) {
                if (prediction_run > 0) {
                    --prediction_run;
                } else if (const std::uint32_t symbol = endpoint_prediction_.decode(bits); symbol < kRepeatPrediction) {
                    last_prediction = symbol;
                } else {
                    if (symbol > kRepeatPrediction) fail("a prediction is unknown");
                    prediction_run = read_chunks(bits, 4) + kShortestRun - 1;
                }
                prediction = last_prediction;
                predictions[x / 2] = prediction >> 4;
            }
            std::uint32_t endpoint = last_endpoint;
            switch (prediction & 3) {
                case 0:
                    if (x == 0) fail("a block refers to a block outside the picture");
                    break;
                case 1:
                    if (y == 0) fail("a block refers to a block outside the picture");
                    endpoint = above[x];
                    break;
                case 2:
                    if (x == 0 || y == 0) fail("a block refers to a block outside the picture");
                    endpoint = above_left;
                    break;
                default:
                    endpoint += endpoint_delta_.decode(bits);
                    if (endpoint >= endpoints_.size()) endpoint -= static_cast<std::uint32_t>(endpoints_.size());
            }
            if (endpoint >= endpoints_.size()) fail("a block's endpoint is not in the codebook");
            above_left = std::exchange(above[x], endpoint);
            last_endpoint = endpoint;

            std::size_t selector = first_of_history;
            if (selector_run > 0) {
                --selector_run;
            } else if (selector = selector_.decode(bits); selector == run_of_history) {
                const std::uint32_t run = selector_run_.decode(bits);
                selector_run = (run == kLongRun ? read_chunks(bits, 7) : run) + kShortestRun - 1;
                selector = first_of_history;
            }
            if (selector < first_of_history) {
                history.add(static_cast<std::uint32_t>(selector));
            } else {
                if (selector - first_of_history >= history.size()) fail("a block's selector is not in the codebook");
                selector = history.use(selector - first_of_history);
            }
            if (selector >= selectors_.size()) fail("a block's selector is not in the codebook");
            store(x, y, endpoint, selector);
        }
    }
}

void Etc1sDecoder::decode_color(std::string_view slice, std::size_t width, std::size_t height,
                                std::uint8_t* rgba) const {
    decode_blocks(slice, (width + 3) / 4, (height + 3) / 4, [&](std::size_t bx, std::size_t by, auto e, auto s) {
        const std::array<Rgb, 4> colors = colors_of(endpoints_[e]);
        for (std::size_t y = 4 * by; y < std::min(4 * by + 4, height); ++y)
            for (std::size_t x = 4 * bx; x < std::min(4 * bx + 4, width); ++x)
                std::ranges::copy(colors[selectors_[s][y % 4] >> 2 * (x % 4) & 3], rgba + 4 * (y * width + x));
    });
}

void Etc1sDecoder::decode_channel(std::string_view slice, std::size_t width, std::size_t height, std::size_t channel,
                                  std::uint8_t* rgba) const {
    decode_blocks(slice, (width + 3) / 4, (height + 3) / 4, [&](std::size_t bx, std::size_t by, auto e, auto s) {
        const std::array<Rgb, 4> colors = colors_of(endpoints_[e]);
        for (std::size_t y = 4 * by; y < std::min(4 * by + 4, height); ++y)
            for (std::size_t x = 4 * bx; x < std::min(4 * bx + 4, width); ++x)
                rgba[4 * (y * width + x) + channel] = colors[selectors_[s][y % 4] >> 2 * (x % 4) & 3][0];
    });
}

}  // namespace halflight
