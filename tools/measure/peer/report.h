// An agreement in words, as JSON and as a picture.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "engine/color/color.h"
#include "tools/measure/peer/agreement.h"

namespace halflight::peer {

/// Lines: the whole picture, the blocks, how many are beyond and how many noise alone would put there, the worst ones.
std::string text(const Agreement& agreement);
nlohmann::json json(const Agreement& agreement);

/// Display-encoded, to be looked at, left to right: ours, theirs, and their relative difference by pixel and by block,
/// from blue at minus `scale` (theirs is darker) over white to red at plus `scale`; grey where there is no telling.
Image picture(const Image& ours, const Image& theirs, const Agreement& agreement, const ViewProcessor& view,
              double scale);

}  // namespace halflight::peer
