#include "passes/picture/adaptive.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "engine/core/metrics.h"

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

}  // namespace

int pilot_samples(int samples) {
    return std::clamp(static_cast<int>(std::bit_floor(static_cast<unsigned>(samples / 16))), 4, 32);
}

int least_samples(int samples) {
    return std::max(static_cast<int>(std::bit_floor(static_cast<unsigned>(samples / 8))), 4);
}

graph::BufferHandle add_block_errors(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples) {
    const std::uint32_t blocks = band.paths() / 256;
    graph::Pass pass = graph.add_pass("adaptive samples: errors");
    gpu::Defines defines;
    read_light(pass, defines, sums);
    pass.read(sums.squares, Access::storage_read, "Squares");
    const graph::BufferHandle errors =
        pass.write(graph.create_buffer("block errors", {blocks * sizeof(float)}), Access::storage_write, "Errors");
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.compute("shaders/block_errors.comp", defines);
        program.set("samples", static_cast<std::uint32_t>(samples));
        program.set("blocks", blocks);
        program.set("epsilon", static_cast<float>(kRelativeEpsilon));
        program.dispatch((blocks + 63) / 64);
    });
    return errors;
}

std::vector<std::uint32_t> adaptive_counts(std::span<const float> errors, ivec2 blocks, std::uint32_t least,
                                           std::uint64_t total) {
    std::vector<double> wanted = smoothed(errors, blocks);
    for (double& w : wanted) w = std::sqrt(w);
    const double most = std::ranges::max(wanted);
    for (double& w : wanted) w = most > 0 ? w / most : 1;
    const auto number_at = [&](double scale, double w) { return std::max(scale * w, double(least)); };
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

void add_adaptive_mean(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::BufferHandle counts,
                       std::uint32_t wanted, std::size_t half_sums) {
    if (sums.squares) {
        graph::Pass pass = graph.add_pass("adaptive samples: squares");
        gpu::Defines defines;
        read_light(pass, defines, sums);
        pass.read(counts, Access::texture_read, {"counts", GL_R32UI});
        graph.output(pass.write(sums.squares, Access::storage_read_write, "Squares"));
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.compute("shaders/adaptive_squares.comp", defines);
            program.set("wanted", wanted);
            program.dispatch(band.paths() / 64);
        });
    }
    const auto scale = [&](graph::BufferHandle values, std::size_t stride) {
        if (!values) return;
        graph::Pass pass = graph.add_pass("adaptive samples: mean");
        pass.read(counts, Access::texture_read, {"counts", GL_R32UI});
        graph.output(pass.write(values, Access::storage_read_write, "Sums"));
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.compute("shaders/adaptive_mean.comp");
            program.set("stride", static_cast<std::uint32_t>(stride));
            program.set("wanted", wanted);
            program.dispatch(band.paths() / 64);
        });
    };
    scale(sums.emission, 4);
    scale(sums.direct, 6);
    scale(sums.indirect, 6);
    scale(sums.features, 6);
    scale(sums.halves, half_sums);
}

}  // namespace halflight
