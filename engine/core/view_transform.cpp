#include "engine/core/view_transform.h"

#include <cmath>

namespace halflight {

float PhysicalCamera::stops() const {
    const double sensitivity = iso > 0 ? double(iso) : kUsualIso,
                 seconds = shutter_speed.seconds > 0 ? double(shutter_speed.seconds) : kUsualSeconds,
                 number = lens.fstop > 0 ? double(lens.fstop) : kUsualFstop;
    const double ev100 = std::log2(number * number / seconds * 100 / sensitivity);
    return static_cast<float>(-(ev100 + std::log2(1.2)));
}

}  // namespace halflight
