// The pictures that native non-local means read, a plane for each channel. Planes reach beyond the picture: there they
// repeat the pixels of its edge, and nothing is valid.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "passes/picture/native_means.h"

namespace halflight {

inline constexpr int kMeansTileWidth = 64, kMeansTileHeight = 16;  // pixels
inline constexpr int kMostPatch = 3;

enum MeansPlane {
    kFirstLuminance,
    kSecondLuminance,
    kVariance,
    kShare,  // share of the first half
    kValid,  // 1: light may be taken from the pixel; 0: otherwise
    kLight,  // six planes: the first half's channels, and the second half's
    kNormal = kLight + 6,
    kLogDepth = kNormal + 3,
    kAlbedo,
    kChain = kAlbedo + 3,  // number of mirrors before the surface
    kMeansPlanes
};

class MeansPlanes {
  public:
    MeansPlanes(ivec2 pictures, const MeansInput& input) : size(pictures) {
        const auto whole = [](int n, int tile) { return (n + tile - 1) / tile * tile; };
        stride_ = whole(size.x, kMeansTileWidth) + 2 * kPad;
        rows_ = size.y + 2 * kPad;
        values_.resize(static_cast<std::size_t>(kMeansPlanes) * plane());
        tbb::parallel_for(0, rows_, [&](int y) {
            take_row(y, input.light, {kFirstLuminance, kSecondLuminance, kVariance, kShare});
            take_row(y, input.first, {kLight, kLight + 1, kLight + 2, kValid});
            take_row(y, input.second, {kLight + 3, kLight + 4, kLight + 5, -1});
            take_row(y, input.guide, {kNormal, kNormal + 1, kNormal + 2, kLogDepth});
            take_row(y, input.reflectance, {kAlbedo, kAlbedo + 1, kAlbedo + 2, kChain});
            const bool inside = y >= kPad && y < kPad + size.y;
            float* const valid = row_of(kValid, y);
            for (int x = 0; x < stride_; ++x)
                valid[x] = inside && x >= kPad && x < kPad + size.x && valid[x] > 0 ? 1.0f : 0.0f;
        });
    }

    /// Returns the pixel 0,0 of a plane.
    const float* row(MeansPlane index) const {
        return values_.data() + static_cast<std::size_t>(index) * plane() + step(ivec2(kPad));
    }
    std::ptrdiff_t step(ivec2 pixels) const { return static_cast<std::ptrdiff_t>(pixels.y) * stride_ + pixels.x; }

    const ivec2 size;

  private:
    // Texels around the picture that patches at an offset may read. The last register of a row reads up to 15 more.
    static constexpr int kPad = 40;
    static_assert(kPad >= kMostOffset + kMostPatch + 15);

    std::size_t plane() const { return static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_); }
    float* row_of(int plane_index, int y) {
        return values_.data() + static_cast<std::size_t>(plane_index) * plane() + step(ivec2(0, y));
    }
    /// Takes the channels of a row apart. planes: one per channel; -1: none.
    void take_row(int y, std::span<const float> picture, ivec4 planes) {
        const auto from_y = static_cast<std::size_t>(std::clamp(y - kPad, 0, size.y - 1));
        const float* const from = picture.data() + 4 * from_y * static_cast<std::size_t>(size.x);
        for (int c = 0; c < 4; ++c) {
            if (planes[c] < 0) continue;
            float* const to = row_of(planes[c], y);
            for (int x = 0; x < size.x; ++x) to[kPad + x] = from[4 * x + c];
            std::fill(to, to + kPad, to[kPad]);
            std::fill(to + kPad + size.x, to + stride_, to[kPad + size.x - 1]);
        }
    }

    int stride_ = 0, rows_ = 0;  // width and height of a plane, floats
    std::vector<float> values_;
};

}  // namespace halflight
