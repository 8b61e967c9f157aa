// Sums of the parts of a picture's samples, which are kept apart and then added in order, so that the bits do not
// depend on who has rendered a part.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "renderer/hand_over.h"

namespace halflight {

/// Totals of sums, in the order of SumBuffers::all().
struct PartSums {
    std::array<std::vector<double>, 8> sums;
    int first_half = 0;  // number of samples of the first half

    /// Adds values of a part to those of buffer i.
    void add(std::size_t i, std::span<const double> of_part) {
        std::vector<double>& sum = sums[i];
        if (sum.empty()) return sum.assign(of_part.begin(), of_part.end());
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += of_part[k];
    }
    /// Adds the sums of a part.
    void add(const SumBuffers& part) {
        const auto buffers = part.all();
        for (std::size_t i = 0; i < buffers.size(); ++i)
            if (buffers[i]) add(i, buffers[i]->read<double>());
        first_half += part.first_half;
    }
    /// Writes the totals in place of the sums of a part.
    void write(SumBuffers& to) const {
        const auto buffers = to.all();
        for (std::size_t i = 0; i < buffers.size(); ++i)
            if (buffers[i]) buffers[i]->write(0, sums[i].size() * sizeof(double), sums[i].data());
        to.first_half = first_half;
    }
};

}  // namespace halflight
