#include "tools/halflight/render_parts.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/core/stopwatch.h"
#include "engine/gpu/program_binaries.h"
#include "renderer/memory.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/progress.h"

namespace halflight {

bool has_exr(const RenderArguments& a) {
    return std::ranges::any_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); });
}

bool wants_view(const RenderArguments& a) {
    return a.movie || std::ranges::any_of(a.outputs, [&](const auto& path) { return holds_view(path, a.output.tiff); });
}

LoadedScene load_scene(const RenderArguments& a, const Console& console) {
    if (!a.left_out.empty())
        console.note("{}: left out because of other options: {}", a.settings_file->string(),
                     fmt::join(a.left_out, ", "));
    std::optional<ProgressDisplay> display;
    Stopwatch watch;
    SceneChoice choice = a.choice;
    if (!has_exr(a)) choice.edits.light_groups.clear(), choice.edits.each_light = false;  // no file takes their layers
    choice.packing = [&](double share) {
        if (const int signal = stop_signal())
            throw Interrupted(signal, a.choice.scene.string(), "not converted: interrupted");
        if (!display) {
            display.emplace(stderr, progress_form(a.log.quiet()), 0);
            watch = Stopwatch();
        }
        display->show(share, watch.seconds());
    };
    const Log log([&](Log::Kind kind, std::string_view line) {
        if (display) display->clear();
        console.pass(kind, line);
    });
    std::error_code unknown;
    if (const auto saved = settings_file_of(a.choice.scene); !a.settings_file && exists(saved, unknown))
        log.note("{} is not used; --settings reads it", saved.string());
    return LoadedScene(std::move(choice), a.view, log);
}

RenderSettings make_settings(const RenderArguments& a, const Camera& chosen) {
    if (a.fstop_needs_focus && !a.settings.view.camera.lens.focus.chosen() && !chosen.lens.blurs())
        throw UsageError("--fstop", "needs --focus, or an output through the view transform such as a .png or a movie");
    const Camera camera = with_optics(chosen, a.settings.optics);
    const ivec2 size = picture_size(a.width, a.height, a.usual_width, camera);
    RenderSettings settings = a.settings;
    settings.width = size.x;
    settings.height = size.y;
    settings.camera = camera;
    settings.pictures = 1;
    settings.want_view = wants_view(a);
    settings.measure = a.stats.has_value() || (a.graph && has_extension(*a.graph, "txt"));
    return settings;
}

std::size_t picture_bytes(const RenderArguments& a) {
    RenderSettings settings = a.settings;
    settings.width = a.width.value_or(a.height ? 1 : a.usual_width);
    settings.height = a.height.value_or(1);
    return least_picture_bytes(settings, {.png = wants_view(a)});
}

gpu::ContextOptions device_options(const RenderArguments& a) {
    return {.device = a.device,
            .binaries_folder = a.no_shader_cache ? "" : gpu::default_binaries_folder(),
            .debug = a.gl_debug};
}

void check_color(const ColorConfig& config, const RenderArguments& a, const Console& console) {
    if (wants_view(a)) {
        const std::optional<DisplayEncoding> encoding = config.view(a.settings.view).encoding();
        for (const auto& path : a.outputs) check_encoding(path, a.output.tiff, encoding);
    }
    try {
        const LinearSpace space = working_space(config, a.output.working_space);
        if (!space.chromaticities)
            console.warn(
                "--working-space: no primaries describe \"{}\", which does not map white to white, so files "
                "have none and other programs may take them for Rec.709",
                space.name);
    } catch (const Error& error) {
        throw Error("--working-space", "expects rec709, acescg or a linear space of the config; {}", error.what());
    }
}

}  // namespace halflight
