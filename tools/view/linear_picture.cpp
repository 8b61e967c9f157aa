#include "tools/view/linear_picture.h"

#include "engine/core/chromaticities.h"
#include "engine/core/error.h"
#include "engine/core/math.h"
#include "engine/io/exr.h"

namespace halflight::view {

Image read_linear(const std::filesystem::path& path) {
    const ExrFile file = read_exr(path, limits_of_renders());
    Image image = file.displayed({"R", "G", "B"});
    const auto& space = file.attributes.chromaticities;
    if (!space || same_space(*space, kRec709)) return image;
    const mat3 to_rec709(rgb_conversion(*space, kRec709));
    for (int i = 0; i < 3; ++i)
        if (!all_finite(to_rec709[i])) throw Error(path.string(), "is damaged: its chromaticities span no colours");
    for (std::size_t i = 0; i + 3 <= image.pixels.size(); i += 3) {
        const vec3 color = to_rec709 * vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]);
        for (int c = 0; c < 3; ++c) image.pixels[i + static_cast<std::size_t>(c)] = color[c];
    }
    return image;
}

}  // namespace halflight::view
