#include "engine/settings/frame_settings.h"

#include <algorithm>
#include <cstdint>

#include "shaders/shared/sobol.h"

namespace halflight {

const char* name(ErrorMetric metric) {
    return metric == ErrorMetric::mse ? "mse" : "relmse";
}

FrameSettings settings_of_part(const FrameSettings& settings, int number, bool adaptive) {
    const auto begin = [&](int k) {
        return static_cast<int>(std::int64_t{k} * settings.samples / std::max(settings.parts, 1));
    };
    FrameSettings part = settings;
    part.part = number;
    part.samples = begin(number) - begin(number - 1);
    part.of_samples = settings.samples;
    if (adaptive || settings.error) {
        constexpr std::uint32_t kPart = 0x70617274;
        part.seed = shared::hash_combine(shared::hash_u32(settings.seed), kPart + static_cast<std::uint32_t>(number));
        if (part.error) part.error->error *= settings.parts;
    } else {
        part.first_sample += begin(number - 1);
    }
    return part;
}

}  // namespace halflight
