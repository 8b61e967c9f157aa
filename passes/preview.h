// Modes that make a picture of few samples look better than its samples are. They are biases: off unless asked for, and
// named wherever such a picture goes.
#pragma once

#include <string>
#include <string_view>

namespace halflight {

struct Preview {
    bool temporal = false;  // light of earlier pictures is kept, where a PictureHistory has it (passes/temporal.h)
    bool filter = false;    // noise is filtered out of reflected light (passes/denoise.h)
    bool any() const { return temporal || filter; }
    bool operator==(const Preview&) const = default;
};

/// The modes that are on, joined by commas; "none".
std::string text(const Preview& preview);
/// Of such a list. Throws Error, with the list as its subject, where a name is none or is given twice.
Preview preview_named(std::string_view list);
/// "temporal, filter", for helps.
std::string known_previews();

}  // namespace halflight
