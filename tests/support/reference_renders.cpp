#include "tests/support/reference_renders.h"

#include <cmath>

namespace halflight::test {

ReferenceResult render_oracle(const Scene& scene, const Camera& camera, int size, int samples, int bounces,
                              std::uint64_t seed) {
    ReferenceSettings settings;
    settings.width = settings.height = size;
    settings.samples = samples;
    settings.bounces = bounces;
    settings.camera = camera;
    settings.seed = seed;
    return render_reference(ReferenceScene(scene), settings);
}

MeanRadiance mean_radiance(const ReferenceResult& result, int channel) {
    double sum = 0, variance = 0;
    for (int y = 0; y < result.beauty.height; ++y) {
        for (int x = 0; x < result.beauty.width; ++x) {
            sum += result.beauty.at(x, y)[channel];
            variance += result.variance.at(x, y)[channel] / result.samples;
        }
    }
    const double count = static_cast<double>(result.beauty.width) * result.beauty.height;
    return {sum / count, std::sqrt(variance) / count};
}

}  // namespace halflight::test
