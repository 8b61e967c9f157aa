#include "engine/settings/frame_settings.h"

#include <algorithm>

namespace halflight {

const char* name(ErrorMetric metric) {
    return metric == ErrorMetric::mse ? "mse" : "relmse";
}

FrameSettings settings_of_part(const FrameSettings& settings, int number) {
    const auto begin = [&](int k) {
        return static_cast<int>(std::int64_t{k} * settings.samples / std::max(settings.parts, 1));
    };
    FrameSettings part = settings;
    part.part = number;
    part.first_sample = begin(number - 1);
    part.samples = begin(number) - part.first_sample;
    part.of_samples = settings.samples;
    return part;
}

}  // namespace halflight
