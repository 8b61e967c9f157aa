// The encoding of a view's display, measured through OpenColorIO: names of displays differ from config to config.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/color/ocio.h"

namespace halflight {
namespace {

/// Returns the linear light of a grey value; PQ in units of 10000 nits.
double decoded(TransferCurve curve, double v) {
    switch (curve) {
        case TransferCurve::bt1886:
            return std::pow(v, 2.4);
        case TransferCurve::gamma22:
            return std::pow(v, 2.2);
        case TransferCurve::gamma26:
            return std::pow(v, 2.6);
        case TransferCurve::srgb:
            return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        case TransferCurve::pq: {  // SMPTE ST 2084, equation 4.1
            const double p = std::pow(v, 32.0 / 2523);
            return std::pow(std::max(p - 107.0 / 128, 0.0) / (2413.0 / 128 - 2392.0 / 128 * p), 8192.0 / 1305);
        }
        case TransferCurve::hlg:  // ITU-R BT.2100, table 5, at 1000 nits
            return std::pow(v <= 0.5 ? v * v / 3 : (std::exp((v - 0.55991073) / 0.17883277) + 0.28466892) / 12, 1.2);
    }
    return 0;
}

constexpr std::uint8_t kPrimaries[] = {1, 9, 12, 11};
constexpr TransferCurve kCurves[] = {TransferCurve::srgb,    TransferCurve::bt1886, TransferCurve::gamma22,
                                     TransferCurve::gamma26, TransferCurve::pq,     TransferCurve::hlg};

}  // namespace

std::optional<DisplayEncoding> encoding_of(const ocio::Config& config, const ocio::ConstColorSpaceRcPtr& space) {
    if (!space || space->isData() || space->getReferenceSpaceType() != ocio::REFERENCE_SPACE_DISPLAY)
        return std::nullopt;
    constexpr int kSteps = 10;
    std::array<float, 3 * (3 + kSteps)> colours{};
    for (std::size_t c = 0; c < 3; ++c) colours[4 * c] = 1;
    for (std::size_t i = 0; i < 3 * kSteps; ++i) colours[9 + i] = static_cast<float>(i / 3 + 1) / kSteps;
    try {
        // The reference space of displays is CIE XYZ relative to D65.
        ocio::ConstTransformRcPtr transform = space->getTransform(ocio::COLORSPACE_DIR_TO_REFERENCE);
        ocio::TransformDirection direction = ocio::TRANSFORM_DIR_FORWARD;
        if (!transform) {
            transform = space->getTransform(ocio::COLORSPACE_DIR_FROM_REFERENCE);
            direction = ocio::TRANSFORM_DIR_INVERSE;
        }
        if (!transform) return std::nullopt;
        ocio::PackedImageDesc pixels(colours.data(), 3 + kSteps, 1, 3);
        config.getProcessor(transform, direction)->getDefaultCPUProcessor()->apply(pixels);
    } catch (const ocio::Exception&) {
        return std::nullopt;  // the display has no inverse
    }
    const auto at = [&](int i) {
        const float* const xyz = &colours[3 * static_cast<std::size_t>(i)];
        return dvec3(xyz[0], xyz[1], xyz[2]);
    };
    const auto xy_of = [](const dvec3& xyz) { return dvec2(xyz) / (xyz.x + xyz.y + xyz.z); };
    const double white = at(2 + kSteps).y;
    if (!(white > 0)) return std::nullopt;
    const auto fits_primaries = [&](std::uint8_t primaries) {
        // Whites other than D65 are adapted to it.
        const DisplayEncoding encoding{primaries, TransferCurve::srgb};
        const dmat3 expected = rgb_to_xyz(kRec709) * rgb_conversion(chromaticities_of(encoding), kRec709);
        double most = 0;
        for (int c = 0; c < 3; ++c) most = std::max(most, glm::distance(xy_of(at(c)), xy_of(expected[c])));
        return most < 2e-3;
    };
    const auto fits_curve = [&](TransferCurve curve) {
        double most = 0;
        for (int i = 0; i < kSteps; ++i)
            most = std::max(most, std::abs(std::cbrt(at(3 + i).y / white) -
                                           std::cbrt(decoded(curve, double(i + 1) / kSteps) / decoded(curve, 1))));
        return most < 2e-3;
    };
    const auto* const primaries = std::ranges::find_if(kPrimaries, fits_primaries);
    const auto* const curve = std::ranges::find_if(kCurves, fits_curve);
    if (primaries == std::end(kPrimaries) || curve == std::end(kCurves)) return std::nullopt;
    return DisplayEncoding{*primaries, *curve};
}

}  // namespace halflight
