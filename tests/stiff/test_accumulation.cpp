// Tests a million samples: precision of sums and means, and bad values.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/math.h"
#include "passes/picture/composite.h"
#include "renderer/frame.h"
#include "shaders/shared/pixel_order.h"
#include "shaders/shared/sobol.h"
#include "tests/pass/stage.h"
#include "tests/stiff/stiff.h"

namespace halflight::test {
namespace {

/// Runs the accumulating pass alone on synthetic emission.
class Accumulation : public StiffTest {
  protected:
    static constexpr std::size_t kSignals = 8;
    static constexpr int kSamples = 1'000'000;

    Accumulation()
        : stage_(programs_, floor_scene(diffuse_material(vec3(0.5f))), spot_camera(dvec3(0), {0, 1, 0}, 1), {16, 16}) {
        SampleInputs sample;
        sample.gbuffer.surfaces = graph_.import_buffer("surfaces", surfaces_);
        sums_ = add_accumulate(graph_, stage_.view(graph_), sample, {.squares = true}, bad_values_);
        for (const graph::BufferHandle h : {sums_.emission, sums_.squares, sums_.bad_values}) graph_.output(h);
        plan_ = graph::compile(graph_);
    }
    void feed(int sample, const std::vector<vec3>& emission) {
        stage_.select_sample(static_cast<std::uint32_t>(sample));
        std::vector<SurfaceRecord> records(stage_.paths());
        for (std::size_t i = 0; i < emission.size(); ++i) records[i].emission = emission[i];
        surfaces_.write(std::span<const vec4>(pack_surfaces(records, stage_.buffers().needs())));
        executor_.run(plan_);
    }

    gpu::ProgramCache programs_;
    graph::Executor executor_{programs_};
    Stage stage_;
    graph::Graph graph_;
    gpu::Buffer surfaces_{"surfaces", stage_.paths() * stage_.buffers().surface_record_bytes()};
    gpu::Buffer bad_values_{"bad values", kBadValueCounts * sizeof(std::uint32_t)};
    Accumulated sums_;
    graph::CompiledGraph plan_;
};

TEST_F(Accumulation, AMillionSamples) {
    // Half of the signals are constant. The other half has a tail so heavy that the variance is infinite (Pareto
    // distribution, index 1.1).
    const auto value = [](std::size_t signal, int sample) {
        if (signal < kSignals / 2) return 0.1f + static_cast<float>(signal);
        const std::uint32_t bits =
            shared::hash_u32(static_cast<std::uint32_t>(sample) * kSignals + std::uint32_t(signal));
        return static_cast<float>(std::pow((bits + 0.5) * 0x1p-32, -1 / 1.1));
    };
    // The CPU instead of the GPU adds the samples in the middle. The samples before and after show that both agree.
    const auto on_gpu = [](int sample) { return sample < 1500 || sample >= kSamples - 1500; };
    std::vector<double> sums(kSignals, 0), squares(kSignals, 0);
    std::vector<long double> exact(kSignals, 0);
    double differ = 0;
    const auto compare = [&] {
        const auto emission = executor_.read<double>(sums_.emission), square = executor_.read<double>(sums_.squares);
        for (std::size_t s = 0; s < kSignals; ++s)
            differ += (emission[4 * s] != sums[s]) + (square[3 * s] != squares[s]);
    };
    for (int i = 0; i < kSamples; ++i) {
        std::vector<vec3> emission(kSignals);
        for (std::size_t s = 0; s < kSignals; ++s) {
            const float v = value(s, i);
            emission[s] = vec3(v);
            sums[s] += v;
            squares[s] += double(v) * v;
            exact[s] += v;
        }
        if (!on_gpu(i)) continue;
        if (!on_gpu(i - 1)) {
            std::vector<double> before(4 * stage_.paths()), squares_before(3 * stage_.paths());
            for (std::size_t s = 0; s < kSignals; ++s) {
                for (std::size_t c = 0; c < 3; ++c) {
                    before[4 * s + c] = sums[s];
                    squares_before[3 * s + c] = squares[s];
                }
            }
            executor_.buffer(sums_.emission).write(std::span<const double>(before));
            executor_.buffer(sums_.squares).write(std::span<const double>(squares_before));
            continue;
        }
        feed(i, emission);
        if (!on_gpu(i + 1) || i + 1 == kSamples) compare();
    }
    expect("10^6 samples: sums of the GPU that are not those of doubles", differ, 0, "sums",
           "exact: IEEE 754 additions");
    std::vector<double> worst(2, 0);
    for (std::size_t s = 0; s < kSignals; ++s) {
        const long double error = std::abs((static_cast<long double>(sums[s]) - exact[s]) / exact[s]);
        worst[s / (kSignals / 2)] = std::max(worst[s / (kSignals / 2)], static_cast<double>(error));
    }
    const char* reason = "as asked; n roundings of 2^-53 of the sum of n values are below 1.2e-10";
    expect("10^6 samples of a constant: error of the mean", worst[0], 1.2e-10, "of the mean", reason);
    expect("10^6 samples of a heavy tail: error of the mean", worst[1], 1.2e-10, "of the mean", reason);

    graph::Graph graph;
    Accumulated imported;
    imported.emission = graph.import_buffer("sums", executor_.buffer(sums_.emission));
    const Composite composite = add_composite(graph, stage_.band(), imported, kSamples, true, nullptr);
    graph.output(composite.beauty);
    graph::Executor composer(programs_);
    composer.run(graph::compile(graph));
    const std::vector<float> beauty = composer.texture(composite.beauty).read_float();
    double off = 0;
    for (std::size_t s = 0; s < kSignals; ++s) {
        const auto pixel = shared::pixel_of_path(static_cast<shared::uint>(s), stage_.band().tiles());
        const double mean = static_cast<double>(exact[s] / kSamples);
        off = std::max(off, std::abs(beauty[4 * (pixel.y * 16 + pixel.x)] - mean) / mean);
    }
    expect("10^6 samples: error of the pixel", off, 0x1p-24 + 1.2e-10, "of the mean", "the pixel is a float");
}

TEST_F(Accumulation, BadValuesAreKeptOut) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float values[] = {nan, -nan, kInfinity, -kInfinity, -1e-38f, -1, -3e38f, 3e38f, 1};
    std::vector<vec3> emission;
    for (const float v : values)
        for (int c = 0; c < 3; ++c) {
            vec3 e(1);
            e[c] = v;
            emission.push_back(e);
        }
    for (int i = 0; i < 100; ++i) feed(i, emission);
    double bad = 0;
    for (const graph::BufferHandle h : {sums_.emission, sums_.squares})
        for (const double v : executor_.read<double>(h)) bad += !(std::isfinite(v) && v >= 0);
    expect("NaN, infinities and negative radiance fed in: bad values in the sums", bad, 0, "values", "exact: guarded");
    const auto counts = bad_values_.read<std::uint32_t>();
    const double miscounted = std::abs(counts[shared::kBadNan] - 600.0) +
                              std::abs(counts[shared::kBadInfinite] - 600.0) +
                              std::abs(counts[shared::kBadNegative] - 900.0);
    expect("the same: miscounted", miscounted, 0, "values", "two, two and three kinds, three channels, 100 samples");
}

}  // namespace
}  // namespace halflight::test
