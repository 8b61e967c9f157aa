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

/// Radiance of lamps. The variance of the last one is beyond floats.
constexpr float kRadiance[] = {1e-12f, 1.0f, 1e18f, 1e30f};

TEST_F(Samples, LampsOfAnyRadiance) {
    double relative = 0;  // standard error over mean
    for (const float radiance : kRadiance) {
        Scene scene = cornell_box();
        for (Material& material : scene.materials)
            if (material.emission != vec3(0)) material.emission = vec3(radiance);
        const RenderResult result = adaptive(scene, scene.cameras[0], 48, 32);
        const RenderResult even = picture(scene, small_settings(scene.cameras[0], 48, 48, 32, 4));
        const double difference = std::abs(mean_of(result).value / mean_of(even).value - 1);
        if (radiance < 1e30f) relative = std::hypot(mean_of(result).error, mean_of(even).error) / mean_of(even).value;
        const std::string name = fmt::format("lamp of radiance {:g}", radiance);
        expect(name, difference / relative, 4, "standard errors", "adaptive and even samples have the same mean");
        expect_all(name, result, 32);
    }
}

TEST_F(Samples, ErrorsOfLampsOfAnyRadiance) {
    std::map<ErrorMetric, double> relative;  // standard error over mean
    for (const float radiance : kRadiance) {
        Scene scene = cornell_box();
        for (Material& material : scene.materials)
            if (material.emission != vec3(0)) material.emission = vec3(radiance);
        const RenderResult even = picture(scene, small_settings(scene.cameras[0], 48, 48, 64, 4));
        for (const ErrorMetric metric : {ErrorMetric::relmse, ErrorMetric::mse}) {
            const RenderResult result = adaptive(scene, scene.cameras[0], 48, 64, ErrorTarget{metric, 1e-12});
            const double difference = std::abs(mean_of(result).value / mean_of(even).value - 1);
            if (radiance < 1e30f)
                relative[metric] = std::hypot(mean_of(result).error, mean_of(even).error) / mean_of(even).value;
            const std::string case_name = fmt::format("lamp of radiance {:g}, {} below 1e-12", radiance, name(metric));
            expect(case_name, difference / relative[metric], 4, "standard errors",
                   "adaptive and even samples have the same mean");
            expect(case_name + ", finite estimate", std::isfinite(result.stats.error->estimate.upper) ? 0 : 1, 0, "",
                   "errors are sums of doubles");
            const bool dark = radiance < 1;  // both errors are below the target at once
            expect(case_name + ", reached", result.stats.error->reached == dark ? 0 : 1, 0, "",
                   "the smallest target is met in the dark alone");
            if (!dark) expect_all(case_name, result, 64);
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
