// Decoding of ETC1S with BasisLZ, a compressed texture format of KTX2 (KTX 2.0, "BasisLZ Global Data" and
// "BasisLZ/ETC1S Bitstream Specification"; Khronos Data Format Specification 1.4, section 21.1).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/bit_reader.h"

namespace halflight {

/// Compressed parts of the codebooks that all slices of a file share.
struct Etc1sSource {
    std::size_t endpoint_count = 0;
    std::size_t selector_count = 0;
    std::string_view endpoints;
    std::string_view selectors;
    std::string_view tables;
};

class Etc1sDecoder {
  public:
    /// Reads the codebooks. Throws Error with `subject`, as decode() does.
    Etc1sDecoder(const Etc1sSource& source, const std::string& subject);

    /// Decodes a slice of width x height texels into R, G and B of an RGBA image.
    void decode_color(std::string_view slice, std::size_t width, std::size_t height, std::uint8_t* rgba) const;
    /// Decodes the R of a slice into a channel of an RGBA image.
    void decode_channel(std::string_view slice, std::size_t width, std::size_t height, std::size_t channel,
                        std::uint8_t* rgba) const;

  private:
    using Rgb = std::array<std::uint8_t, 3>;
    struct Endpoint {
        Rgb base{};              // 5 bits each
        std::uint8_t table = 0;  // intensity table, 0 to 7
    };
    using Selector = std::array<std::uint8_t, 4>;  // rows; texel x has bits 2x and 2x + 1

    void read_endpoints(const Etc1sSource& source);
    void read_selectors(const Etc1sSource& source);
    static std::array<Rgb, 4> colors_of(const Endpoint& endpoint);
    /// Calls store(block x, block y, endpoint, selector) for each block.
    template <class Store>
    void decode_blocks(std::string_view slice, std::size_t columns, std::size_t rows, const Store& store) const;

    std::string subject_;
    std::vector<Endpoint> endpoints_;
    std::vector<Selector> selectors_;
    HuffmanTable endpoint_prediction_;
    HuffmanTable endpoint_delta_;
    HuffmanTable selector_;
    HuffmanTable selector_run_;
    std::size_t history_size_ = 0;  // number of recent selectors that a slice can refer to
};

}  // namespace halflight
