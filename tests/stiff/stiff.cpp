#include "tests/stiff/stiff.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace halflight::test {
namespace {

std::vector<StiffCase>& cases() {
    static std::vector<StiffCase> all;
    return all;
}

template <class F>
double count_pixels(const Image& image, F&& f) {
    double count = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) count += f(x, y);
    return count;
}

}  // namespace

const std::vector<StiffCase>& stiff_cases() {
    return cases();
}

void StiffTest::expect(const std::string& name, double figure, double bound, const std::string& unit,
                       const std::string& reason) {
    const std::string suite = testing::UnitTest::GetInstance()->current_test_info()->test_suite_name();
    const StiffCase& c = cases().emplace_back(StiffCase{suite, name, figure, bound, unit, reason});
    EXPECT_TRUE(c.holds()) << name << ": " << figure << " " << unit << ", bound " << bound << " (" << reason << ")";
}

void StiffTest::expect_mean(const std::string& name, const MeanValue& found, double exact, double systematic,
                            const std::string& systematic_reason) {
    EXPECT_LE(1.96 * found.error, 0.02 * exact) << name << ": the test says nothing";
    expect(name, std::abs(found.value - exact) / exact, 4 * found.error / exact + systematic, "of the mean",
           "four standard errors" + (systematic > 0 ? ", and " + systematic_reason : ""));
}

void StiffTest::expect_both(const std::string& name, const Scene& scene, const Camera& camera, int size,
                            int oracle_size, int bounces, double exact, double systematic,
                            const std::string& systematic_reason) {
    expect_mean(name, mean_of(picture(scene, camera, size, 64, bounces)), exact, systematic, systematic_reason);
    expect_mean(name + ", oracle", mean_of(render_oracle(scene, camera, oracle_size, 64, bounces)), exact, systematic,
                systematic_reason);
}

RenderResult StiffTest::picture(const Scene& scene, const RenderSettings& settings) {
    RenderResult result = render(context, scene, settings);
    for (const BadValues& bad : result.stats.bad_values)
        EXPECT_EQ(bad.total(), 0u) << bad.component << ": " << bad.nans << " NaN, " << bad.infinities << " infinite, "
                                   << bad.negatives << " negative";
    const NonFinite beauty = count_non_finite(result.beauty);
    EXPECT_EQ(beauty.nans + beauty.infinities, 0u);
    return result;
}

MeanValue mean_of(const RenderResult& result) {
    return mean_radiance(result, 0);
}

MeanValue mean_of(const ReferenceResult& result) {
    const MeanRadiance mean = mean_radiance(result, 0);
    return {mean.value, mean.error};
}

MeanValue mean_of(const RenderResult& result, int x0, int x1, int y0, int y1) {
    const Image& variances = layer(result, "variance.R");
    const double count = static_cast<double>(x1 - x0) * (y1 - y0);
    double sum = 0, variance = 0;
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            sum += *result.beauty.at(x, y);
            variance += *variances.at(x, y);
        }
    }
    return {sum / count, std::sqrt(variance) / count};
}

double brightest(const Image& image) {
    return *std::ranges::max_element(image.pixels);
}

double pixels_that_differ(const Image& a, const Image& b) {
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(a.channels);
    return count_pixels(a, [&](int x, int y) { return std::memcmp(a.at(x, y), b.at(x, y), bytes) != 0; });
}

double share_beyond(const Image& a, const Image& b, double tolerance) {
    EXPECT_EQ(a.pixels.size(), b.pixels.size());
    const double count = count_pixels(a, [&](int x, int y) {
        bool beyond = false;
        for (int c = 0; c < a.channels; ++c)
            beyond |= !(std::abs(a.at(x, y)[c] - b.at(x, y)[c]) <= tolerance * std::abs(b.at(x, y)[c]));
        return beyond;
    });
    return count / a.width / a.height;
}

double pixels_other_than(const Image& image, float value) {
    return count_pixels(image, [&](int x, int y) { return *image.at(x, y) != value; });
}

double polygon_irradiance(const dvec3& p, const dvec3& n, const std::vector<dvec3>& corners) {
    dvec3 sum(0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const dvec3 a = glm::normalize(corners[i] - p), b = glm::normalize(corners[(i + 1) % corners.size()] - p);
        const dvec3 across = glm::cross(a, b);
        const double sine = glm::length(across);
        if (sine > 0) sum += std::atan2(sine, glm::dot(a, b)) / sine * across;
    }
    return 0.5 * std::abs(glm::dot(sum, n));
}

Scene scaled(Scene scene, double factor) {
    dmat4 grow(factor);
    grow[3][3] = 1;
    for (Instance& i : scene.instances) i.object_to_world = grow * i.object_to_world;
    for (Camera& c : scene.cameras) {
        c.camera_to_world[3] = grow * c.camera_to_world[3];
        c.ortho_height *= factor;
    }
    for (PunctualLight& l : scene.lights) {
        l.position *= factor;
        if (l.type != LightType::directional) l.intensity *= static_cast<float>(factor * factor);
    }
    return scene;
}

Scene moved(Scene scene, const dvec3& by) {
    for (Instance& i : scene.instances) i.object_to_world[3] += dvec4(by, 0);
    for (Camera& c : scene.cameras) c.camera_to_world[3] += dvec4(by, 0);
    for (PunctualLight& l : scene.lights) l.position += by;
    return scene;
}

}  // namespace halflight::test
