// Tests means of synthetic sums, and the view transform against OpenColorIO on the CPU.
#include "passes/picture/composite.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "shaders/shared/pixel_order.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

/// Sums per path; components that the frame leaves out are empty.
struct SumData {
    std::vector<double> emission, direct, indirect;
};

class CompositeTest : public PassTest {
  protected:
    struct Pictures {
        std::vector<float> beauty, view;
    };
    Pictures composite(const Band& band, const SumData& data, int samples, bool opaque, const ViewKernel* kernel) {
        graph::Graph graph;
        std::vector<std::unique_ptr<gpu::Buffer>> buffers;
        const auto import = [&](const std::vector<double>& values) {
            if (values.empty()) return graph::BufferHandle{};
            buffers.push_back(std::make_unique<gpu::Buffer>(gpu::Buffer::from("sums", values)));
            return graph.import_buffer("sums", *buffers.back());
        };
        Accumulated sums;
        sums.emission = import(data.emission);
        sums.direct = import(data.direct);
        sums.indirect = import(data.indirect);
        const Composite c = add_composite(graph, band, sums, samples, opaque, kernel);
        graph.output(c.beauty);
        EXPECT_EQ(bool(c.view), kernel != nullptr);
        if (c.view) graph.output(c.view);
        run(graph);
        return {executor.texture(c.beauty).read_float(),
                c.view ? executor.texture(c.view).read_float() : std::vector<float>{}};
    }

    SumData random_sums(const Band& band, bool with_direct, bool with_indirect) {
        SumData d;
        const auto fill = [&](std::vector<double>& v, std::size_t stride) {
            for (std::size_t i = 0; i < stride * band.paths(); ++i) v.push_back(std::pow(10, real(-6.0, 4.0)));
        };
        fill(d.emission, 4);
        if (with_direct) fill(d.direct, 6);
        if (with_indirect) fill(d.indirect, 6);
        for (std::size_t i = 0; i < band.paths(); ++i) d.emission[4 * i + 3] = std::floor(real(0, 8));
        return d;
    }
    double real(double lower, double upper) { return std::uniform_real_distribution(lower, upper)(random); }

    std::mt19937 random{5};
};

TEST_F(CompositeTest, TheBeautyIsTheMeanOfAllComponents) {
    const Band band{{37, 70}, 32, 32};
    for (const bool direct : {true, false}) {
        for (const bool indirect : {true, false}) {
            for (const bool opaque : {true, false}) {
                const SumData d = random_sums(band, direct, indirect);
                const std::vector<float> beauty = composite(band, d, 7, opaque, nullptr).beauty;
                ASSERT_EQ(beauty.size(), 37u * 32 * 4);
                for (unsigned y = 0; y < 32; ++y) {
                    for (unsigned x = 0; x < 37; ++x) {
                        const std::size_t path = shared::path_of_pixel({x, y}, band.tiles());
                        const float* found = &beauty[(y * 37 + x) * 4];
                        for (std::size_t c = 0; c < 3; ++c) {
                            double sum = d.emission[4 * path + c];
                            if (direct) sum += d.direct[6 * path + c] + d.direct[6 * path + 3 + c];
                            if (indirect) sum += d.indirect[6 * path + c] + d.indirect[6 * path + 3 + c];
                            ASSERT_NEAR(found[c], sum / 7, 0x1p-24 * sum / 7);  // error of one rounding to float
                        }
                        ASSERT_EQ(found[3], opaque ? 1 : static_cast<float>(d.emission[4 * path + 3] / 7));
                    }
                }
            }
        }
    }
}

/// Returns grey ramps, saturated colours, highlights, noise and negative values as emission sums of one sample.
SumData colours(const Band& band) {
    std::mt19937 random(9);
    SumData d;
    d.emission.resize(4 * band.paths());
    for (unsigned y = 0; y < static_cast<unsigned>(band.rows); ++y) {
        for (unsigned x = 0; x < static_cast<unsigned>(band.image.x); ++x) {
            const double level = std::pow(2, -12 + 24 * (x + 0.5) / band.image.x);
            double* c = &d.emission[4 * shared::path_of_pixel({x, y}, band.tiles())];
            for (unsigned i = 0; i < 3; ++i) {
                const bool primary = y < 8 && (y & (1u << i)) != 0;
                c[i] = y == 0   ? level
                       : y < 8  ? (primary ? level : 0)
                       : y == 8 ? -level
                       : y == 9 ? (i == x % 3 ? -0.1 * level : level)
                                : level * std::uniform_real_distribution(0.0, 1.0)(random);
            }
            c[3] = (x + y) % 3 == 0 ? 0 : 1;
        }
    }
    return d;
}

TEST_F(CompositeTest, EveryViewAgreesWithOpenColorIO) {
    const ColorConfig config = ColorConfig::load();
    const Band band{{96, 32}, 0, 32};
    const SumData d = colours(band);
    int views = 0;
    for (const std::string& display : config.displays()) {
        for (const std::string& view : config.views(display)) {
            for (const float exposure : {0.0f, -1.5f}) {
                SCOPED_TRACE(display + ", " + view + ", exposure " + std::to_string(exposure));
                const ViewProcessor processor = config.view({display, view, "", exposure});
                const ViewKernel kernel(processor);
                const Pictures p = composite(band, d, 1, false, &kernel);
                Image beauty(96, 32, 4);
                beauty.pixels = p.beauty;
                const Image expected = processor.apply(beauty);
                double worst = 0;
                for (std::size_t i = 0; i < p.view.size(); ++i) {
                    if (i % 4 == 3) {
                        ASSERT_EQ(p.view[i], beauty.pixels[i]) << "alpha";
                    } else {
                        worst = std::max(worst, std::abs(double(p.view[i]) - expected.pixels[i]));
                    }
                }
                // The bound allows about ten roundings of values up to 1. A display gamma of 2.4 additionally turns
                // differences of 2.5e-10 next to black into 1e-4.
                EXPECT_LT(worst, 1e-4);
                ++views;
            }
        }
    }
    EXPECT_GE(views, 4);
}

TEST_F(CompositeTest, ExposureIsInStops) {
    const ColorConfig config = ColorConfig::load();
    const Band band{{16, 16}, 0, 16};
    SumData d = colours(band);
    const ViewKernel two_stops(config.view({"", "", "", 2}));
    const std::vector<float> up = composite(band, d, 1, true, &two_stops).view;
    for (std::size_t i = 0; i < d.emission.size(); ++i) d.emission[i] *= i % 4 == 3 ? 1 : 4;
    const ViewKernel none(config.view({}));
    EXPECT_EQ(composite(band, d, 1, true, &none).view, up);
}

TEST_F(CompositeTest, NonFiniteValuesAreNotShown) {
    const ViewKernel kernel(ColorConfig::load().view({}));
    const Band band{{16, 16}, 0, 16};
    SumData d = colours(band);
    for (std::size_t i = 0; i < 256; ++i) {
        const double nan = std::nan("");
        const double values[] = {nan, -nan, INFINITY, -INFINITY, 1e300, -1e300};
        for (std::size_t c = 0; c < 3; ++c) d.emission[4 * i + c] = values[(i + c * (i / 6)) % 6];
    }
    for (const float v : composite(band, d, 1, true, &kernel).view) EXPECT_TRUE(v >= 0 && v <= 1) << v;
}

}  // namespace
}  // namespace halflight::test
