#include "api/halflight/picture_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <exception>
#include <list>
#include <optional>

#include "api/halflight/camera.h"
#include "api/halflight/statistics.h"
#include "api/picture/exr_attributes.h"
#include "api/sequence/fingerprint.h"
#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/io/files.h"
#include "engine/io/jpeg.h"
#include "engine/io/png.h"
#include "engine/scene/focal_length.h"
#include "engine/settings/layers.h"

namespace halflight {
namespace {

/// Returns whether a layer is a colour, which is converted between RGB spaces. Variances are not.
bool is_color(const ExrLayer& layer) {
    const AovInfo* const known = find_aov(layer.name);
    return known && known->is_color();
}

/// Names of the views of Stereo::views.
const std::vector<std::string> kViews{"left", "right"};

/// Splits layers of two eyes, one above the other, into views. `images` keeps their pixels.
std::vector<ExrLayerView> views_of(const std::vector<ExrLayerView>& layers, std::list<Image>& images) {
    std::vector<ExrLayerView> views;
    for (const int view : {0, 1}) {
        for (const ExrLayerView& layer : layers) {
            const ivec2 size(layer.image.width, layer.image.height / 2);
            views.push_back({layer.channels, images.emplace_back(part_of(layer.image, {0, view * size.y}, size)),
                             layer.type, layer.color, layer.exact, layer.name, view});
        }
    }
    return views;
}

void write_exr_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    std::vector<ExrLayerView> layers;
    layers.push_back({.channels = renamed(info.aov_names, "rgba", {"R", "G", "B", "A"}),
                      .image = result.beauty,
                      .type = info.half ? ExrType::half : ExrType::float32,
                      .color = info.working_space.from_rec709,
                      .name = "rgba"});
    for (const ExrLayer& aov : result.aovs)
        layers.push_back({.channels = renamed(info.aov_names, aov.name, aov.channels),
                          .image = aov.image,
                          .type = aov.type,
                          .color = is_color(aov) ? info.working_space.from_rec709 : mat3(1),
                          .exact = !is_color(aov),
                          .name = aov.name});

    ivec2 whole = info.whole.x > 0 ? info.whole : ivec2(result.beauty.width, result.beauty.height);
    std::list<Image> images;
    const bool views = info.camera.optics.stereo == Stereo::views;
    if (views) layers = views_of(layers, images), whole.y /= 2;
    ExrAttributes attributes = exr_attributes(result, info, whole);
    if (views) attributes.views = kViews;
    add_fingerprint(attributes, info.fingerprint, layers);
    write_exr_views(path, layers, attributes, info.exr);
}

/// Logs how many values of colours a file of half floats cannot hold.
void warn_beyond_half(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info,
                      const Log& log) {
    constexpr float kMost = 65504;
    std::size_t beyond = 0;
    const auto count = [&](const Image& image, const mat3& color) {
        const auto channels = static_cast<std::size_t>(image.channels);
        for (std::size_t i = 0; i + 3 <= image.pixels.size(); i += channels) {
            const vec3 stored = color * vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]);
            for (int c = 0; c < 3; ++c) beyond += std::isfinite(stored[c]) && std::abs(stored[c]) > kMost;
        }
    };
    if (info.half) count(result.beauty, info.working_space.from_rec709);
    for (const ExrLayer& aov : result.aovs)
        if (aov.type == ExrType::half && aov.image.channels >= 3)
            count(aov.image, is_color(aov) ? info.working_space.from_rec709 : mat3(1));
    if (beyond > 0)
        log.warn("{}: {} values are beyond {}, the largest half float, which is stored in their place", path.string(),
                 beyond, kMost);
}

/// Returns the picture through the view transform, with alpha if it is transparent.
Image view_of(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    if (result.view.pixels.empty())
        throw Error(path.string(), "not written: the picture was made without its view (want_view)");
    check_alpha(path, info.transparent);
    check_encoding(path, info.tiff, info.encoding);
    return info.transparent ? result.view : rgb(result.view);
}

/// Returns the profile of pictures through the view transform; empty: none.
std::string profile_of(const PictureInfo& info) {
    return info.encoding ? icc_profile(*info.encoding) : "";
}

std::string png_of(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    const Image picture = view_of(path, result, info);
    PngOptions options{.bits = info.png_bits, .encoding = info.encoding};
    if (!info.view_fingerprint.empty()) options.text = {kFingerprintName, info.view_fingerprint};
    return encode_png(path.string(), picture, options);
}

std::string jpeg_of(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    const Image picture = view_of(path, result, info);
    return encode_jpeg(path.string(), picture.width, picture.height, quantize_8bit(picture), info.jpeg_quality,
                       fingerprint_text(info.view_fingerprint), profile_of(info));
}

std::string tiff_of(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    Image picture;
    std::optional<Chromaticities> primaries;
    std::string profile;
    const bool view = holds_view(path, info.tiff);
    if (view) {
        picture = view_of(path, result, info);
        profile = profile_of(info);
    } else {
        primaries = info.working_space.chromaticities;
        picture = result.beauty;
        for (std::size_t i = 0; i + 4 <= picture.pixels.size(); i += 4) {
            const vec3 color =
                info.working_space.from_rec709 * vec3(picture.pixels[i], picture.pixels[i + 1], picture.pixels[i + 2]);
            for (int c = 0; c < 3; ++c) picture.pixels[i + static_cast<std::size_t>(c)] = color[c];
        }
    }
    return encode_tiff(path.string(), picture, info.tiff,
                       fingerprint_text(view ? info.view_fingerprint : info.fingerprint), primaries, profile);
}

/// A format of picture files.
struct Format {
    std::string_view extension;
    // Returns the bytes of the file; null: write_exr_picture() writes it.
    std::string (*encode)(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info);
};
constexpr Format kFormats[] = {{"exr", nullptr},  {"png", png_of},  {"jpg", jpeg_of},
                               {"jpeg", jpeg_of}, {"tif", tiff_of}, {"tiff", tiff_of}};

/// Returns the attributes of OpenEXR's standard that describe camera, lens and exposure, as far as they are known, and
/// the time of rendering unless files must not depend on it.
std::map<std::string, float> numbers_of(const FrameRenderer& renderer, const RenderStats& stats,
                                        const OutputOptions& options) {
    const RenderSettings& settings = renderer.settings();
    const PhysicalCamera& physical = settings.view.camera;
    std::map<std::string, double> numbers;
    Camera camera = settings.camera;
    const double aspect = eye_aspect(camera.optics, {settings.width, settings.height});
    camera.lens = stats.lens;
    if (camera.lens.sensor == 0) camera.lens.sensor = physical.lens.sensor;
    double diameter = 0;  // diameter of the aperture, mm; 0: not known
    if (camera.lens.blurs()) {
        numbers["focus"] = camera.lens.focus.distance;
        diameter = 2000 * aperture_radius(camera, aspect);
    }
    if (!camera.orthographic && camera.optics.projection == Projection::camera) {
        const double length = focal_length(camera, aspect);
        numbers["effectiveFocalLength"] = length;
        if (diameter > 0) numbers["aperture"] = length / diameter;
    }
    if (physical.exposes()) {
        numbers["isoSpeed"] = physical.iso > 0 ? double{physical.iso} : PhysicalCamera::kUsualIso;
        numbers["expTime"] =
            physical.shutter_speed.seconds > 0 ? double{physical.shutter_speed.seconds} : PhysicalCamera::kUsualSeconds;
        if (diameter == 0)
            numbers["aperture"] = physical.lens.fstop > 0 ? double{physical.lens.fstop} : PhysicalCamera::kUsualFstop;
    }
    if (renderer.shutter().open > 0)
        numbers["expTime"] = renderer.shutter().open * renderer.scene().frame_rate().seconds(1);
    if (!options.reproducible && !date_is_fixed()) numbers["renderTime"] = stats.render_seconds;
    std::map<std::string, float> floats;
    for (const auto& [name, value] : numbers) floats[name] = static_cast<float>(value);
    return floats;
}

}  // namespace

ExrAttributes exr_attributes(const RenderResult& result, const PictureInfo& info, const ivec2& whole) {
    ExrAttributes attributes;
    attributes.display = whole;
    attributes.origin = info.origin;
    attributes.chromaticities = info.working_space.chromaticities;
    attributes.world_to_camera = glm::inverse(info.camera.camera_to_world);
    if (!info.camera.optics.traced())
        attributes.world_to_clip = standard_clip(info.camera, static_cast<double>(whole.x) / whole.y);
    if (!info.reproducible) attributes.capture_date = capture_date_now();
    attributes.frame_rate = info.frame_rate;
    if (info.frame_rate) attributes.time_code = time_code(*info.frame_rate, info.frame);
    attributes.extra = result.attributes;
    attributes.software = "halflight " HALFLIGHT_VERSION;
    attributes.comments = info.comments;
    const std::pair<const char*, const std::string&> extra[] = {
        {"filter", info.filter},   {"lens", info.lens}, {"projection", info.projection},
        {"shutter", info.shutter}, {"bias", info.bias}, {"error", info.error}};
    for (const auto& [name, value] : extra)
        if (!value.empty()) attributes.extra[name] = value;
    if (!info.camera.name.empty()) attributes.extra["cameraLabel"] = info.camera.name;
    attributes.numbers = info.numbers;
    if (info.samples > 0) attributes.counts["samples"] = info.samples;
    return attributes;
}

void add_fingerprint(ExrAttributes& attributes, const std::string& fingerprint, std::span<const ExrLayerView> layers) {
    if (fingerprint.empty()) return;
    std::size_t channels = 0;
    for (const ExrLayerView& layer : layers) channels += layer.channels.size();
    const Image& image = layers[0].image;
    attributes.extra[kFingerprintName] = fingerprint_of_exr(fingerprint, image.width, image.height, channels);
}

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string own = path.extension().string();
    return own.starts_with('.') &&
           std::ranges::equal(own.substr(1), extension, {}, [](unsigned char c) { return std::tolower(c); });
}

std::string picture_extensions() {
    return ".exr, .png, .jpg or .tif";
}

bool is_picture_name(const std::filesystem::path& path) {
    return std::ranges::any_of(kFormats, [&](const Format& format) { return has_extension(path, format.extension); });
}

bool holds_view(const std::filesystem::path& path, TiffType tiff) {
    if (has_extension(path, "exr")) return false;
    return tiff != TiffType::float32 || !(has_extension(path, "tif") || has_extension(path, "tiff"));
}

void check_alpha(const std::filesystem::path& path, bool transparent) {
    if (transparent && (has_extension(path, "jpg") || has_extension(path, "jpeg")))
        throw Error(path.string(), "has no alpha channel for a transparent picture; .png, .tif and .exr do");
}

void check_encoding(const std::filesystem::path& path, TiffType tiff, const std::optional<DisplayEncoding>& encoding) {
    if (encoding && encoding->is_hdr() && holds_view(path, tiff) && !has_extension(path, "png"))
        throw Error(path.string(), "cannot say that its picture is for an HDR display; .png and movies can");
}

void check_size(const std::filesystem::path& path, const ivec2& size) {
    if ((has_extension(path, "jpg") || has_extension(path, "jpeg")) && std::max(size.x, size.y) > kMostJpegSide)
        throw Error(path.string(), "{} x {} pixels: the sides of a JPEG end at {}", size.x, size.y, kMostJpegSide);
}

int png_bits(const OutputOptions& options, const std::optional<DisplayEncoding>& encoding) {
    if (options.png_bits > 0) return options.png_bits;
    return encoding && encoding->is_hdr() ? 16 : 8;  // 8 bits of PQ show bands
}

void set_display(PictureInfo& info, const ViewProcessor& view, const OutputOptions& options) {
    info.encoding = view.encoding();
    info.png_bits = png_bits(options, info.encoding);
    if (info.encoding && info.encoding->is_srgb()) info.encoding.reset();
}

LinearSpace working_space(const ColorConfig& config, const std::string& name) {
    return config.linear_space(name == "rec709" ? "" : name);
}

void write_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    if (has_extension(path, "exr")) return write_exr_picture(path, result, info);
    const auto format =
        std::ranges::find_if(kFormats, [&](const Format& f) { return f.encode && has_extension(path, f.extension); });
    if (format == std::end(kFormats)) throw Error(path.string(), "a picture is an {}", picture_extensions());
    write_file(path, format->encode(path, result, info));
}

void write_pictures(const std::vector<std::filesystem::path>& paths, const RenderResult& result,
                    const PictureInfo& info, const Log& log) {
    std::exception_ptr first;
    for (const auto& path : paths) {
        try {
            write_picture(path, result, info);
            if (has_extension(path, "exr")) warn_beyond_half(path, result, info, log);
        } catch (const Error& error) {
            const bool disk = dynamic_cast<const DiskError*>(&error) != nullptr;  // the first one tells it
            if (first && !disk) log.warn("{}", error.what());
            if (!first) first = std::current_exception();
        }
    }
    if (first) std::rethrow_exception(first);
}

PictureInfo picture_info(const FrameRenderer& renderer, const RenderResult& result, const OutputOptions& options,
                         const std::string& error) {
    const RenderSettings& settings = renderer.settings();
    PictureInfo info{.camera = settings.camera,
                     .working_space = working_space(renderer.colors(), options.working_space),
                     .half = settings.half_color,
                     .whole = {settings.width, settings.height},
                     .origin = data_window(settings).first,
                     .transparent = settings.transparent,
                     .exr = options.exr,
                     .aov_names = options.aov_names,
                     .jpeg_quality = options.jpeg_quality,
                     .tiff = options.tiff,
                     .numbers = numbers_of(renderer, result.stats, options),
                     .samples = result.stats.samples,
                     .comments = settings_line(renderer, result.stats),
                     .filter = text(settings.filter),
                     .lens = lens_text(settings.camera, result.stats.lens, {settings.width, settings.height}),
                     .projection = text(settings.camera.optics),
                     .shutter = shutter_text(renderer.shutter(), renderer.scene(), settings),
                     .bias = fmt::format("{}", fmt::join(result.stats.biases, "; ")),
                     .error = error,
                     .reproducible = options.reproducible};
    set_display(info, renderer.colors().view(settings.view), options);
    return info;
}

std::string judge(const RenderStats& stats, const OutputOptions& options, const std::filesystem::path& output,
                  const Log& log) {
    if (const std::string bad = describe_bad_values(stats); !bad.empty()) {
        if (options.strict) throw Error(output.string(), "not written: {}", bad);
        log.warn("{}; they count as 0", bad);
    }
    if (!stats.tracing_note.empty()) log.warn("{}", stats.tracing_note);
    std::string of_denoised;
    if (stats.denoised_error) {
        of_denoised = error_line(*stats.denoised_error);
        log.note("{}", of_denoised);
    }
    if (!stats.error) return of_denoised;
    const std::string error = error_line(*stats.error);
    if (!stats.error->reached && !options.best_effort)
        throw Error(output.string(), "not written: after {} samples per pixel, {}; see --best-effort", stats.samples,
                    error);
    log.note("{}", error);
    return of_denoised.empty() ? error : error + "; " + of_denoised;
}

}  // namespace halflight
