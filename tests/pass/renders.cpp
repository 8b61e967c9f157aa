#include "tests/pass/renders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "engine/core/statistics.h"

namespace halflight::test {

RenderSettings small_settings(const Camera& camera, int width, int height, int samples, int bounces) {
    RenderSettings s;
    s.width = width, s.height = height;
    s.camera = camera;
    s.samples = samples;
    s.bounces = bounces;
    s.aovs = {"emission", "direct_diffuse", "direct_glossy", "indirect_diffuse", "indirect_glossy", "variance"};
    return s;
}

RenderSettings all_settings(const Scene& scene, int width, int height, int samples) {
    RenderSettings s = small_settings(scene.cameras[0], width, height, samples, 4);
    s.aovs.clear();
    for (const AovInfo& a : known_aovs())
        if (a.in_all()) s.aovs.emplace_back(a.name);
    s.want_view = true;
    return s;
}

RenderResult render(gpu::Context& context, const Scene& scene, const RenderSettings& settings) {
    return Renderer(context, scene, ColorConfig::load(), settings).render();
}

const Image& layer(const RenderResult& result, std::string_view channel) {
    for (const ExrLayer& l : result.aovs)
        if (std::find(l.channels.begin(), l.channels.end(), channel) != l.channels.end()) return l.image;
    throw std::out_of_range(std::string(channel));
}

void expect_same(const RenderResult& a, const RenderResult& b) {
    EXPECT_TRUE(same_bits(a.beauty, b.beauty));
    EXPECT_TRUE(same_bits(a.view, b.view));
    ASSERT_EQ(a.aovs.size(), b.aovs.size());
    for (std::size_t i = 0; i < a.aovs.size(); ++i)
        EXPECT_TRUE(same_bits(a.aovs[i].image, b.aovs[i].image)) << a.aovs[i].channels[0];
}

void expect_includes(const RenderResult& a, const RenderResult& b) {
    EXPECT_TRUE(same_bits(a.beauty, b.beauty));
    EXPECT_TRUE(same_bits(a.view, b.view));
    for (const ExrLayer& wanted : b.aovs)
        EXPECT_TRUE(same_bits(layer(a, wanted.channels[0]), wanted.image)) << wanted.channels[0];
}

MeanValue mean_radiance(const RenderResult& result, int channel) {
    const Image& variances = layer(result, "variance.R");
    const double count = static_cast<double>(variances.width) * variances.height;
    double sum = 0, variance = 0;
    for (int y = 0; y < variances.height; ++y) {
        for (int x = 0; x < variances.width; ++x) {
            sum += result.beauty.at(x, y)[channel];
            variance += variances.at(x, y)[channel];
        }
    }
    return {sum / count, std::sqrt(variance) / count};
}

MeanValue mean_of_pixels(const Image& image, int channel) {
    RunningMoments moments;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) moments.add(image.at(x, y)[channel]);
    return {moments.mean(), moments.standard_error()};
}

}  // namespace halflight::test
