// Stiff and extreme scenes whose answer is known from analysis or from an invariance. Each case is recorded with its
// figure and its bound; tools/stiff-report prints them all.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/statistics.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/reference_renders.h"

namespace halflight::test {

/// What holds: figure <= bound.
struct StiffCase {
    std::string theme;
    std::string name;
    double figure = 0;
    double bound = 0;
    std::string unit;
    std::string reason;                             // for the bound
    bool holds() const { return figure <= bound; }  // false for NaN
};
/// Of all tests so far, in the order in which they were run.
const std::vector<StiffCase>& stiff_cases();

class StiffTest : public GpuTest {
  protected:
    /// Records the case under the test suite's name and fails the test where it does not hold.
    static void expect(const std::string& name, double figure, double bound, const std::string& unit,
                       const std::string& reason);
    /// Mean of an estimate with its standard error: within 4 standard errors, and `systematic`, of `exact`. The
    /// estimate must be worth something: known to +- 2 % with 95 % confidence.
    static void expect_mean(const std::string& name, const MeanValue& found, double exact, double systematic = 0,
                            const std::string& systematic_reason = "");

    /// Renders a picture and fails the test where a pass gave a NaN, an infinity or a negative radiance.
    RenderResult picture(const Scene& scene, const RenderSettings& settings);
    RenderResult picture(const Scene& scene, const Camera& camera, int size, int samples, int bounces) {
        return picture(scene, small_settings(camera, size, size, samples, bounces));
    }
};

/// A name in the tests' folder for temporary files; what is there in the end is removed.
struct TemporaryFile {
    explicit TemporaryFile(const std::string& name);
    ~TemporaryFile();
    std::filesystem::path path;
};

/// Means over all pixels of the first channel.
MeanValue mean_of(const RenderResult& result);
MeanValue mean_of(const ReferenceResult& result);
/// Means over pixels [x0, x1) x [y0, y1), with the error from the pixels' own variances.
MeanValue mean_of(const RenderResult& result, int x0, int x1, int y0, int y1);

/// Pixels that differ in any bit of any channel.
double pixels_that_differ(const Image& a, const Image& b);
/// Pixels of which any channel is further from the other picture's than `tolerance` times that.
double share_beyond(const Image& a, const Image& b, double tolerance);
/// Pixels whose first channel is not `value`.
double pixels_other_than(const Image& image, float value);

/// Irradiance on a plane of unit normal `n` at `p` from a polygon of unit radiance that lies above the plane (Lambert
/// 1760; Baum, Rushmeier, Winget 1989, eq. 3).
double polygon_irradiance(const dvec3& p, const dvec3& n, const std::vector<dvec3>& corners);

/// Instances, lamps and cameras scaled about the origin or moved. Radiances stay, and intensities of lamps grow with
/// the square of distances.
Scene scaled(Scene scene, double factor);
Scene moved(Scene scene, const dvec3& by);

}  // namespace halflight::test
