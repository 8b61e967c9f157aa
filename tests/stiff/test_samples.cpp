// Tests adaptive sampling where errors are extreme: none at all, infinite, or in one block alone.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "engine/core/metrics.h"
#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

class Samples : public StiffTest {
  protected:
    RenderResult adaptive(const Scene& scene, const Camera& camera, int size, int samples,
                          const std::optional<ErrorTarget>& error = {}) {
        RenderSettings settings = small_settings(camera, size, size, samples, 4);
        settings.aovs.emplace_back("samples");
        settings.adaptive = true;
        settings.error = error;
        return picture(scene, settings);
    }
    /// Expects that the numbers of samples have about the mean `samples`.
    static void expect_all(const std::string& name, const RenderResult& result, int samples) {
        const double mean = halflight::mean_of(layer(result, "samples.Y"));
        expect(name + ", number of samples", std::abs(std::log2(mean / samples)), 0.5, "doublings",
               "a block has a power of two");
    }
};

TEST_F(Samples, NothingIsNoisy) {
    Scene scene;
    scene.environment.color = vec3(3);
    scene.cameras = {spot_camera(dvec3(0), {0, 0, -1}, 1)};
    const RenderResult result = adaptive(scene, scene.cameras[0], 32, 21);
    expect("even sky", pixels_other_than(result.beauty, 3), 0, "pixels", "all samples are equal");
    expect_all("even sky", result, 21);
}

TEST_F(Samples, LampsOfAnyRadiance) {
    std::map<std::string, double> relative;                      // standard error over mean
    for (const float radiance : {1e-12f, 1.0f, 1e18f, 1e30f}) {  // the variance of the last one is beyond floats
        Scene scene = cornell_box();
        for (Material& material : scene.materials)
            if (material.emission != vec3(0)) material.emission = vec3(radiance);
        const std::string lamp = fmt::format("lamp of radiance {:g}", radiance);
        const RenderResult even = picture(scene, scene.cameras[0], 48, 64, 4);
        const auto expect_mean_of_even = [&](const std::string& by, const RenderResult& result) {
            const double difference = std::abs(mean_of(result).value / mean_of(even).value - 1);
            if (radiance < 1e30f)
                relative[by] = std::hypot(mean_of(result).error, mean_of(even).error) / mean_of(even).value;
            expect(lamp + by, difference / relative[by], 4, "standard errors",
                   "adaptive and even samples have the same mean");
        };
        const RenderResult result = adaptive(scene, scene.cameras[0], 48, 32);
        expect_mean_of_even("", result);
        expect_all(lamp, result, 32);
        for (const ErrorMetric metric : {ErrorMetric::relmse, ErrorMetric::mse}) {
            const std::string by = fmt::format(", {} below 1e-12", name(metric));
            const RenderResult to_error = adaptive(scene, scene.cameras[0], 48, 64, ErrorTarget{metric, 1e-12});
            expect_mean_of_even(by, to_error);
            expect(lamp + by + ", finite estimate", std::isfinite(to_error.stats.error->estimate.upper) ? 0 : 1, 0, "",
                   "errors are sums of doubles");
            const bool dark = radiance < 1;  // both errors are below the target at once
            expect(lamp + by + ", reached", to_error.stats.error->reached == dark ? 0 : 1, 0, "",
                   "the smallest target is met in the dark alone");
            if (!dark) expect_all(lamp + by, to_error, 64);
        }
    }
}

TEST_F(Samples, OnePixel) {
    const Scene scene = cornell_box();
    const RenderResult result = adaptive(scene, scene.cameras[0], 1, 64);
    expect_all("one pixel", result, 64);
}

}  // namespace
}  // namespace halflight::test
