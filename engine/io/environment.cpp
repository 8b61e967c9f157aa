#include "engine/io/environment.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "engine/core/chromaticities.h"
#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/radiance.h"

namespace halflight {
namespace {

bool contains(std::string_view text, std::string_view lower) {
    const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == b; };
    return std::search(text.begin(), text.end(), lower.begin(), lower.end(), same) != text.end();
}

/// Returns the names of layers with channels R, G and B, without Cryptomattes, whose values are no colours. A layer
/// that other programs name as the picture comes first.
std::vector<std::string> colour_layers(const ExrFile& file) {
    std::vector<std::string> layers;
    for (const ExrChannel& channel : file.channels) {
        if (!channel.name.ends_with(".R")) continue;
        const std::string layer = channel.name.substr(0, channel.name.size() - 2);
        if (file.find(layer + ".G") && file.find(layer + ".B") && !contains(layer, "crypto")) layers.push_back(layer);
    }
    // clang 14 cannot compile std::ranges::search and std::ranges::stable_partition.
    std::stable_partition(layers.begin(), layers.end(), [](const std::string& layer) {
        return contains(layer, "combined") || contains(layer, "beauty") || contains(layer, "rgba");
    });
    return layers;
}

/// Returns the channels to read as R, G, B: channels of these names, bare or of a layer, else luminance. The report
/// names a layer that was chosen among others.
std::vector<std::string> colour_channels(const std::string& subject, const ExrFile& file, SceneReport& report) {
    if (file.find("R") && file.find("G") && file.find("B")) return {"R", "G", "B"};
    if (const std::vector<std::string> layers = colour_layers(file); !layers.empty()) {
        if (layers.size() > 1)
            report.warnings.push_back(
                fmt::format("{}: has no plain R, G, B; its layer '{}' is the environment", subject, layers[0]));
        return {layers[0] + ".R", layers[0] + ".G", layers[0] + ".B"};
    }
    std::vector<std::string> others;
    for (const ExrChannel& channel : file.channels)
        if (channel.name != "A" && !channel.name.ends_with(".A")) others.push_back(channel.name);
    if (file.find("Y")) return {"Y", "Y", "Y"};
    if (others.size() == 1) return {others[0], others[0], others[0]};
    throw Error(subject, "has no colour among its channels: {}",
                others.empty() ? "none" : fmt::format("{}", fmt::join(others, ", ")));
}

/// Replaces NaN and negative values by 0, and infinity by the largest finite value. Returns the number of such texels.
std::size_t repair(Image& map) {
    float largest = 0;
    for (float v : map.pixels)
        if (std::isfinite(v)) largest = std::max(largest, v);
    std::size_t repaired = 0;
    for (std::size_t i = 0; i < map.pixels.size(); i += 3) {
        bool bad = false;
        for (std::size_t c = i; c < i + 3; ++c) {
            float& v = map.pixels[c];
            if (std::isfinite(v) && v >= 0) continue;
            v = std::isinf(v) && v > 0 ? largest : 0;
            bad = true;
        }
        repaired += bad;
    }
    return repaired;
}

/// Converts to linear Rec.709. Colours outside its gamut are clipped.
void convert(const std::string& subject, Image& map, const Chromaticities& from) {
    const dmat3 matrix = rgb_conversion(from, kRec709);
    for (int i = 0; i < 3; ++i)
        if (!all_finite(vec3(matrix[i]))) throw Error(subject, "is damaged: its chromaticities span no colours");
    for (std::size_t i = 0; i < map.pixels.size(); i += 3) {
        // Products of floats cannot overflow in double; infinities of both signs would make a NaN.
        const dvec3 colour = matrix * dvec3(map.pixels[i], map.pixels[i + 1], map.pixels[i + 2]);
        for (std::size_t c = 0; c < 3; ++c)
            map.pixels[i + c] = static_cast<float>(
                std::clamp(colour[static_cast<int>(c)], 0.0, double{std::numeric_limits<float>::max()}));
    }
}

}  // namespace

Environment load_environment(const std::filesystem::path& path, SceneReport& report, const ExrLimits& limits) {
    const std::string subject = path.string();
    Environment environment;
    environment.name = path.filename().string();
    environment.color = vec3(1);

    std::optional<Chromaticities> primaries;
    std::string bytes = read_file(path, limits.max_bytes);
    if (is_lfs_pointer(bytes)) throw Error(subject, "is a Git LFS pointer, not the file itself");
    if (is_radiance(bytes)) {
        RadiancePicture picture = read_radiance(subject, bytes, limits);
        if (picture.exposure != 1)
            report.warnings.push_back(fmt::format("{}: EXPOSURE {} is not divided out", subject, picture.exposure));
        environment.map = std::move(picture.image);
    } else if (is_exr(bytes)) {
        bytes.clear();
        bytes.shrink_to_fit();
        const ExrFile file = read_exr(path, limits);
        environment.map = file.image(colour_channels(subject, file, report));
        primaries = file.attributes.chromaticities;
    } else {
        throw Error(subject, "is neither an OpenEXR nor a Radiance file");
    }

    Image& map = environment.map;
    if (const std::size_t repaired = repair(map)) {
        report.environment_texels_repaired += repaired;
        report.warnings.push_back(
            fmt::format("{}: {} texels that were not finite or negative were repaired", subject, repaired));
    }
    if (primaries && !same_space(*primaries, kRec709)) convert(subject, map, *primaries);
    if (map.width != 2 * map.height)
        report.warnings.push_back(fmt::format("{}: {} x {} is not 2:1; the map is stretched over the sphere", subject,
                                              map.width, map.height));
    if (std::all_of(map.pixels.begin(), map.pixels.end(), [](float v) { return v == 0; })) {
        report.warnings.push_back(fmt::format("{}: is entirely black", subject));
        environment.color = vec3(0);
        map = Image();
    }
    return environment;
}

}  // namespace halflight
