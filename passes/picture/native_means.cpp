#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "passes/picture/native_means.cpp"
#include <hwy/foreach_target.h>
// Highway compiles the code below once per instruction set.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <algorithm>
#include <vector>

#include "passes/picture/native_means.h"
#include "passes/picture/native_means_planes.h"

HWY_BEFORE_NAMESPACE();
namespace halflight::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

// The constants are those of shaders/nl_means.comp and lib/surface_likeness.glsl.
constexpr float kStrength = 0.4f, kBrighter = 0.4f, kMostApart = 1e4f;
constexpr float kNormals = 1 / 0.09f, kAlbedos = 1 / 0.25f, kDepths = 1 / 0.04f, kMirrors = 1 / 0.25f;
constexpr float kNoWeight = 30;  // exp(-30) is no weight beside that of the pixel itself, which is 1

constexpr int kWide = kMeansTileWidth + 2 * kMostPatch + 16;  // width of a row of differences, with the last register

HWY_INLINE V at(const float* from) {
    return hn::LoadU(D(), from);
}
HWY_INLINE V square(V v) {
    return hn::Mul(v, v);
}

/// Sums of a tile.
struct Scratch {
    HWY_ALIGN float apart[2][kMeansTileHeight + 2 * kMostPatch][kWide];  // differences of pixels, by half
    HWY_ALIGN float columns[2][kWide];                                   // sums over the columns of a row's patches
    HWY_ALIGN float sums[8][kMeansTileHeight][kMeansTileWidth];  // differences from own light, by channel; weights
};

/// Computes a row of differences of pixels and those at an offset (difference() of the shader).
HWY_INLINE void difference_row(const MeansPlanes& p, std::ptrdiff_t own, std::ptrdiff_t offset, int count, float* one,
                               float* two) {
    const D d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const V most = hn::Set(d, kMostApart), zero = hn::Zero(d), unit = hn::Set(d, 1.0f), two_parts = hn::Set(d, 2.0f);
    for (int x = 0; x < count; x += lanes) {
        const std::ptrdiff_t at_own = own + x, at_other = at_own + offset;
        const auto plane = [&](MeansPlane k, std::ptrdiff_t i) HWY_ATTR { return at(p.row(k) + i); };
        const V variance = plane(kVariance, at_own), other = plane(kVariance, at_other);
        const V share = plane(kShare, at_own);
        const V noise = hn::Add(variance, hn::MulAdd(hn::Set(d, 1 - kBrighter), hn::Min(variance, other),
                                                     hn::Mul(hn::Set(d, kBrighter), other)));
        const V scale = hn::Div(unit, hn::Mul(hn::Add(variance, other), hn::Set(d, kStrength * kStrength)));
        const V floor = hn::Mul(noise, scale);
        const auto both = hn::And(hn::Gt(share, zero), hn::Gt(plane(kShare, at_other), zero));
        const auto apart = [&](MeansPlane luminance, V parts) HWY_ATTR {
            const V between = hn::Sub(plane(luminance, at_own), plane(luminance, at_other));
            const V value = hn::Sub(hn::Div(hn::Mul(square(between), scale), hn::Mul(two_parts, parts)), floor);
            return hn::IfThenElseZero(both, hn::IfThenElse(hn::Le(value, most), value, most));
        };
        hn::StoreU(apart(kFirstLuminance, hn::Sub(unit, share)), d, one + x);
        hn::StoreU(apart(kSecondLuminance, share), d, two + x);
    }
}

template <int kPatch>
HWY_INLINE void sum_columns(const float (*rows)[kWide], int count, float* sums) {
    const D d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int x = 0; x < count; x += lanes) {
        V sum = at(rows[0] + x);
        for (int i = 1; i <= 2 * kPatch; ++i) sum = hn::Add(sum, at(rows[i] + x));
        hn::StoreU(sum, d, sums + x);
    }
}

template <int kPatch>
HWY_INLINE V patch_mean(const float* columns) {
    V sum = at(columns);
    for (int i = 1; i <= 2 * kPatch; ++i) sum = hn::Add(sum, at(columns + i));
    return hn::Mul(sum, hn::Set(D(), 1.0f / static_cast<float>((2 * kPatch + 1) * (2 * kPatch + 1))));
}

/// Returns minus the logarithm of likeness().
template <bool kMixed>
HWY_INLINE V unlikeness(const MeansPlanes& p, std::ptrdiff_t own, std::ptrdiff_t other) {
    const D d;
    const auto apart = [&](int plane) HWY_ATTR {
        const float* const from = p.row(static_cast<MeansPlane>(plane));
        return square(hn::Sub(at(from + own), at(from + other)));
    };
    V normals = hn::Add(hn::Add(apart(kNormal), apart(kNormal + 1)), apart(kNormal + 2));
    if (kMixed) {
        V variance = hn::Set(d, 1.0f);
        for (int axis = 0; axis < 3; ++axis)
            variance = hn::Sub(variance, square(at(p.row(static_cast<MeansPlane>(kNormal + axis)) + own)));
        normals = hn::Max(hn::Sub(normals, hn::Max(variance, hn::Zero(d))), hn::Zero(d));
    }
    const V albedos = hn::Add(hn::Add(apart(kAlbedo), apart(kAlbedo + 1)), apart(kAlbedo + 2));
    const V rest = hn::MulAdd(apart(kLogDepth), hn::Set(d, kDepths), hn::Mul(apart(kChain), hn::Set(d, kMirrors)));
    return hn::MulAdd(normals, hn::Set(d, kNormals), hn::MulAdd(albedos, hn::Set(d, kAlbedos), rest));
}

template <int kPatch>
void filter_rows(const MeansPlanes& p, const MeansKernel& kernel, ivec2 corner, int rows, Scratch& s) {
    const D d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const V no_weight = hn::Set(d, kNoWeight), zero = hn::Zero(d);
    for (auto& plane : s.sums)
        for (int y = 0; y < rows; ++y) std::fill_n(plane[y], kMeansTileWidth, 0.0f);
    for (int oy = -kernel.window; oy <= kernel.window; ++oy) {
        for (int ox = -kernel.window; ox <= kernel.window; ++ox) {
            const std::ptrdiff_t offset = p.step(kernel.stride * ivec2(ox, oy));
            const int wide = kMeansTileWidth + 2 * kPatch;
            for (int y = 0; y < rows + 2 * kPatch; ++y)
                difference_row(p, p.step(corner + ivec2(-kPatch, y - kPatch)), offset, wide, s.apart[0][y],
                               s.apart[1][y]);
            for (int y = 0; y < rows; ++y) {
                sum_columns<kPatch>(s.apart[0] + y, wide, s.columns[0]);
                sum_columns<kPatch>(s.apart[1] + y, wide, s.columns[1]);
                for (int x = 0; x < kMeansTileWidth; x += lanes) {
                    const std::ptrdiff_t own = p.step(corner + ivec2(x, y)), other = own + offset;
                    const V unlike = unlikeness<kPatch == 1>(p, own, other);
                    const V one = hn::Add(unlike, hn::Max(patch_mean<kPatch>(s.columns[0] + x), zero));
                    const V two = hn::Add(unlike, hn::Max(patch_mean<kPatch>(s.columns[1] + x), zero));
                    const V valid = at(p.row(kValid) + other);
                    if (hn::AllTrue(d, hn::Or(hn::Ge(hn::Min(one, two), no_weight), hn::Eq(valid, zero)))) continue;
                    // The second half decides about the first one, and the first half about the second one.
                    const V weights[2] = {hn::Mul(valid, hn::Exp(d, hn::Neg(two))),
                                          hn::Mul(valid, hn::Exp(d, hn::Neg(one)))};
                    for (int half = 0; half < 2; ++half) {
                        for (int c = 0; c < 3; ++c) {
                            const float* const light = p.row(static_cast<MeansPlane>(kLight + 3 * half + c));
                            float* const sum = s.sums[3 * half + c][y] + x;
                            hn::Store(hn::MulAdd(weights[half], hn::Sub(at(light + other), at(light + own)),
                                                 hn::Load(d, sum)),
                                      d, sum);
                        }
                        float* const sum = s.sums[6 + half][y] + x;
                        hn::Store(hn::Add(hn::Load(d, sum), weights[half]), d, sum);
                    }
                }
            }
        }
    }
}

void filter_tile(const MeansPlanes& p, const MeansKernel& kernel, ivec2 corner, const MeansOutput& to) {
    static thread_local Scratch s;
    const int rows = std::min(kMeansTileHeight, p.size.y - corner.y);
    (kernel.patch == 1 ? filter_rows<1> : filter_rows<3>)(p, kernel, corner, rows, s);
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < std::min(kMeansTileWidth, p.size.x - corner.x); ++x) {
            const std::ptrdiff_t own = p.step(corner + ivec2(x, y));
            const std::size_t texel = 4 * (static_cast<std::size_t>(corner.y + y) * static_cast<std::size_t>(p.size.x) +
                                           static_cast<std::size_t>(corner.x + x));
            for (int half = 0; half < 2; ++half) {
                float* const out = (half == 0 ? to.first : to.second).data() + texel;
                const float scale = 1 / std::max(s.sums[6 + half][y][x], 1e-20f);
                for (int c = 0; c < 3; ++c)
                    out[c] =
                        p.row(static_cast<MeansPlane>(kLight + 3 * half + c))[own] + scale * s.sums[3 * half + c][y][x];
                out[3] = p.row(kShare)[own];
            }
        }
    }
}

}  // namespace halflight::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "engine/rays/native.h"

namespace halflight {
namespace {
HWY_EXPORT(filter_tile);
}  // namespace

void filter_natively(const MeansKernel& kernel, ivec2 size, const MeansInput& input, const MeansOutput& output) {
    const int columns = (size.x + kMeansTileWidth - 1) / kMeansTileWidth;
    const int rows = (size.y + kMeansTileHeight - 1) / kMeansTileHeight;
    tbb::task_arena arena(rays::native_threads());
    arena.execute([&] {
        const MeansPlanes planes(size, input);
        tbb::parallel_for(tbb::blocked_range2d<int>(0, rows, 0, columns), [&](const tbb::blocked_range2d<int>& tiles) {
            for (int y = tiles.rows().begin(); y != tiles.rows().end(); ++y)
                for (int x = tiles.cols().begin(); x != tiles.cols().end(); ++x) HWY_DYNAMIC_DISPATCH(filter_tile)
            (planes, kernel, ivec2(kMeansTileWidth * x, kMeansTileHeight * y), output);
        });
    });
}

}  // namespace halflight

#endif
