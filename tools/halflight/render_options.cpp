// Options of `halflight render` and `halflight merge`.
#include "tools/halflight/render_options.h"

#include <fmt/ranges.h>
#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/settings/layers.h"
#include "renderer/render.h"
#include "renderer/settings_check.h"
#include "tools/cli/installation.h"
#include "tools/halflight/render_parts.h"

namespace halflight {
namespace {

/// Returns the absolute path of a file, which need not exist.
std::filesystem::path place(const std::filesystem::path& name) {
    std::error_code error;  // ignored: opening the file reports the error
    const auto absolute = std::filesystem::absolute(name, error);
    const auto canonical = std::filesystem::weakly_canonical(absolute, error);
    return error ? absolute : canonical;
}

void add_picture_options(Options& options, RenderArguments& a) {
    options.group("Picture");
    options.settings(a.settings);
    options.value("--error-metric", "NAME", "metric of --error: relmse, mse (default relmse)",
                  [&](const auto& name, const auto& text) {
                      if (!a.settings.error) throw UsageError(name, "needs --error");
                      const std::string target = fmt::format("{} {}", a.settings.error->error, text);
                      const std::string problem = setting("error").set(a.settings, target);
                      if (!problem.empty()) throw UsageError(name, problem);
                  });
    options.flag("--best-effort", a.output.best_effort, "writes the picture even if its error target was not reached");
    options.value(
        "--checkpoint", "SECONDS",
        "saves the samples in the folder OUTPUT.checkpoint every SECONDS, and when a signal ends the program; "
        "the same command then goes on from there, to the same bits",
        [&](const auto& name, const auto& text) { a.checkpoint = real(name, text, 0.001, 1e9); });
}

void add_color_options(Options& options, RenderArguments& a) {
    add_view_options(options, a.ocio, a.settings);
    options.value("--working-space", "NAME",
                  "linear colour space of the .exr: rec709, acescg or a space of the config (default rec709)",
                  [&](const auto&, const auto& text) { a.output.working_space = text; });
}

void add_file_options(Options& options, RenderArguments& a) {
    options.group("Files");
    std::vector<std::string> names;
    for (const ExrCompression compression : kExrCompressions) names.emplace_back(name(compression));
    options.value("--exr-compression", "NAME",
                  fmt::format("compression of the .exr. pxr24, dwaa and dwab change values; layers of data then need "
                              "--exr-parts, and stay exact: {} (default zip)",
                              fmt::join(names, ", ")),
                  [&](const auto& option, const auto& text) {
                      try {
                          a.output.exr.compression = exr_compression_named(text);
                      } catch (const Error& error) {
                          throw UsageError(option, "{}", error.reason());
                      }
                  });
    options.value("--aov-names", "NAME",
                  "names of layers in the .exr, by the table in docs/colour-and-layers.md: halflight, blender, arnold "
                  "(default halflight)",
                  [&](const auto& option, const auto& text) {
                      const auto names_of = aov_names_named(text);
                      if (!names_of) throw UsageError(option, "expects halflight, blender or arnold, not '{}'", text);
                      a.output.aov_names = *names_of;
                  });
    options.flag("--exr-parts", a.output.exr.parts, "makes each layer of the .exr a part of its own");
    options.value("--exr-tiles", "PIXELS", "stores the .exr in square tiles of this side, 16 to 4096, instead of lines",
                  [&](const auto& option, const auto& text) { a.output.exr.tile = whole(option, text, 16, 4096); });
}

void add_display_file_options(Options& options, RenderArguments& a) {
    options.value(
        "--png-bits", "N",
        "bits of a channel of a .png and of what a movie is made of: 8 or 16 (default 8; 16 if the display is HDR)",
        [&](const auto& name, const auto& text) {
            if (text != "8" && text != "16") throw UsageError(name, "expects 8 or 16, not '{}'", text);
            a.output.png_bits = text == "8" ? 8 : 16;
        });
    options.value("--jpeg-quality", "N", fmt::format("quality of a .jpg, 1 to 100 (default {})", a.output.jpeg_quality),
                  [&](const auto& name, const auto& text) { a.output.jpeg_quality = whole(name, text, 1, 100); });
    options.value(
        "--tiff-type", "8|16|float",
        "values of a .tif: 8 or 16 bits through the view transform, or scene-linear floats (default 16)",
        [&](const auto& name, const auto& text) {
            if (text != "8" && text != "16" && text != "float")
                throw UsageError(name, "expects 8, 16 or float, not '{}'", text);
            a.output.tiff = text == "8" ? TiffType::uint8 : text == "16" ? TiffType::uint16 : TiffType::float32;
        });
}

/// Throws UsageError if the compression of an .exr would damage data.
void check_compression(const RenderArguments& a) {
    if (!is_lossy(a.output.exr.compression) || a.output.exr.parts) return;
    for (const std::string& layer : a.settings.aovs)
        if (!find_aov(layer)->is_color())
            throw UsageError("--exr-compression", "{} would change the data of layer {}; --exr-parts keeps them exact",
                             name(a.output.exr.compression), layer);
}

void add_run_options(Options& options, RenderArguments& a) {
    add_device_options(options, a);
    options.settings(a.settings);
    options.flag(
        "--keep-all", [&] { a.settings.kept = Kept::everything(); }, "builds all parts that --keep can name");
    options.flag(
        "--strict", [&] { a.output.strict = a.choice.strict_scene = true; },
        "fails if any pass yields a NaN, an infinity or a negative radiance, for scenes that break the rules of glTF, "
        "and for images that cannot be read");
    add_page_options(options, a);
    options.value(
        "--page-schedule", "NAME",
        fmt::format(
            "method that finds the pages that rays need (docs/page-files.md): demand, set, queries (default {})",
            name(paging::kDefaultPageSchedule)),
        [&](const auto& option, const auto& text) {
            const auto found =
                std::ranges::find(paging::kPageSchedules, text, [](auto s) { return std::string(name(s)); });
            if (found == std::end(paging::kPageSchedules))
                throw UsageError(option, "expects demand, set or queries, not '{}'", text);
            a.settings.page_schedule = *found;
        });
    options.value("--texture-pool", "SIZE",
                  "loads textures in tiles, and sets the memory for tiles on the device, such as 512M. By default, "
                  "textures that do not fit into the memory budget get half of what it has left",
                  [&](const auto& name, const auto& text) {
                      a.settings.tile_bytes = size_of_text(name, text);
                      a.choice.tile_textures = true;
                  });
    options.value(
        "--progress", "text|json",
        "form of progress on stderr: text is a bar or lines, json is lines of JSON, also with --quiet (default text)",
        [&](const auto& name, const auto& text) {
            if (text != "text" && text != "json") throw UsageError(name, "expects text or json, not '{}'", text);
            a.json_progress = text == "json";
        });
    options.flag("--watch", a.watch,
                 "renders again whenever a file of the picture changes: scene, buffer, image, environment, settings or "
                 "colour config. Ctrl+C ends the program");
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither reads nor writes compiled shaders in $XDG_CACHE_HOME/halflight/programs");
    options.path("--stats", "FILE.json",
                 "writes statistics, including the time of each pass; measuring makes rendering slower. For a "
                 "sequence, appends one line per frame",
                 a.stats);
    options.path(
        "--dump-graph", "FILE.dot|.txt",
        "writes the render graph of the frame: .dot for Graphviz, .txt a table with a row for each group of passes",
        a.graph);
}

/// Sets the scene of --demo, for which the first name is an output.
void take_demo_scene(const CLI::App& app, RenderArguments& a) {
    if (!a.demo) {
        if (a.choice.scene.empty()) throw UsageError("SCENE", "is missing; see halflight {} --help", app.get_name());
        return;
    }
    if (!a.choice.scene.empty()) a.outputs.insert(a.outputs.begin(), a.choice.scene);
    const auto scene = std::ranges::find_if(
        a.outputs, [](const auto& path) { return has_extension(path, "glb") || has_extension(path, "gltf"); });
    if (scene != a.outputs.end()) throw UsageError(scene->string(), "cannot be given together with --demo");
    a.choice.scene = demo_scene();
}

/// Accepts outputs before the scene: if the first name is an output and one of the others is none, they change places.
void take_scene_among_outputs(RenderArguments& a) {
    if (!is_picture_name(a.choice.scene)) return;
    const auto scene = std::ranges::find_if_not(a.outputs, is_picture_name);
    if (scene == a.outputs.end()) return;
    const std::filesystem::path found = *scene;
    a.outputs.erase(scene);
    a.outputs.insert(a.outputs.begin(), std::exchange(a.choice.scene, found));
}

/// Takes --part of a single picture, and checks the parts of its samples.
void take_sample_parts(const CLI::App& app, RenderArguments& a) {
    const bool part = given(app, "--part");
    if (part && a.frames.empty()) {
        const int of = static_cast<int>(a.part.of);
        if (app.count("--sample-parts") > 0 && a.settings.parts != of)
            throw UsageError("--part", "names {} parts, but --sample-parts {}", of, a.settings.parts);
        a.settings.parts = of;
    }
    if (a.settings.parts == 1) return;
    const char* const option = part ? "--part" : "--sample-parts";
    if (a.settings.parts > a.settings.samples)
        throw UsageError(option, "{} parts are more than {} samples", a.settings.parts, a.settings.samples);
    if (!part || !a.frames.empty()) return;
    for (const char* other : {"--stats", "--dump-graph"})
        if (given(app, other)) throw UsageError(option, "makes no picture that {} could describe", other);
}

void check(const RenderArguments& a, const CLI::App& app) {
    const auto given = [&](const char* option) { return app.count(option) > 0; };
    if (a.outputs.empty() && !a.movie)
        throw UsageError("OUTPUT", "is missing; see halflight {} --help", app.get_name());
    for (const auto& path : a.outputs) {
        if (!is_picture_name(path)) throw UsageError(path.string(), "an output is an {}", picture_extensions());
        try {
            check_alpha(path, a.settings.transparent);
        } catch (const Error& error) {
            throw UsageError(path.string(), "{}", error.reason());
        }
    }
    check_sequence_options(app, a);
    check_combinations(app, a.settings, occasion_of(a), a.settings_file.value_or(""));
    if (a.settings.keep_noisy && a.outputs.empty())
        throw UsageError("--keep-noisy", "needs files of frames, beside which noisy frames lie");
    if (a.checkpoint && a.outputs.empty())
        throw UsageError("--checkpoint", "needs files of frames: a movie without them begins anew after a stop");
    if (a.merge) {
        if (a.settings.parts < 2)
            throw UsageError("--sample-parts", "{}",
                             given("--sample-parts") ? "one part needs no merge; --part 1/1 renders the whole picture"
                                                     : "is missing; it is the N of --part I/N");
        for (const char* option :
             {"--frames", "--turntable", "--part", "--check", "--checkpoint", "--overwrite", "--watch", "--develop"})
            if (given(option)) throw UsageError(option, "has no meaning for halflight merge");
    }
    check_render_files(a);  // includes the files that settings name
    if (a.output.best_effort && !a.settings.error) throw UsageError("--best-effort", "needs --error");
    if (const std::string problem = kept_problem(a.settings.kept); !problem.empty())
        throw UsageError("--keep", problem);
    check_camera_options(app, a.view);
    check_optics_options(app, a);
    check_compression(a);
    for (const char* option : {"--aov", "--light-group", "--half"})
        if (given(option) && !has_exr(a)) throw UsageError(option, "needs an .exr output");
    check_output_options(app, a);
}

}  // namespace

void check_output_options(const CLI::App& app, const RenderArguments& a) {
    const auto given = [&](const char* option) { return app.count(option) > 0; };
    const bool exr = has_exr(a) || a.outputs.empty();
    for (const char* option : {"--aov-names", "--exr-compression", "--exr-parts", "--exr-tiles"})
        if (given(option) && !exr) throw UsageError(option, "needs an .exr output");
    const auto has = [&](const char* extension) {
        return std::ranges::any_of(a.outputs, [&](const auto& path) { return has_extension(path, extension); });
    };
    if (given("--png-bits") && !has("png") && !given("--movie"))
        throw UsageError("--png-bits", "needs a .png output or --movie");
    if (given("--jpeg-quality") && !has("jpg") && !has("jpeg"))
        throw UsageError("--jpeg-quality", "needs a .jpg output");
    if (given("--tiff-type") && !has("tif") && !has("tiff")) throw UsageError("--tiff-type", "needs a .tif output");
    if (given("--working-space") &&
        std::ranges::all_of(a.outputs, [&](const auto& path) { return holds_view(path, a.output.tiff); }))
        throw UsageError("--working-space", "needs a scene-linear output: an .exr, or a .tif of floats");
    for (const char* option : {"--display", "--view", "--look", "--exposure", "--iso", "--shutter-speed"})
        if (given(option) && !wants_view(a))
            throw UsageError(option, "needs an output through the view transform, such as a .png, or a movie");
}

void add_output_options(Options& options, RenderArguments& a) {
    add_color_options(options, a);
    add_file_options(options, a);
    add_display_file_options(options, a);
}

void add_run_basics(Options& options, RenderArguments& a) {
    options.group("Run");
    options.value("--device", "NAME|N", "device to denoise on; `halflight info --device` lists devices",
                  [&](const auto&, const auto& text) { a.device = text; });
    options.flag("--gl-debug", a.gl_debug, "lets the driver check every call and explain its errors (slower)");
    options.flag("--no-shader-cache", a.no_shader_cache,
                 "neither reads nor writes compiled shaders in $XDG_CACHE_HOME/halflight/programs");
    add_memory_option(options);
    add_threads_option(options);
    add_log_options(options, a.log);
}

void check_files(const Paths& read, const Paths& written) {
    std::set<std::filesystem::path> inputs, outputs;
    for (const auto& path : read) inputs.insert(place(path));
    for (const auto& path : written) {
        const auto at = place(path);
        if (!outputs.insert(at).second) throw UsageError(path.string(), "is given twice as output");
        if (inputs.contains(at)) throw UsageError(path.string(), "is both input and output");
    }
}

void check_render_files(const RenderArguments& a, std::span<const VersionedFile> scene_files) {
    Paths read = {a.choice.scene}, written = output_files(a);
    for (const VersionedFile& file : scene_files) read.push_back(file.path);
    if (const auto* map = std::get_if<std::filesystem::path>(&a.choice.environment)) read.push_back(*map);
    if (a.ocio) read.push_back(*a.ocio);
    if (a.settings_file) read.push_back(*a.settings_file);
    if (a.movie) written.push_back(*a.movie);
    if (a.stats) written.push_back(*a.stats);
    if (a.graph) written.push_back(*a.graph);
    if (a.log.file) written.push_back(*a.log.file);
    check_files(read, written);
}

void add_light_options(Options& options, ViewArguments& a) {
    options.group("Light");
    options.settings(a.settings);
    add_environment_options(options, a.choice);
    add_variant_option(options, a.choice.variant);
    add_line_width_option(options, a.choice.line_width);
    add_edit_options(options, a);
}

void add_render_options(CLI::App& app, RenderArguments& a) {
    app.allow_extras();
    app.add_option("SCENE", a.choice.scene, "glTF 2.0 scene, .gltf or .glb; --demo replaces it")->type_name("");
    app.add_option("OUTPUT", a.outputs, ".exr: scene-linear, with layers; .png, .jpg, .tif: through the view transform")
        ->type_name("");
    Options options(app);
    options.group("Files");
    options.flag("--demo", a.demo, "renders a scene that is installed with the program");
    options.repeated("--output,-o", "FILE", "adds an output, like a name after the scene",
                     [&](const auto& name, const auto& text) {
                         if (text.empty()) throw UsageError(name, "expects the name of a file");
                         a.outputs.emplace_back(text);
                     });
    add_settings_option(options, a);
    add_camera_options(options, a);
    options.settings(a.settings);
    add_picture_options(options, a);
    add_sequence_options(options, a);
    add_light_options(options, a);
    add_color_options(options, a);
    add_file_options(options, a);
    add_display_file_options(options, a);
    add_run_options(options, a);
    // A run of all frames makes the movie from the .png files of the parts. Movies have no alpha.
    for (const char* other : {"--part", "--check", "--transparent"}) options.alternatives({"--movie", other});
    for (const char* other : {"--frames", "--turntable"}) options.alternatives({other, "--frame"});
    options.alternatives({"--frames", "--dump-graph"});
    for (const char* other : {"--overwrite", "--watch", "--develop"}) options.alternatives({"--check", other});
}

void finish_render_options(const CLI::App& app, RenderArguments& a) {
    check_leftovers(app, "halflight " + app.get_name());
    take_demo_scene(app, a);
    take_scene_among_outputs(a);
    if (a.view.turntable > 0 && a.frames.empty()) {
        a.frames.resize(static_cast<std::size_t>(a.view.turntable));
        std::iota(a.frames.begin(), a.frames.end(), a.choice.frame_offset);
    }
    check_render_files(a);  // precedes reading: the settings file may be one of the files
    take_size_options(app, a);
    if (a.settings_file) use_settings(app, a);
    // Pipelines that write .exr files mean the camera of the file, whatever it shows at first.
    a.view.warn_of_blind = !a.view.camera && !a.choice.animation && a.frames.empty() && !a.settings.optics.traced() &&
                           a.settings.backfaces != Backfaces::show;
    a.view.replace_blind = a.view.warn_of_blind &&
                           std::ranges::none_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); });
    if ((a.settings.time_limit > 0 || a.settings.error) && app.count("--samples") == 0)
        a.settings.samples = kMaxSamples;
    take_sample_parts(app, a);
    check(a, app);
    a.fstop_needs_focus = app.count("--fstop") > 0 && !wants_view(a);
    a.choice.picture_bytes = picture_bytes(a);
    a.choice.mip_levels = a.settings.texture_lod;
    if (!a.frames.empty() && !a.choice.animation) a.choice.animation = "all";
}

}  // namespace halflight
