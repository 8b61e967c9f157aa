#include "passes/picture/adaptive.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "engine/core/metrics.h"
#include "shaders/shared/denoise.h"

namespace halflight {
namespace {

using graph::Access;

/// Returns weighted means over each block and its neighbours.
std::vector<double> smoothed(std::span<const float> errors, ivec2 blocks) {
    const auto at = [&](int x, int y) {
        x = std::clamp(x, 0, blocks.x - 1), y = std::clamp(y, 0, blocks.y - 1);
        const double error =
            errors[static_cast<std::size_t>(y) * static_cast<std::size_t>(blocks.x) + static_cast<std::size_t>(x)];
        return std::isfinite(error) ? error : 0.0;
    };
    std::vector<double> means;
    means.reserve(errors.size());
    for (int y = 0; y < blocks.y; ++y) {
        for (int x = 0; x < blocks.x; ++x) {
            double sum = 0;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) sum += (2 - std::abs(dx)) * (2 - std::abs(dy)) * at(x + dx, y + dy);
            means.push_back(sum / 16);
        }
    }
    return means;
}

/// Returns deviations relative to the largest one; 1 if all are 0.
std::vector<double> shares(std::vector<double> deviations) {
    const double most = std::ranges::max(deviations);
    for (double& d : deviations) d = most > 0 ? d / most : 1;
    return deviations;
}

}  // namespace

int pilot_samples(int samples) {
    return std::clamp(static_cast<int>(std::bit_floor(static_cast<unsigned>(samples / 16))), 4, 32);
}

int least_samples(int samples) {
    return std::max(static_cast<int>(std::bit_floor(static_cast<unsigned>(samples / 8))), 4);
}

graph::BufferHandle add_block_errors(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples,
                                     ErrorMetric metric) {
    const std::uint32_t blocks = band.paths() / 256;
    graph::Pass pass = graph.add_pass("adaptive samples: errors");
    gpu::Defines defines;
    read_light(pass, defines, sums);
    pass.read(sums.squares, Access::storage_read, "Squares");
    if (sums.catchers) {
        pass.read(sums.catchers, Access::storage_read, "Catchers");
        defines.set("HALFLIGHT_CATCHERS");
    }
    const graph::BufferHandle errors =
        pass.write(graph.create_buffer("block errors", {blocks * sizeof(float)}), Access::storage_write, "Errors");
    pass.kernel({"shaders/block_errors.comp", defines});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("samples", static_cast<std::uint32_t>(samples));
        program.set("blocks", blocks);
        const bool relative = metric == ErrorMetric::relmse;
        program.set("relative", relative ? 1.0f : 0.0f);
        program.set("epsilon", relative ? static_cast<float>(kRelativeEpsilon) : 1.0f);
        program.dispatch((blocks + 63) / 64);
    });
    return errors;
}

std::vector<double> block_deviations(std::span<const float> errors, ivec2 blocks) {
    std::vector<double> deviations = smoothed(errors, blocks);
    for (double& d : deviations) d = std::sqrt(d);
    return deviations;
}

std::vector<std::uint32_t> adaptive_counts(std::span<const float> errors, ivec2 blocks, std::uint32_t least,
                                           std::uint64_t total) {
    const std::vector<double> wanted = shares(block_deviations(errors, blocks));
    constexpr double kMost = 1u << 30;  // keeps twice the number below kInFirstHalf of sampled_block.h
    const auto number_at = [&](double scale, double w) { return std::clamp(scale * w, double(least), kMost); };
    double lower = 0, upper = double(total);  // bounds of the scale that gives the total
    for (int step = 0; step < 80; ++step) {
        const double middle = (lower + upper) / 2;
        double sum = 0;
        for (const double w : wanted) sum += number_at(middle, w);
        (sum <= double(total) ? lower : upper) = middle;
    }
    std::vector<std::uint32_t> counts;
    counts.reserve(wanted.size());
    double owed = 0;  // rounding errors so far, which the next blocks make up for
    for (const double w : wanted) {
        const double number = number_at(lower, w);
        owed += number;
        const auto power = std::max(std::bit_floor(static_cast<std::uint32_t>(number * (1 + 1e-9))), least);
        counts.push_back(owed >= 1.5 * power ? 2 * power : power);
        owed -= counts.back();
    }
    return counts;
}

int expected_samples(std::span<const double> deviations, double target) {
    const double sum = std::accumulate(deviations.begin(), deviations.end(), 0.0);
    const double mean = sum / static_cast<double>(deviations.size());
    return static_cast<int>(std::clamp(std::ceil(mean * mean / target), 1.0, 1e9));
}

std::vector<std::uint32_t> replicate_counts(std::span<const double> deviations, std::uint32_t mean, std::uint32_t least,
                                            std::uint32_t most) {
    const std::vector<double> wanted = shares({deviations.begin(), deviations.end()});
    const std::uint32_t bottom = std::max(least, mean / 8);
    const auto number_at = [&](double scale, double w) {
        return std::clamp(static_cast<std::uint32_t>(std::min(scale * w, double(most))), bottom,
                          std::max(bottom, most));
    };
    const auto fits = [&](double scale) {
        std::uint64_t sum = 0;
        for (const double w : wanted) sum += number_at(scale, w);
        return sum <= std::uint64_t{mean} * wanted.size();
    };
    // Bounds of the scale do not depend on `mean`, and neither does their grid: a larger mean never gives less.
    double lower = 0, upper = std::ldexp(1.0, 60);
    for (int step = 0; step < 100; ++step) (fits((lower + upper) / 2) ? lower : upper) = (lower + upper) / 2;
    std::vector<std::uint32_t> counts;
    counts.reserve(wanted.size());
    for (const double w : wanted) counts.push_back(number_at(lower, w));
    return counts;
}

void add_adaptive_mean(graph::Graph& graph, const Band& band, const Accumulated& sums, const BlockCounts& counts,
                       std::uint32_t wanted, std::size_t half_sums, std::size_t group_sums) {
    if (sums.squares) {
        graph::Pass pass = graph.add_pass("adaptive samples: squares");
        gpu::Defines defines;
        read_light(pass, defines, sums);
        pass.read(counts.all, Access::texture_read, {"counts", GL_R32UI});
        graph.output(pass.write(sums.squares, Access::storage_read_write, "Squares"));
        pass.kernel({"shaders/adaptive_squares.comp", defines});
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("wanted", wanted);
            program.dispatch(band.paths() / 64);
        });
    }
    const auto scale = [&](graph::BufferHandle values, std::size_t stride, std::uint32_t of_first_half = 0) {
        if (!values) return;
        graph::Pass pass = graph.add_pass("adaptive samples: mean");
        pass.read(counts.all, Access::texture_read, {"counts", GL_R32UI});
        pass.read(counts.first_half, Access::texture_read, {"first_counts", GL_R32UI});
        graph.output(pass.write(values, Access::storage_read_write, "Sums"));
        pass.kernel({"shaders/adaptive_mean.comp"});
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("stride", static_cast<std::uint32_t>(stride));
            program.set("wanted", wanted);
            program.set("of_first_half", of_first_half);
            program.dispatch(band.paths() / 64);
        });
    };
    scale(sums.emission, 4);
    scale(sums.direct, 6);
    scale(sums.indirect, 6);
    scale(sums.features, 6);
    scale(sums.catchers, kCatcherSums);
    scale(sums.groups, group_sums);
    scale(sums.halves, half_sums, shared::kFirstHalfSums);
}

}  // namespace halflight
