#include "engine/settings/frame_settings.h"

namespace halflight {

const char* name(ErrorMetric metric) {
    return metric == ErrorMetric::mse ? "mse" : "relmse";
}

}  // namespace halflight
