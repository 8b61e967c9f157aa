// The size of an encoded image.
#pragma once

#include <cstddef>

namespace halflight {

struct ImageHeader {
    std::size_t width = 0, height = 0;  // texels
    std::size_t decoding_bytes = 0;     // bytes that decoding takes besides the texels and the file
};

}  // namespace halflight
