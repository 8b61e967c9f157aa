#include "engine/settings/denoiser_windows.h"

#include <algorithm>

namespace halflight {

std::vector<DenoiserWindow> denoiser_windows(const Optics& optics, const ivec2& whole, const PixelWindow& rendered) {
    const ivec2 eyes(eyes_in_picture(optics)), size = whole / eyes;
    std::vector<DenoiserWindow> windows;
    for (int y = 0; y < eyes.y; ++y) {
        for (int x = 0; x < eyes.x; ++x) {
            // Pixels beyond the edges of the whole picture belong to the nearest eye.
            const PixelWindow eye{ivec2(x, y) * size, ivec2(x + 1, y + 1) * size};
            PixelWindow part = eye;
            if (x == 0) part.first.x = rendered.first.x;
            if (y == 0) part.first.y = rendered.first.y;
            if (x + 1 == eyes.x) part.end.x = rendered.end.x;
            if (y + 1 == eyes.y) part.end.y = rendered.end.y;
            part = {glm::max(part.first, rendered.first), glm::min(part.end, rendered.end)};
            if (part.size().x <= 0 || part.size().y <= 0) continue;
            const bool ring =
                optics.projection == Projection::panorama && part.first.x == eye.first.x && part.end.x == eye.end.x;
            windows.push_back({part.first - rendered.first, part.size(), ring ? std::min(kDenoiserReach, size.x) : 0});
        }
    }
    return windows;
}

}  // namespace halflight
