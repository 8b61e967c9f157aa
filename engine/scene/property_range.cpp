#include "engine/scene/property_range.h"

#include <fmt/format.h>

#include <cmath>

namespace halflight {

std::string range_error(const PropertyRange& range, float value) {
    if (value >= range.lowest && value <= range.highest && std::isfinite(value)) return {};
    const bool below = std::isinf(range.lowest), above = std::isinf(range.highest);
    if (!below && !above) return fmt::format("{} is outside [{}, {}]", value, range.lowest, range.highest);
    return below ? fmt::format("{} is not finite", value)
                 : fmt::format("{} is below {} or not finite", value, range.lowest);
}

}  // namespace halflight
