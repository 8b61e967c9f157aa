// Modes that make a picture of few samples look better than its samples are. They are biases: off unless asked for, and
// named wherever such a picture goes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace halflight {

struct Preview {
    bool cache = false;  // the first samples end their paths in a radiance cache (passes/light/radiance_cache.h)
    bool temporal =
        false;  // light of earlier pictures is kept, where a PictureHistory has it (passes/preview/temporal.h)
    bool filter = false;  // noise is filtered out of reflected light (passes/preview/denoise.h)
    bool any() const { return cache || of_picture(); }
    bool of_picture() const { return temporal || filter; }  ///< made of the whole one (renderer/preview_picture.h)
    bool operator==(const Preview&) const = default;
};

/// The modes that are on, joined by commas; "none".
std::string text(const Preview& preview);
/// Of such a list. Throws Error, with the list as its subject, where a name is unknown or given twice, or "none" is not
/// alone.
Preview preview_named(std::string_view list);
/// "cache, temporal, filter", for helps.
std::string known_previews();

/// What a radiance cache holds.
struct CacheStatistics {
    std::size_t cells = 0;    // in all
    std::size_t used = 0;     // of them
    std::size_t mature = 0;   // in which paths end
    std::size_t refused = 0;  // times that a path of the last picture found no cell of one of its lengths
};

}  // namespace halflight
