#include "tools/view/linear_picture.h"

#include <algorithm>
#include <cmath>

#include "engine/core/chromaticities.h"
#include "engine/core/error.h"
#include "engine/core/math.h"
#include "engine/io/exr.h"

namespace halflight::view {

Image read_linear(const std::filesystem::path& path) {
    const ExrFile file = read_exr(path);
    Image image = file.image({"R", "G", "B"});
    if (!file.attributes.chromaticities) return image;
    const mat3 to_rec709(rgb_conversion(*file.attributes.chromaticities, kRec709));
    for (int i = 0; i < 3; ++i)
        if (!all_finite(to_rec709[i])) throw Error(path.string(), "is damaged: its chromaticities span no colours");
    float change = 0;
    for (int i = 0; i < 9; ++i) change = std::max(change, std::abs(to_rec709[i / 3][i % 3] - mat3(1)[i / 3][i % 3]));
    constexpr float kRounding = 1e-3f;  // files round primaries
    if (change < kRounding) return image;
    for (std::size_t i = 0; i + 3 <= image.pixels.size(); i += 3) {
        const vec3 color = to_rec709 * vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]);
        for (int c = 0; c < 3; ++c) image.pixels[i + static_cast<std::size_t>(c)] = color[c];
    }
    return image;
}

}  // namespace halflight::view
