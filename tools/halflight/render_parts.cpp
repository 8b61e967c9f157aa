#include "tools/halflight/render_parts.h"

#include <algorithm>

#include "tools/halflight/camera.h"
#include "tools/halflight/frame_renderer.h"
#include "tools/halflight/statistics.h"

namespace halflight {

bool wants(const RenderArguments& a, std::string_view extension) {
    return std::ranges::any_of(a.outputs, [&](const auto& path) { return has_extension(path, extension); });
}

LinearSpace working_space(const ColorConfig& config, const RenderArguments& a) {
    return config.linear_space(a.working_space == "rec709" ? "" : a.working_space);
}

RenderSettings make_settings(const RenderArguments& a, const Camera& camera) {
    const ivec2 size = picture_size(a, camera);
    RenderSettings settings = a.settings;
    settings.width = size.x;
    settings.height = size.y;
    settings.camera = camera;
    settings.pictures = 1;
    settings.want_view = wants(a, "png") || a.movie;
    settings.measure = a.stats.has_value();
    return settings;
}

PictureInfo picture_info(const RenderArguments& a, const RenderSettings& settings, const LinearSpace& space,
                         const Scene& scene, const RenderStats& stats, const std::string& error) {
    return {.camera = settings.camera,
            .working_space = space,
            .half = settings.half_color,
            .comments = settings_line(a, settings, scene, stats),
            .filter = text(settings.filter),
            .shutter = shutter_text(a, settings.samples),
            .bias = fmt::format("{}", fmt::join(stats.biases, "; ")),
            .error = error,
            .reproducible = a.reproducible};
}

std::string judge(const RenderArguments& a, const RenderStats& stats, const std::filesystem::path& output,
                  const Console& console) {
    if (const std::string bad = describe_bad_values(stats); !bad.empty()) {
        if (a.strict) throw Error(output.string(), "not written: {}", bad);
        console.warn("{}; they count as 0", bad);
    }
    if (!stats.error) return "";
    const std::string error = error_line(*stats.error);
    if (!stats.error->reached && !a.best_effort)
        throw Error(output.string(), "not written: after {} samples per pixel, {}; see --best-effort", stats.samples,
                    error);
    console.note("{}", error);
    return error;
}

}  // namespace halflight
