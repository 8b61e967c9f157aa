#include "api/halflight/picture_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "api/fingerprint.h"
#include "api/halflight/camera.h"
#include "api/halflight/statistics.h"
#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "engine/settings/layers.h"

namespace halflight {
namespace {

/// Returns whether the channels are a colour, which is converted between RGB spaces. Variances are not.
bool is_color(const std::vector<std::string>& channels) {
    const std::size_t dot = channels[0].find('.');
    if (dot == std::string::npos) return channels[0] == "R";  // the picture itself
    const AovInfo* const layer = find_aov(std::string_view(channels[0]).substr(0, dot));
    return layer && layer->is_color();
}

void write_exr_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    std::vector<ExrLayerView> layers;
    layers.push_back({{"R", "G", "B", "A"}, result.beauty, info.half ? ExrType::half : ExrType::float32});
    for (const ExrLayer& aov : result.aovs) layers.push_back({aov.channels, aov.image, aov.type});
    for (ExrLayerView& layer : layers)
        if (is_color(layer.channels)) layer.color = info.working_space.from_rec709;

    const double aspect = static_cast<double>(result.beauty.width) / result.beauty.height;
    ExrAttributes attributes;
    attributes.chromaticities = info.working_space.chromaticities;
    attributes.world_to_camera = glm::inverse(info.camera.camera_to_world);
    attributes.world_to_clip = standard_clip(info.camera, aspect);
    if (!info.reproducible) attributes.capture_date = capture_date_now();
    attributes.frame_rate = info.frame_rate;
    if (info.frame_rate) attributes.time_code = time_code(*info.frame_rate, info.frame);
    attributes.extra = result.attributes;
    if (!info.fingerprint.empty()) attributes.extra[kFingerprintName] = info.fingerprint;
    attributes.software = "halflight " HALFLIGHT_VERSION;
    attributes.comments = info.comments;
    const std::pair<const char*, const std::string&> extra[] = {{"filter", info.filter},
                                                                {"lens", info.lens},
                                                                {"shutter", info.shutter},
                                                                {"bias", info.bias},
                                                                {"error", info.error}};
    for (const auto& [name, value] : extra)
        if (!value.empty()) attributes.extra[name] = value;
    write_exr_views(path, layers, attributes);
}

void write_png_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    if (result.view.pixels.empty())
        throw Error(path.string(), "not written: the picture was made without its view (want_view)");
    const Image picture = rgb(result.view);
    PngText text;
    if (!info.fingerprint.empty()) text = {kFingerprintName, info.fingerprint};
    write_file(
        path, encode_png(path.string(), picture.width, picture.height, picture.channels, quantize_8bit(picture), text));
}

}  // namespace

bool has_extension(const std::filesystem::path& path, std::string_view extension) {
    const std::string own = path.extension().string();
    return own.starts_with('.') &&
           std::ranges::equal(own.substr(1), extension, {}, [](unsigned char c) { return std::tolower(c); });
}

LinearSpace working_space(const ColorConfig& config, const std::string& name) {
    return config.linear_space(name == "rec709" ? "" : name);
}

void write_picture(const std::filesystem::path& path, const RenderResult& result, const PictureInfo& info) {
    if (has_extension(path, "png"))
        write_png_picture(path, result, info);
    else if (has_extension(path, "exr"))
        write_exr_picture(path, result, info);
    else
        throw Error(path.string(), "a picture is an .exr or a .png");
}

PictureInfo picture_info(const FrameRenderer& renderer, const RenderResult& result, const OutputOptions& options,
                         const std::string& error) {
    const RenderSettings& settings = renderer.settings();
    return {.camera = settings.camera,
            .working_space = working_space(renderer.colors(), options.working_space),
            .half = settings.half_color,
            .comments = settings_line(renderer, result.stats),
            .filter = text(settings.filter),
            .lens = lens_text(settings.camera, result.stats.lens, double(settings.width) / settings.height),
            .shutter = shutter_text(renderer.shutter(), settings),
            .bias = fmt::format("{}", fmt::join(result.stats.biases, "; ")),
            .error = error,
            .reproducible = options.reproducible};
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
