#include "engine/io/environment.h"

#include <ImfEnvmap.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/core/chromaticities.h"
#include "engine/core/error.h"
#include "engine/core/math.h"
#include "engine/io/files.h"
#include "engine/io/radiance.h"

namespace halflight {
namespace {

/// Channels that may be the light.
struct Light {
    std::vector<std::string> channels;  // names of the channels to read as R, G, B
    std::string name{};                 // phrase that names the layer or part; empty: plain channels of the only part
    bool view = false;                  // the file has several views, and this is one
    /// Rank; the lowest is preferred. Plain channels come before named ones, and R, G, B before Y. Layers whose names
    /// do not say that they are the picture come last.
    int place = 0;
};

/// Returns the channels R, G, B or Y, plain or of a layer, best first. Data that is no light is left out. Y beside X is
/// a coordinate.
std::vector<Light> lights_of(const ExrFile& file) {
    std::vector<Light> lights;
    const std::vector<std::string>& views = file.attributes.views;
    for (const std::vector<std::string>& channels : {std::vector<std::string>{"R", "G", "B"}, {"Y", "Y", "Y"}}) {
        const bool grey = channels[0] == "Y";
        for (const ExrChannel& first : file.channels) {
            if (first.name != channels[0] && !first.name.ends_with("." + channels[0])) continue;
            const std::string prefix = first.name.substr(0, first.name.size() - 1);
            const std::string layer = prefix.substr(0, prefix.size() - !prefix.empty());
            Light light{{prefix + channels[0], prefix + channels[1], prefix + channels[2]}};
            const auto usable = [&](const std::string& name) {
                const ExrChannel* channel = file.find(name);
                return channel && picture_rank(channel->part) < 2;
            };
            const ExrChannel* const x = grey ? file.find(prefix + "X") : nullptr;
            if (!std::ranges::all_of(light.channels, usable) || (x && x->part == first.part)) continue;
            if (picture_rank(layer) == 2 || file.is_cryptomatte(prefix)) continue;
            const std::string& name = layer.empty() ? first.part : layer;
            if (!name.empty()) light.name = fmt::format("{} '{}'", layer.empty() ? "part" : "layer", name);
            light.view = views.size() > 1 && (layer.empty() || std::ranges::count(views, layer) > 0);
            light.place = (name.empty() ? 0 : picture_rank(name) == 0 ? 1 : 4) + (grey ? 2 : 0);
            lights.push_back(light);
        }
    }
    std::ranges::stable_sort(lights, {}, &Light::place);
    return lights;
}

/// Returns the channels to read as R, G, B. The report names a layer, part or view that was chosen among others.
std::vector<std::string> colour_channels(const std::string& subject, const ExrFile& file, SceneReport& report) {
    const std::vector<Light> lights = lights_of(file);
    if (lights.empty()) {
        std::vector<std::string> all;
        for (const ExrChannel& channel : file.channels) all.push_back(channel.name);
        throw Error(subject, "has no light, R, G, B or Y, among its channels: {}",
                    all.empty() ? "none" : fmt::format("{}", fmt::join(all, ", ")));
    }
    const Light& taken = lights[0];
    const bool grey = taken.channels[0].ends_with("Y");
    std::string what = grey ? "Y" : "R, G, B";
    if (!taken.name.empty() || taken.view) what += " of " + (taken.name.empty() ? "the first view" : taken.name);
    std::vector<std::string> others;
    for (const Light& light : std::span(lights).subspan(1))
        others.push_back(light.name.empty() ? "plain " + light.channels[0] : light.name);
    // Plain R, G, B beside layers are the picture by convention.
    if (!others.empty() && (taken.place > 0 || taken.view))
        report.warnings.push_back(
            fmt::format("{}: its light is {}; ignored: {}", subject, what, fmt::join(others, ", ")));
    return taken.channels;
}

/// Returns the environment of a file. Pixels outside the display window are left out, and missing ones are black. The
/// attribute envmap says that the data window is the map (ImfEnvmap.h).
Image map_of(const std::string& subject, const ExrFile& file, SceneReport& report) {
    const auto warn = [&](const std::string& what) { report.warnings.push_back(fmt::format("{}: {}", subject, what)); };
    for (const std::string& part : file.deep_parts) warn(fmt::format("its part '{}' of deep data is ignored", part));
    const std::vector<std::string> channels = colour_channels(subject, file, report);
    const ExrWindow data = file.window_of(channels), display{ivec2(0), file.attributes.display.value()};
    const ivec2 first = data.origin, last = first + data.size, size = display.size;
    if (file.envmap != ExrEnvmap::none) {
        if (data != display)
            warn(fmt::format("its attribute envmap says that the pixels {},{} to {},{} are the map, not its {} x {}",
                             first.x, first.y, last.x, last.y, size.x, size.y));
        return file.image(channels);
    }
    if (!data.contains(display))
        warn(fmt::format("has the pixels {},{} to {},{} of {} x {}; the others are black", first.x, first.y, last.x,
                         last.y, size.x, size.y));
    if (!display.contains(data))
        warn(fmt::format("its pixels outside the display window of {} x {} are ignored", size.x, size.y));
    return file.displayed(channels);
}

/// Returns the equirectangular map of a cube map, whose faces ImfEnvmap.h arranges. The cube is interpolated linearly.
Image map_of_cube(const std::string& subject, const Image& cube, const ExrLimits& limits) {
    const int face_size = cube.width;
    if (cube.height != 6 * face_size)
        throw Error(subject, "is a cube map of {} x {} pixels, which is not 1:6", cube.width, cube.height);
    const std::uint64_t bytes =
        2 * 4 * 3 * sizeof(float) * static_cast<std::uint64_t>(face_size) * static_cast<std::uint64_t>(face_size);
    if (bytes > limits.max_bytes)
        throw Error(subject, "makes a map of {} bytes, more than the limit of {}{}", bytes, limits.max_bytes,
                    limits.reason);
    const Imath::Box2i window({0, 0}, {cube.width - 1, cube.height - 1});
    const auto pixel = [&](int x, int y) {
        const float* const p = cube.at(x, y);
        return vec3(p[0], p[1], p[2]);
    };
    return equirectangular(face_size, [&](const dvec3& direction) {
        Imf::CubeMapFace face{};
        Imath::V2f in_face;
        const Imath::V3f exr(Imath::V3d(-direction.z, direction.y, direction.x));  // ImfEnvmap.h: +Z is the centre
        Imf::CubeMap::faceAndPixelPosition(exr, window, face, in_face);
        const Imath::V2f place = Imf::CubeMap::pixelPosition(face, window, in_face);
        const int top = face * face_size, end = face_size - 1;
        const int x = std::clamp(static_cast<int>(place.x), 0, end), right = std::min(x + 1, end);
        const int y = std::clamp(static_cast<int>(place.y), top, top + end), below = std::min(y + 1, top + end);
        const float tx = place.x - static_cast<float>(x), ty = place.y - static_cast<float>(y);
        return glm::mix(glm::mix(pixel(x, y), pixel(right, y), tx), glm::mix(pixel(x, below), pixel(right, below), tx),
                        ty);
    });
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

Image equirectangular(int face_size, const std::function<vec3(const dvec3&)>& radiance) {
    constexpr int kSteps = 2;  // directions of a texel along each axis
    Image map(4 * face_size, 2 * face_size, 3);
    const auto fill_row = [&](int y) {
        for (int x = 0; x < map.width; ++x) {
            vec3 sum(0);
            for (int i = 0; i < kSteps * kSteps; ++i) {
                const double u = (x + (i % kSteps + 0.5) / kSteps) / map.width;
                const double v = (y + (i / kSteps + 0.5) / kSteps) / map.height;
                const double longitude = kPi * (1 - 2 * u), latitude = kPi * (0.5 - v);
                sum += radiance(dvec3(std::cos(longitude) * std::cos(latitude), std::sin(latitude),
                                      -std::sin(longitude) * std::cos(latitude)));
            }
            for (int c = 0; c < 3; ++c) map.at(x, y)[c] = sum[c] / float(kSteps * kSteps);
        }
    };
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, map.height, fill_row); });
    return map;
}

Environment load_environment(const std::filesystem::path& path, SceneReport& report, const ExrLimits& limits) {
    const std::string subject = path.string();
    Environment environment;
    environment.name = path.filename().string();
    environment.color = vec3(1);

    std::optional<Chromaticities> primaries;
    bool cube = false;
    std::string bytes = read_file(path, limits.max_bytes);
    if (is_lfs_pointer(bytes)) throw Error(subject, "is a Git LFS pointer, not the file itself");
    if (is_radiance(bytes)) {
        RadiancePicture picture = read_radiance(subject, bytes, limits);
        for (const std::string& note : picture.notes) report.warnings.push_back(fmt::format("{}: {}", subject, note));
        environment.map = std::move(picture.image);
        primaries = picture.primaries;
    } else if (is_exr(bytes)) {
        bytes.clear();
        bytes.shrink_to_fit();
        const ExrFile file = read_exr(path, limits);
        environment.map = map_of(subject, file, report);
        primaries = file.attributes.chromaticities;
        cube = file.envmap == ExrEnvmap::cube;
    } else {
        throw Error(subject, "is neither an OpenEXR nor a Radiance file");
    }

    Image& map = environment.map;
    if (const std::size_t repaired = repair(map)) {
        report.environment_texels_repaired += repaired;
        report.warnings.push_back(
            fmt::format("{}: {} texels that were not finite or negative were repaired", subject, repaired));
    }
    if (cube) map = map_of_cube(subject, map, limits);
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
