#include "engine/core/display_encoding.h"

#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/math.h"

namespace halflight {
namespace {

void put(std::string& to, std::uint32_t value, int bytes = 4) {
    for (int i = bytes - 1; i >= 0; --i) to += static_cast<char>(value >> (8 * i));
}

/// Appends numbers in units of 2^-16 (ICC.1:2022, 4.6).
void put_fixed(std::string& to, std::initializer_list<double> values) {
    for (const double v : values) put(to, static_cast<std::uint32_t>(std::lround(v * 65536)));
}

void put_xyz(std::string& to, const dvec3& v) {
    put_fixed(to, {v.x, v.y, v.z});
}

std::string xyz_element(const dvec3& v) {
    std::string element("XYZ \0\0\0\0", 8);
    put_xyz(element, v);
    return element;
}

/// Returns a text in ASCII (ICC.1:2022, 10.15).
std::string text_element(std::string_view text) {
    std::string element("mluc\0\0\0\0", 8);
    put(element, 1), put(element, 12);
    element += "enUS";
    put(element, static_cast<std::uint32_t>(2 * text.size())), put(element, 28);
    for (const char c : text) put(element, static_cast<unsigned char>(c), 2);
    return element;
}

/// Returns the curve from values to linear light (ICC.1:2022, 10.18).
std::string curve_element(TransferCurve curve) {
    std::string element("para\0\0\0\0", 8);
    const bool srgb = curve == TransferCurve::srgb;
    put(element, srgb ? 3 : 0, 2), put(element, 0, 2);
    if (srgb)
        put_fixed(element, {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045});
    else
        put_fixed(element, {curve == TransferCurve::bt1886 ? 2.4 : curve == TransferCurve::gamma22 ? 2.2 : 2.6});
    return element;
}

constexpr dvec3 kD50{0.9642, 1, 0.8249};  // the white of profiles (ICC.1:2022, 7.2.16)

/// Returns the matrix of adaptation to D50 (ICC.1:2022, annex E).
dmat3 adaptation(const Chromaticities& c) {
    const dmat3 bradford =
        glm::transpose(dmat3(0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296));
    const dvec3 gain = (bradford * kD50) / (bradford * (rgb_to_xyz(c) * dvec3(1)));
    return glm::inverse(bradford) * dmat3(gain.x, 0, 0, 0, gain.y, 0, 0, 0, gain.z) * bradford;
}

}  // namespace

const Chromaticities& chromaticities_of(const DisplayEncoding& encoding) {
    switch (encoding.primaries) {
        case 1:
            return kRec709;
        case 9:
            return kRec2020;
        case 11:
            return kP3Dci;
        case 12:
            return kP3D65;
        default:
            throw std::out_of_range("colour primaries");
    }
}

std::string icc_profile(const DisplayEncoding& encoding) {
    if (encoding.is_hdr()) return "";
    const Chromaticities& c = chromaticities_of(encoding);
    const dmat3 adapted = adaptation(c), colours = adapted * rgb_to_xyz(c);
    std::string chad("sf32\0\0\0\0", 8);
    for (int row = 0; row < 3; ++row) put_fixed(chad, {adapted[0][row], adapted[1][row], adapted[2][row]});
    const std::string curve = curve_element(encoding.curve);
    const std::string name = encoding.primaries == 1 ? "Rec.709" : encoding.primaries == 9 ? "Rec.2020" : "P3";
    const std::pair<std::string_view, std::string> elements[] = {{"desc", text_element("Halflight " + name)},
                                                                 {"cprt", text_element("No copyright, use freely")},
                                                                 {"wtpt", xyz_element(kD50)},
                                                                 {"chad", chad},
                                                                 {"rXYZ", xyz_element(colours[0])},
                                                                 {"gXYZ", xyz_element(colours[1])},
                                                                 {"bXYZ", xyz_element(colours[2])},
                                                                 {"rTRC", curve},
                                                                 {"gTRC", curve},
                                                                 {"bTRC", curve}};
    const std::size_t start = 128 + 4 + 12 * std::size(elements);
    std::string table, data;
    put(table, std::size(elements));
    for (const auto& [signature, element] : elements) {
        const std::size_t shared = data.find(element);  // the three curves are stored once
        const std::size_t offset = shared != std::string::npos && shared % 4 == 0 ? shared : data.size();
        table += signature;
        put(table, static_cast<std::uint32_t>(start + offset)), put(table, static_cast<std::uint32_t>(element.size()));
        if (offset < data.size()) continue;
        data += element;
        data.resize((data.size() + 3) / 4 * 4);
    }
    std::string profile;  // its header (ICC.1:2022, 7.2)
    put(profile, static_cast<std::uint32_t>(start + data.size()));
    put(profile, 0), put(profile, 0x04400000);
    profile += "mntrRGB XYZ ";
    for (const std::uint32_t part : {2026u, 1u, 1u, 0u, 0u, 0u}) put(profile, part, 2);
    profile += "acsp";
    profile.resize(68);  // no platform, flags, device or intent
    put_xyz(profile, kD50);
    profile.resize(128);
    return profile + table + data;
}

}  // namespace halflight
