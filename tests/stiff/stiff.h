// Records stiff cases: extreme scenes whose result is known from analysis or from an invariance. Each case has a figure
// and a bound; tools/checks/stiff-report prints all cases.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/statistics.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/reference_renders.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {

/// Record of a case, which passes if figure <= bound.
struct StiffCase {
    std::string theme;
    std::string name;
    double figure = 0;
    double bound = 0;
    std::string unit;
    std::string reason;                             // reason for the bound
    bool holds() const { return figure <= bound; }  // false for NaN
};
/// Returns all cases so far, in order of execution.
const std::vector<StiffCase>& stiff_cases();

class StiffTest : public GpuTest {
  protected:
    /// Records the case under the name of the test suite, and fails the test if the case does not pass.
    static void expect(const std::string& name, double figure, double bound, const std::string& unit,
                       const std::string& reason);
    /// Expects an estimate within 4 standard errors plus `systematic` of `exact`. The estimate must be precise: +- 2 %
    /// at 95 % confidence.
    static void expect_mean(const std::string& name, const MeanValue& found, double exact, double systematic = 0,
                            const std::string& systematic_reason = "");

    /// Expects the mean of a square picture by the engine, and by the oracle at `oracle_size`, of 64 samples.
    void expect_both(const std::string& name, const Scene& scene, const Camera& camera, int size, int oracle_size,
                     int bounces, double exact, double systematic = 0, const std::string& systematic_reason = "");

    /// Renders a picture and fails the test if a pass produced a NaN, an infinity or a negative radiance.
    RenderResult picture(const Scene& scene, const RenderSettings& settings);
    RenderResult picture(const Scene& scene, const Camera& camera, int size, int samples, int bounces) {
        return picture(scene, small_settings(camera, size, size, samples, bounces));
    }
};

/// The one of several figures that is nearest to its bound, or farthest beyond it.
struct Worst {
    double figure = 0;
    double bound = 1;
    void add(double other, double other_bound) {
        if (other / other_bound >= figure / bound) figure = other, bound = other_bound;
    }
};

/// Returns the mean of the first channel over all pixels.
MeanValue mean_of(const RenderResult& result);
MeanValue mean_of(const ReferenceResult& result);
/// Returns the mean over pixels [x0, x1) x [y0, y1); its error comes from the pixels' variances.
MeanValue mean_of(const RenderResult& result, int x0, int x1, int y0, int y1);

/// Returns the greatest value of an image, over all channels.
double brightest(const Image& image);
/// Returns the number of pixels that differ in any bit of any channel.
double pixels_that_differ(const Image& a, const Image& b);
/// Returns the share of pixels with a channel whose difference exceeds `tolerance` times the value in the other
/// picture.
double share_beyond(const Image& a, const Image& b, double tolerance);
/// Returns the number of pixels whose first channel is not `value`.
double pixels_other_than(const Image& image, float value);

/// Returns the irradiance on a plane with unit normal `n` at `p` from a polygon of unit radiance above the plane
/// (Lambert 1760; Baum, Rushmeier, Winget 1989, eq. 3).
double polygon_irradiance(const dvec3& p, const dvec3& n, const std::vector<dvec3>& corners);

/// Scales or moves instances, lamps and cameras about the origin. Radiances stay equal; intensities of lamps are scaled
/// by the square of distances.
Scene scaled(Scene scene, double factor);
Scene moved(Scene scene, const dvec3& by);

/// Returns load(FILE) of a GltfBuilder's file in a temporary folder, where `load` is load_gltf() or makes a GltfScene.
template <class Builder, class F>
auto loaded(const Builder& builder, const F& load) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder / "scene.glb";
    std::ofstream(file, std::ios::binary) << builder.glb();
    return load(file);
}

}  // namespace halflight::test
