// Preview modes, which improve pictures of few samples at the price of a bias. They are off by default, except in the
// viewer, and named in every file of such a picture.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace halflight {

struct Preview {
    bool cache = false;     // first samples end their paths in a radiance cache (passes/light/radiance_cache.h)
    bool temporal = false;  // reuses light of earlier pictures in a PictureHistory (passes/preview/temporal.h)
    bool filter = false;    // denoises reflected light (add_preview_filter() of passes/picture/denoiser.h)
    bool any() const { return cache || of_picture(); }
    bool of_picture() const { return temporal || filter; }  ///< Returns whether whole pictures are changed.
    bool operator==(const Preview&) const = default;
};

/// A preview mode with its name and label.
struct PreviewMode {
    const char* name;
    const char* description;  // label of the mode's check box
    bool Preview::*flag;
};
std::span<const PreviewMode> known_preview_modes();

/// Returns the names of the enabled modes, joined by commas; "none" if there is none.
std::string text(const Preview& preview);
/// Parses a list like that of text(). Throws Error, with the list as its subject, for unknown and repeated names, and
/// for "none" beside other names.
Preview preview_named(std::string_view list);
/// Returns "cache, temporal, filter" for help texts.
std::string known_previews();

/// Contents of a radiance cache.
struct CacheStatistics {
    std::size_t cells = 0;    // number of all cells
    std::size_t used = 0;     // number of cells that hold radiance
    std::size_t mature = 0;   // number of cells in which paths end
    std::size_t refused = 0;  // number of paths of the last picture that found no cell for one of their lengths
};

}  // namespace halflight
