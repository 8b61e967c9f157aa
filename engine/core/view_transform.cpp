#include "engine/core/view_transform.h"

#include <cmath>

namespace halflight {

float PhysicalCamera::stops() const {
    const double sensitivity = iso > 0 ? double(iso) : 100,
                 seconds = shutter_speed.seconds > 0 ? double(shutter_speed.seconds) : 1.0 / 125,
                 number = lens.fstop > 0 ? double(lens.fstop) : 16;
    const double ev100 = std::log2(number * number / seconds * 100 / sensitivity);
    return static_cast<float>(-(ev100 + std::log2(1.2)));
}

}  // namespace halflight
