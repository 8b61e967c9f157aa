// Visibility of back faces.
#pragma once

#include <cstdint>

namespace halflight {

/// Rays that pass the back faces of single-sided materials (SHADING.md, Surfaces).
enum class Backfaces : std::uint8_t {
    automatic,  // camera rays, and rays that continue them through perfect mirrors and clear glass
    cull,       // all rays, shadow rays included
    show,       // none
};

}  // namespace halflight
