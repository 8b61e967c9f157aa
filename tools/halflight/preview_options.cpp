#include "tools/halflight/options.h"

namespace halflight {
namespace {

/// WxH
void size(PreviewArguments& a, const std::string& option, const std::string& text) {
    const std::size_t x = text.find('x');
    if (x == std::string::npos) throw UsageError(option, "wants WIDTHxHEIGHT in pixels, not '{}'", text);
    a.width = whole(option, text.substr(0, x), kMinWindow, kMaxWindow);
    a.height = whole(option, text.substr(x + 1), kMinWindow, kMaxWindow);
}

}  // namespace

void check_preview_options(const CLI::App& app, const RenderArguments& a) {
    if (!a.preview.any()) return;
    exclude(app, "--preview", "--error");    // which is that of the mean
    exclude(app, "--preview", "--shutter");  // whose times are no pictures of their own
    if (!a.preview.temporal) return;
    if (a.frames.empty()) throw UsageError("--preview", "temporal keeps light of earlier frames and needs --frames");
    exclude(app, "--preview", "--part");
}

void check_preview_options(const CLI::App& app, const PreviewArguments& a) {
    if (app.count("--frame") > 0 && !a.animation) throw UsageError("--frame", "needs --animation");
}

void add_preview_options(CLI::App& app, PreviewArguments& a) {
    app.add_option("SCENE", a.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("")->required();
    a.width = 1280, a.height = 720;
    Options options(app);
    add_camera_options(options, a);
    options.group("Picture");
    options.value("--size", "WxH", fmt::format("of the window, pixels (default {}x{})", *a.width, *a.height),
                  [&](const auto& name, const auto& text) { size(a, name, text); });
    options.value("--samples", "N", "samples per pixel after which the picture is left as it is (default 1024)",
                  [&](const auto& name, const auto& text) { a.samples = whole(name, text, 1, kMaxSamples); });
    options.value(
        "--preview", "NAME,...",
        "modes that are on at the start, biases that are named in the window: none (default), " + known_previews(),
        [&](const auto& name, const auto& text) { a.preview = preview(name, text); });
    add_clamp_option(options, a.clamp);
    options.value(
        "--budget", "MS",
        fmt::format("milliseconds within which a view that has changed is to be shown, coarser where it takes that "
                    "(default {:g})",
                    a.budget),
        [&](const auto& name, const auto& text) { a.budget = real(name, text, 1, 1e6); });
    options.path("--settings", "FILE.json",
                 "what is read at the start if it is there, and what is saved (default: SCENE.halflight.json)",
                 a.settings);
    options.group("Animation");
    add_animation_options(options, a.animation, a.frame_rate, "none, the scene at rest");
    options.value("--frame", "N", "frame that is seen first (default 0)",
                  [&](const auto& name, const auto& text) { a.frame = whole(name, text, 0u, ~0u); });
    add_light_options(options, a);
    options.group("Colour");
    add_view_options(options, a.ocio, a.view, "");
    add_device_options(options, a);
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither look for compiled shaders in $XDG_CACHE_HOME/halflight/programs nor keep them there");
    options.path("--script", "FILE", "do what the file says, a command a line, and end; see tools/view/script.h",
                 a.script);
}

}  // namespace halflight
