#include "tools/measure/peer/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/statistics.h"

namespace halflight::peer {
namespace {

constexpr std::size_t kWorst = 6;  // blocks named

std::vector<Block> worst_first(std::vector<Block> blocks) {
    std::sort(blocks.begin(), blocks.end(), [](const Block& a, const Block& b) {
        return std::abs(a.difference.relative) > std::abs(b.difference.relative);
    });
    return blocks;
}

double sum_of(const float* pixel) {
    return double{pixel[0]} + pixel[1] + pixel[2];
}

void paint(float* pixel, double difference, double scale) {
    const float t = static_cast<float>(std::clamp(difference / scale, -1.0, 1.0));
    pixel[0] = 1 - std::max(-t, 0.0f), pixel[1] = 1 - std::abs(t), pixel[2] = 1 - std::max(t, 0.0f);
}

}  // namespace

std::string text(const Agreement& a) {
    std::string lines = fmt::format("  whole picture: Cycles is {:+.3f} % +- {:.3f} % of ours\n",
                                    100 * a.whole.relative, 100 * a.whole.error);
    if (a.blocks.empty()) return lines;
    std::vector<double> sizes, errors;
    for (const Block& b : a.blocks) {
        sizes.push_back(std::abs(b.difference.relative));
        errors.push_back(b.difference.error);
    }
    lines += fmt::format(
        "  {} blocks of {}x{}: {:.2f} % in the median, {:.2f} % at most; standard error {:.2f} % in the median, {:.2f} "
        "% "
        "at most\n"
        "  beyond {:g} % + 1 standard error: {} blocks; noise alone would put {:.2g} there\n  worst:",
        a.blocks.size(), a.side, a.side, 100 * median(sizes), 100 * quantile(sizes, 1), 100 * median(errors),
        100 * quantile(errors, 1), 100 * a.tolerance, a.beyond, a.expected_beyond);
    const std::vector<Block> worst = worst_first(a.blocks);
    for (std::size_t i = 0; i < std::min(kWorst, worst.size()); ++i) {
        const Block& b = worst[i];
        lines += fmt::format("{} ({}, {}) {:+.2f} +- {:.2f} %{}", i ? "," : "", b.x, b.y, 100 * b.difference.relative,
                             100 * b.difference.error, b.beyond ? " beyond" : "");
    }
    return lines + '\n';
}

nlohmann::json json(const Agreement& a) {
    nlohmann::json blocks = nlohmann::json::array();
    for (const Block& b : a.blocks)
        blocks.push_back({{"x", b.x},
                          {"y", b.y},
                          {"difference", b.difference.relative},
                          {"standard_error", b.difference.error},
                          {"beyond", b.beyond},
                          {"chance_of_beyond", b.chance_of_beyond}});
    return {{"difference", a.whole.relative},
            {"standard_error", a.whole.error},
            {"block_side", a.side},
            {"block_tolerance", a.tolerance},
            {"blocks_beyond", a.beyond},
            {"blocks_beyond_by_noise", a.expected_beyond},
            {"blocks", blocks}};
}

Image picture(const Image& ours, const Image& theirs, const Agreement& agreement, const ViewProcessor& view,
              double scale) {
    const int width = ours.width, height = ours.height;
    const Image shown[] = {view.apply(ours), view.apply(theirs)};
    Image result(4 * width, height, 3);
    std::fill(result.pixels.begin(), result.pixels.end(), 0.5f);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int i = 0; i < 2; ++i) std::copy_n(shown[i].at(x, y), 3, result.at(i * width + x, y));
            const double mine = sum_of(ours.at(x, y));
            if (mine > 0) paint(result.at(2 * width + x, y), sum_of(theirs.at(x, y)) / mine - 1, scale);
        }
    }
    for (const Block& b : agreement.blocks)
        for (int y = b.y; y < b.y + agreement.side; ++y)
            for (int x = b.x; x < b.x + agreement.side; ++x)
                paint(result.at(3 * width + x, y), b.difference.relative, scale);
    return result;
}

}  // namespace halflight::peer
