// Tests sums of synthetic samples, including NaN and infinity, against sums in double on the CPU, their means, and the
// view transform against OpenColorIO on the CPU.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "passes/picture/accumulate.h"
#include "passes/picture/composite.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/pixel_order.h"
#include "tests/pass/scenes.h"
#include "tests/pass/stage.h"

namespace halflight::test {
namespace {

using Counts = std::array<std::uint32_t, kBadValueCounts>;

/// Radiances of one sample, as the earlier passes write them.
struct SampleData {
    std::vector<SurfaceRecord> surfaces;
    std::vector<shared::DirectLight> light;
    std::vector<shared::uint> occluded, light_occluded;
    std::vector<shared::PathState> states;
    std::vector<shared::DirectLight> received;
};

/// Makes radiances of all magnitudes; with `broken`, one in fifty is negative or not finite.
class RandomSamples {
  public:
    explicit RandomSamples(bool broken) : broken_(broken) {}

    SampleData next(std::size_t paths) {
        SampleData d;
        for (std::size_t i = 0; i < paths; ++i) {
            SurfaceRecord& s = d.surfaces.emplace_back();
            s.is_surface = chance(0.7);
            s.emission = radiance();
            s.diffuse = radiance(), s.specular = radiance(), s.normal = radiance() - radiance();
            d.light.push_back({radiance(), 0, radiance(), 0});
            d.occluded.push_back(chance(0.5));
            d.light_occluded.push_back(chance(0.5));
            d.received.push_back({radiance(), 0, radiance(), 0});
            shared::PathState& p = d.states.emplace_back();
            p.lobe = static_cast<shared::uint>(std::uniform_int_distribution(0, 2)(random_));
            p.throughput = radiance();
            p.direct = radiance(), p.indirect = radiance(), p.pending = radiance();
            p.pending_light = chance(0.5);
        }
        return d;
    }

  private:
    bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
    vec3 radiance() { return {value(), value(), value()}; }
    float value() {
        if (broken_ && chance(0.02)) {
            constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
            const std::array values{kNan, -kNan, kInfinity, -kInfinity, -1e-38f, -3e38f};
            return values[std::uniform_int_distribution<std::size_t>(0, values.size() - 1)(random_)];
        }
        return static_cast<float>(std::pow(10, std::uniform_real_distribution(-12.0, 38.5)(random_)));
    }
    bool broken_;
    std::mt19937 random_{3};
};

/// Inputs and sums that a frame has.
struct Variant {
    bool light = true, paths = true, pending = true, squares = true, features = true, reuse = false;
};

/// Sums per path.
struct SumsOnCpu {
    std::vector<std::array<double, 4>> emission;
    std::vector<std::array<double, 6>> direct, indirect, features;
    std::vector<dvec3> squares;
    Counts counts{};

    explicit SumsOnCpu(std::size_t n) : emission(n), direct(n), indirect(n), features(n), squares(n) {}

    dvec3 guarded(const vec3& v, shared::uint pass, bool is_radiance = true) {
        dvec3 out(0);
        for (int c = 0; c < 3; ++c) {
            const bool negative = is_radiance && v[c] < 0;
            if (std::isfinite(v[c]) && !negative) {
                out[c] = v[c];
            } else {
                ++counts[pass * shared::kBadKinds + (std::isnan(v[c])   ? shared::kBadNan
                                                     : std::isinf(v[c]) ? shared::kBadInfinite
                                                                        : shared::kBadNegative)];
            }
        }
        return out;
    }

    void add(const SampleData& d, const Variant& with) {
        for (std::size_t i = 0; i < emission.size(); ++i) {
            const SurfaceRecord& s = d.surfaces[i];
            const dvec3 emitted = guarded(s.emission, shared::kCountGBuffer);
            emission[i][3] += s.is_surface;
            std::array<dvec3, 2> near{dvec3(0), dvec3(0)}, far{dvec3(0), dvec3(0)};
            if (with.light && s.is_surface && d.occluded[i] == 0) {
                near[0] += guarded(d.light[i].diffuse, shared::kCountShadow);
                near[1] += guarded(d.light[i].glossy, shared::kCountShadow);
            }
            const shared::PathState& p = d.states[i];
            if (with.paths && p.lobe != shared::kLobeNone) {
                const std::size_t way = p.lobe == shared::kLobeDiffuse ? 0 : 1;
                near[way] += guarded(p.direct, shared::kCountScatter);
                if (with.pending) {
                    const bool lit = p.pending_light != 0 && d.light_occluded[i] == 0;
                    far[way] += guarded(p.indirect + (lit ? p.pending : vec3(0)), shared::kCountContinuation);
                }
            }
            if (with.reuse) {
                far[0] += guarded(d.received[i].diffuse, shared::kCountReuse);
                far[1] += guarded(d.received[i].glossy, shared::kCountReuse);
            }
            const dvec3 beauty = emitted + near[0] + near[1] + far[0] + far[1];
            dvec3 albedo(0), normal(0);
            if (with.features && s.is_surface) {
                albedo = min(guarded(s.diffuse + s.specular, shared::kCountGBuffer),
                             dvec3(1));  // no surface reflects more than it receives
                normal = guarded(s.normal, shared::kCountGBuffer, false);
            }
            for (int c = 0; c < 3; ++c) {
                emission[i][c] += emitted[c];
                squares[i][c] += beauty[c] * beauty[c];
                for (int way = 0; way < 2; ++way) {
                    direct[i][3 * way + c] += near[way][c];
                    indirect[i][3 * way + c] += far[way][c];
                }
                features[i][c] += albedo[c];
                features[i][3 + c] += normal[c];
            }
        }
    }
};

class AccumulateTest : public PassTest {
  protected:
    AccumulateTest() : stage(programs, floor_scene(glossy()), spot_camera(dvec3(0), {0, 1, 0}, 1), {40, 20}) {}

    static Material glossy() {
        Material m = metal_material(vec3(0.5f), 0.5f);
        m.metallic = 0;
        return m;
    }

    /// Builds the graph of the pass over buffers that feed() fills.
    void build(const Variant& wanted) {
        variant = wanted;
        const std::size_t n = stage.paths();
        const auto import = [&](const char* name, std::size_t bytes) {
            inputs.push_back(std::make_unique<gpu::Buffer>(name, bytes));
            return graph.import_buffer(name, *inputs.back());
        };
        SampleInputs sample;
        sample.gbuffer.surfaces = import("surfaces", n * stage.buffers().surface_record_bytes());
        const graph::BufferHandle light = import("light", n * sizeof(shared::DirectLight));
        const graph::BufferHandle occluded = import("occluded", n * sizeof(shared::uint));
        const graph::BufferHandle states = import("states", n * sizeof(shared::PathState));
        const graph::BufferHandle later = import("light occluded", n * sizeof(shared::uint));
        if (variant.light) sample.direct = DirectLightEstimate{light, occluded, {}};
        if (variant.paths) sample.paths.emplace().states = states;
        const graph::BufferHandle received = import("received", n * sizeof(shared::DirectLight));
        if (variant.pending) sample.continuation = Continuation{later, {}, true};
        if (variant.reuse) sample.received = received;
        sums = add_accumulate(graph, stage.view(graph), sample, {variant.squares, variant.features}, counts);
        for (const graph::BufferHandle h :
             {sums.emission, sums.direct, sums.indirect, sums.squares, sums.features, sums.bad_values})
            if (h) graph.output(h);
        plan = graph::compile(graph);
    }
    void feed(const SampleData& d) {
        inputs[0]->write(std::span<const vec4>(pack_surfaces(d.surfaces, stage.buffers().needs())));
        inputs[1]->write(std::span<const shared::DirectLight>(d.light));
        inputs[2]->write(std::span<const shared::uint>(d.occluded));
        inputs[3]->write(std::span<const shared::PathState>(d.states));
        inputs[4]->write(std::span<const shared::uint>(d.light_occluded));
        inputs[5]->write(std::span<const shared::DirectLight>(d.received));
        stage.select_sample(samples++);
        executor.run(plan);
    }
    /// Compares bits, because sums in double of equal numbers in equal order are equal.
    template <class T>
    void expect_sums(graph::BufferHandle found, const std::vector<T>& expected, const char* what) {
        ASSERT_TRUE(bool(found)) << what;
        const std::vector<double> values = executor.read<double>(found);
        constexpr std::size_t kStride = sizeof(T) / sizeof(double);
        ASSERT_EQ(values.size(), expected.size() * kStride);
        for (std::size_t i = 0; i < values.size(); ++i) {
            ASSERT_TRUE(std::isfinite(values[i])) << what;
            const double e = expected[i / kStride][static_cast<int>(i % kStride)];
            ASSERT_NEAR(values[i], e, 1e-15 * std::abs(e)) << what << " " << i;
        }
    }
    Counts counted() const {
        Counts counted{};
        std::ranges::copy(counts.read<std::uint32_t>(), counted.begin());
        return counted;
    }

    /// Feeds samples and compares all sums that the variant has.
    SumsOnCpu expect_sums_of(RandomSamples& random, int count) {
        SumsOnCpu expected(stage.paths());
        for (int i = 0; i < count; ++i) {
            const SampleData d = random.next(stage.paths());
            feed(d);
            expected.add(d, variant);
        }
        const auto expect = [&](bool made, graph::BufferHandle handle, const auto& of, const char* what) {
            EXPECT_EQ(bool(handle), made) << what;
            if (made) expect_sums(handle, of, what);
        };
        expect(true, sums.emission, expected.emission, "emission");
        expect(variant.light || variant.paths, sums.direct, expected.direct, "direct");
        expect(variant.pending || variant.reuse, sums.indirect, expected.indirect, "indirect");
        expect(variant.squares, sums.squares, expected.squares, "squares");
        expect(variant.features, sums.features, expected.features, "features");
        return expected;
    }

    Stage stage;
    graph::Graph graph;
    std::vector<std::unique_ptr<gpu::Buffer>> inputs;
    gpu::Buffer counts{"bad values", sizeof(Counts)};
    Accumulated sums;
    graph::CompiledGraph plan;
    Variant variant;
    std::uint32_t samples = 0;  // number of samples fed
};

TEST_F(AccumulateTest, SumsEqualDoublePrecision) {
    build({.reuse = true});
    RandomSamples random(false);
    expect_sums_of(random, 6);
}

TEST_F(AccumulateTest, BadValuesAreCountedAndTakenAsZero) {
    build({.reuse = true});
    RandomSamples random(true);
    const SumsOnCpu expected = expect_sums_of(random, 6);
    for (const std::uint32_t c : expected.counts) EXPECT_GT(c, 30u);
    EXPECT_EQ(counted(), expected.counts);
}

class AccumulateParts : public AccumulateTest, public testing::WithParamInterface<Variant> {};
INSTANTIATE_TEST_SUITE_P(, AccumulateParts,
                         testing::Values(Variant{.light = false, .paths = false, .pending = false, .features = false},
                                         Variant{.light = false, .pending = false, .squares = false, .features = false},
                                         Variant{
                                             .paths = false, .pending = false, .squares = false, .features = false}));

TEST_P(AccumulateParts, OmittedPassesHaveNoSums) {
    build(GetParam());
    RandomSamples random(true);
    const SumsOnCpu expected = expect_sums_of(random, 1);
    EXPECT_EQ(counted(), expected.counts);
}

TEST_F(AccumulateTest, SampleZeroStartsAnew) {
    build({});
    RandomSamples random(false);
    expect_sums_of(random, 2);
    for (const graph::BufferHandle h : {sums.emission, sums.direct, sums.indirect, sums.squares, sums.features})
        executor.buffer(h).fill(~0u);  // a NaN
    samples = 0;
    expect_sums_of(random, 1);
}

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
                // Looks of these views have a function of their own.
                const bool tone_mapped = view == "Khronos PBR Neutral" || view == "AgX";
                const std::string look = tone_mapped && exposure != 0 ? config.looks().at(0) : "";
                SCOPED_TRACE(display + ", " + view + ", exposure " + std::to_string(exposure));
                const ViewProcessor processor = config.view({display, view, look, exposure});
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
