// Tests sums of synthetic samples, including NaN and infinity, against sums in double on the CPU.
#include "passes/picture/accumulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "shaders/shared/path.h"
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

    void add(const SampleData& d, bool with_light, bool with_paths, bool with_pending, bool with_features,
             bool with_reuse = false) {
        for (std::size_t i = 0; i < emission.size(); ++i) {
            const SurfaceRecord& s = d.surfaces[i];
            const dvec3 emitted = guarded(s.emission, shared::kCountGBuffer);
            emission[i][3] += s.is_surface;
            std::array<dvec3, 2> near{dvec3(0), dvec3(0)}, far{dvec3(0), dvec3(0)};
            if (with_light && s.is_surface && d.occluded[i] == 0) {
                near[0] += guarded(d.light[i].diffuse, shared::kCountShadow);
                near[1] += guarded(d.light[i].glossy, shared::kCountShadow);
            }
            const shared::PathState& p = d.states[i];
            if (with_paths && p.lobe != shared::kLobeNone) {
                const std::size_t way = p.lobe == shared::kLobeDiffuse ? 0 : 1;
                near[way] += guarded(p.direct, shared::kCountScatter);
                if (with_pending) {
                    const bool lit = p.pending_light != 0 && d.light_occluded[i] == 0;
                    far[way] += guarded(p.indirect + (lit ? p.pending : vec3(0)), shared::kCountContinuation);
                }
            }
            if (with_reuse) {
                far[0] += guarded(d.received[i].diffuse, shared::kCountReuse);
                far[1] += guarded(d.received[i].glossy, shared::kCountReuse);
            }
            const dvec3 beauty = emitted + near[0] + near[1] + far[0] + far[1];
            dvec3 albedo(0), normal(0);
            if (with_features && s.is_surface) {
                albedo = min(guarded(s.diffuse + s.specular, shared::kCountGBuffer), dvec3(1));  // mirrors gain nothing
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
    struct Variant {
        bool light = true, paths = true, pending = true, squares = true, features = true, reuse = false;
    };

    AccumulateTest() : stage(programs, floor_scene(glossy()), spot_camera(dvec3(0), {0, 1, 0}, 1), {40, 20}) {}

    static Material glossy() {
        Material m = metal_material(vec3(0.5f), 0.5f);
        m.metallic = 0;
        return m;
    }

    /// Builds the graph of the pass over buffers that feed() fills.
    void build(const Variant& variant) {
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

    /// Feeds 20 samples with all components.
    SumsOnCpu expect_sums_of(RandomSamples random) {
        SumsOnCpu expected(stage.paths());
        for (int i = 0; i < 20; ++i) {
            const SampleData d = random.next(stage.paths());
            feed(d);
            expected.add(d, true, true, true, true, true);
        }
        expect_sums(sums.emission, expected.emission, "emission");
        expect_sums(sums.direct, expected.direct, "direct");
        expect_sums(sums.indirect, expected.indirect, "indirect");
        expect_sums(sums.squares, expected.squares, "squares");
        expect_sums(sums.features, expected.features, "features");
        return expected;
    }

    Stage stage;
    graph::Graph graph;
    std::vector<std::unique_ptr<gpu::Buffer>> inputs;
    gpu::Buffer counts{"bad values", sizeof(Counts)};
    Accumulated sums;
    graph::CompiledGraph plan;
    std::uint32_t samples = 0;  // number of samples fed
};

TEST_F(AccumulateTest, SumsEqualDoublePrecision) {
    build({.reuse = true});
    expect_sums_of(RandomSamples(false));
}

TEST_F(AccumulateTest, BadValuesAreCountedAndTakenAsZero) {
    build({.reuse = true});
    const SumsOnCpu expected = expect_sums_of(RandomSamples(true));
    for (const std::uint32_t c : expected.counts) EXPECT_GT(c, 100u);
    EXPECT_EQ(counted(), expected.counts);
}

TEST_F(AccumulateTest, OmittedPassesHaveNoSums) {
    RandomSamples random(true);
    SumsOnCpu expected(stage.paths());
    const SampleData d = random.next(stage.paths());
    build({.light = false, .paths = false, .pending = false, .squares = true, .features = false});
    EXPECT_FALSE(bool(sums.direct));
    EXPECT_FALSE(bool(sums.indirect));
    EXPECT_FALSE(bool(sums.features));
    feed(d);
    expected.add(d, false, false, false, false);
    expect_sums(sums.emission, expected.emission, "emission");
    expect_sums(sums.squares, expected.squares, "squares");
    EXPECT_EQ(counted(), expected.counts);
}

TEST_F(AccumulateTest, PathsWithoutLightSamples) {
    RandomSamples random(true);
    SumsOnCpu expected(stage.paths());
    const SampleData d = random.next(stage.paths());
    build({.light = false, .pending = false, .squares = false, .features = false});
    feed(d);
    expected.add(d, false, true, false, false);
    expect_sums(sums.emission, expected.emission, "emission");
    expect_sums(sums.direct, expected.direct, "direct");
    EXPECT_FALSE(bool(sums.indirect));
    EXPECT_EQ(counted(), expected.counts);
}

TEST_F(AccumulateTest, LightSamplesWithoutPaths) {
    RandomSamples random(true);
    SumsOnCpu expected(stage.paths());
    const SampleData d = random.next(stage.paths());
    build({.paths = false, .pending = false, .squares = false, .features = false});
    feed(d);
    expected.add(d, true, false, false, false);
    expect_sums(sums.direct, expected.direct, "direct");
    EXPECT_EQ(counted(), expected.counts);
}

TEST_F(AccumulateTest, SampleZeroStartsAnew) {
    build({});
    RandomSamples random(false);
    feed(random.next(stage.paths()));
    feed(random.next(stage.paths()));
    for (const graph::BufferHandle h : {sums.emission, sums.direct, sums.indirect, sums.squares, sums.features})
        executor.buffer(h).fill(~0u);  // a NaN
    samples = 0;
    const SampleData d = random.next(stage.paths());
    feed(d);
    SumsOnCpu expected(stage.paths());
    expected.add(d, true, true, true, true);
    expect_sums(sums.emission, expected.emission, "emission");
    expect_sums(sums.direct, expected.direct, "direct");
    expect_sums(sums.indirect, expected.indirect, "indirect");
    expect_sums(sums.squares, expected.squares, "squares");
    expect_sums(sums.features, expected.features, "features");
}

}  // namespace
}  // namespace halflight::test
