// Sums of the parts of a picture's samples, which are kept apart and then added in order, so that the bits do not
// depend on who has rendered a part.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "renderer/hand_over.h"
#include "renderer/replicates.h"

namespace halflight {

/// Numbers of samples of the blocks of a band, in the order of its paths.
struct BlockSamples {
    std::vector<std::uint32_t> all, first_half;

    void add(const BlockSamples& part) {
        if (all.empty()) return void(*this = part);
        for (std::size_t b = 0; b < all.size(); ++b) all[b] += part.all[b], first_half[b] += part.first_half[b];
    }
};

/// Totals of the parts of a band.
struct PartSums {
    std::array<std::vector<double>, 8> sums{};   // in the order of SumBuffers::all()
    int first_half = 0;                          // number of samples of the first half
    int samples = 0;                             // number of samples of each pixel, or with `blocks` its mean
    int mattes = 0;                              // number of samples in the mattes; 0: all
    int chances = 0;                             // largest number of chances to end that a part had (PictureError)
    double mean = 0;                             // mean number of samples of the blocks of the picture
    BlockSamples blocks{};                       // empty: all blocks have the same number
    std::optional<BandReplicates> replicates{};  // none without an error target

    /// Adds the sums of a part.
    void add(const SumBuffers& part) {
        const auto buffers = part.all();
        for (std::size_t i = 0; i < buffers.size(); ++i) {
            if (!buffers[i]) continue;
            std::vector<double> of_part = buffers[i]->read<double>();
            if (sums[i].empty())
                sums[i] = std::move(of_part);
            else
                for (std::size_t k = 0; k < of_part.size(); ++k) sums[i][k] += of_part[k];
        }
        first_half += part.first_half;
    }
    void add(const BandReplicates& part) {
        if (replicates)
            replicates->add(part);
        else
            replicates = part;
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
