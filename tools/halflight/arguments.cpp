#include "tools/halflight/arguments.h"

#include <fmt/ranges.h>
#include <algorithm>

#include "api/halflight/edit_text.h"
#include "engine/core/error.h"
#include "engine/core/suggestion.h"
#include "tools/cli/options.h"
#include "tools/halflight/converge_options.h"
#include "tools/halflight/manual.h"
#include "tools/halflight/render_options.h"

namespace halflight {
namespace {

/// Returns the options of `halflight render` on which memory depends (tools/slurm/submit lists them, too), and --png.
std::vector<std::string> memory_options() {
    std::vector<std::string> names = {"--settings",
                                      "--camera",
                                      "--look-from",
                                      "--look-at",
                                      "--up",
                                      "--vfov",
                                      "--shutter",
                                      "--env",
                                      "--sky",
                                      "--env-rotation",
                                      "--env-intensity",
                                      "--variant",
                                      "--line-width",
                                      "--png",
                                      "--light",
                                      "--material",
                                      "--node",
                                      "--hide",
                                      "--shadow-catcher",
                                      "--ground",
                                      "--ground-height",
                                      "--light-group",
                                      "--light-link",
                                      "--shadow-link"};
    for (const Setting& s : known_settings())
        if (s.memory) names.push_back(fmt::format("--{}", s.name));
    return names;
}

void add_memory_options(Options& options, InfoArguments& a) {
    add_settings_option(options, a.picture);
    add_camera_options(options, a.picture);
    options.settings(a.picture.settings, &Setting::memory);
    options.group("Picture");
    options.settings(a.picture.settings, &Setting::memory);
    options.flag("--png", a.png, "includes a .png output in the memory estimate");
    options.group("Sequence");
    add_shutter_option(options, a.picture);
    add_light_options(options, a.picture);
    options.group("Run");
    options.settings(a.picture.settings, &Setting::memory);
    add_memory_option(options);
    add_strict_option(options, a.picture.choice);
}

void check(const InfoArguments& a, const CLI::App& app) {
    if (a.needs && !a.scene) throw UsageError("--needs", "needs a SCENE");
    if (a.names && !a.scene) throw UsageError("--names", "needs a SCENE");
    if (a.check && !a.scene) throw UsageError("--check", "needs a page file");
    for (const std::string& option : memory_options())
        if (app.count(option) > 0 && !a.scene) throw UsageError(option, "needs a SCENE");
    check_camera_options(app, a.picture.view);
    if (a.time && !a.needs) throw UsageError("--time", "needs --needs");
    if (!a.scene && !a.device) throw UsageError("SCENE", "is missing; see halflight info --help");
}

std::vector<std::string> commands_of(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    return names;
}

/// Throws UsageError for an unknown command, and for an unknown option before the command.
void check_command(const CLI::App& app) {
    const auto extras = app.remaining();
    const std::vector<std::string> commands = commands_of(app);
    if (!extras.empty() && !extras.front().starts_with('-'))
        throw UsageError(extras.front(), "is no command; commands are: {}{}", fmt::join(commands, ", "),
                         did_you_mean(extras.front(), commands));
    check_leftovers(app, "halflight");
}

}  // namespace

Arguments parse_arguments(int argc, const char* const* argv) {
    CLI::App app("Hybrid raster and ray-traced global illumination.", "halflight");
    app.set_help_flag("-h,--help", "prints this help and exits");
    app.set_version_flag("--version", "halflight", "prints the versions of program, driver and libraries, and exits");
    app.allow_extras();
    app.require_subcommand(0, 1);  // later words may be files with the name of a command

    RenderArguments render;
    CLI::App& render_app = *app.add_subcommand("render", "Renders a glTF scene to .exr, .png, .jpg and .tif");
    add_render_options(render_app, render);

    RenderArguments merge;
    merge.merge = true;
    CLI::App& merge_app = *app.add_subcommand("merge", "Joins the parts of a picture that `render --part` has made");
    add_render_options(merge_app, merge);

    DenoiseArguments denoise;
    CLI::App& denoise_app =
        *app.add_subcommand("denoise", "Makes denoised pictures of noisy frames that `render --keep-noisy` has kept");
    denoise_app.allow_extras();
    add_denoise_options(denoise_app, denoise);

    PreviewArguments preview;
    CLI::App& preview_app = *app.add_subcommand("view", "Shows a scene in an interactive window");
    preview_app.allow_extras();
    add_preview_options(preview_app, preview);

    ThumbnailArguments thumbnail;
    CLI::App& thumbnail_app =
        *app.add_subcommand("thumbnail", "Makes a small denoised picture of a scene within limits of time and memory");
    thumbnail_app.allow_extras();
    add_thumbnail_options(thumbnail_app, thumbnail);

    ConvergeArguments converge;
    CLI::App& converge_app = *app.add_subcommand("converge", "Measures error against run time and writes a report");
    converge_app.allow_extras();
    add_converge_options(converge_app, converge);

    InfoArguments info;
    bool settings_page = false;
    CLI::App& info_app = *app.add_subcommand("info", "Lists the contents of a scene, or the devices");
    info_app.allow_extras();
    info_app
        .add_option("SCENE", info.scene,
                    "glTF 2.0 scene, .gltf or .glb, a list of such files, NAME.parts.json, or a page file")
        ->type_name("");
    info_app.add_flag("--device", info.device,
                      "lists the devices, and why each was or was not chosen; fails if none works");
    info_app.add_flag("--needs", info.needs,
                      "lists the parts that rendering leaves out for the scene, the reasons and the bytes saved");
    info_app.add_flag(
        "--names", info.names,
        "lists cameras, variants, lights, materials, meshes and nodes as options of `halflight render`, with "
        "the values that they have");
    info_app.add_flag("--check", info.check, "reads a page file as a whole and tests the checksums of all its parts");
    info_app.add_flag("--time", info.time,
                      "with --needs, measures the time that leaving out each part saves; takes minutes");
    info_app.add_flag("--list-settings", settings_page,
                      "prints the tables of all render settings and layers in Markdown");
    std::optional<std::filesystem::path> manual;
    info_app
        .add_option("--write-manual", manual,
                    "writes man pages, and completions for bash, zsh and fish, below a folder such as ~/.local/share")
        ->type_name("DIR");
    info_app.add_flag("--json", info.json, "prints JSON");
    info_app.add_flag("--allow-outside", info.picture.choice.allow_outside,
                      "allows the scene to name files outside its folder");
    info_app.footer(
        "The options for picture, camera, sequence, light and run are those of `halflight render`. They describe the "
        "picture whose memory is estimated.");
    Options info_options(info_app);
    add_memory_options(info_options, info);

    PackArguments pack;
    CLI::App& pack_app = *app.add_subcommand("pack", "Converts a scene that is larger than memory to a page file");
    pack_app.allow_extras();
    pack_app.add_option("SCENE", pack.scene, "glTF 2.0 scene, .gltf or .glb, or a list of such files, NAME.parts.json")
        ->type_name("")
        ->required();
    pack_app.add_option("OUTPUT", pack.output, "page file")->type_name("")->required();
    Options pack_options(pack_app);
    pack_options.group("Run");
    pack_options.flag("--allow-outside", pack.choice.allow_outside,
                      "allows the scene to name files outside its folder");
    pack_options.value("--glass-shadows", "bent|straight",
                       "makes pages for --glass-shadows straight of `halflight render`",
                       [&pack](const std::string& option, const std::string& text) {
                           pack.choice.edits.straight_glass = parsed(glass_shadows_of, option, text);
                       });
    add_memory_option(pack_options);
    add_threads_option(pack_options);
    add_strict_option(pack_options, pack.choice);
    add_log_options(pack_options, pack.log);

    BenchArguments bench;
    CLI::App& bench_app = *app.add_subcommand("bench", "Measures rays per second of several tracers, interleaved");
    bench_app.allow_extras();
    bench::add_options(bench_app, bench);

    CompareArguments compare;
    CLI::App& compare_app = *app.add_subcommand("compare", "Measures the difference of two pictures, layer by layer");
    compare_app.allow_extras();
    compare::add_options(compare_app, compare);

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return help_of(app);
    } catch (const CLI::CallForVersion&) {
        return Version{};
    } catch (const CLI::ParseError& error) {
        throw usage_error(error, render_app.parsed()      ? "halflight render"
                                 : merge_app.parsed()     ? "halflight merge"
                                 : thumbnail_app.parsed() ? "halflight thumbnail"
                                 : preview_app.parsed()   ? "halflight view"
                                 : converge_app.parsed()  ? "halflight converge"
                                 : pack_app.parsed()      ? "halflight pack"
                                 : bench_app.parsed()     ? "halflight bench"
                                 : compare_app.parsed()   ? "halflight compare"
                                                          : "halflight info");
    }
    check_command(app);
    if (render_app.parsed()) {
        finish_render_options(render_app, render);
        return render;
    }
    if (merge_app.parsed()) {
        finish_render_options(merge_app, merge);
        return merge;
    }
    if (denoise_app.parsed()) {
        finish_denoise_options(denoise_app, denoise);
        return denoise;
    }
    if (thumbnail_app.parsed()) {
        finish_thumbnail_options(thumbnail_app, thumbnail);
        return thumbnail;
    }
    if (preview_app.parsed()) {
        finish_preview_options(preview_app, preview);
        return preview;
    }
    if (converge_app.parsed()) {
        check_leftovers(converge_app, "halflight converge");
        if (converge.log.file) check_files({converge.choice.scene}, {*converge.log.file});
        take_size_options(converge_app, converge);
        check_converge_options(converge_app, converge);
        return converge;
    }
    if (info_app.parsed()) {
        check_leftovers(info_app, "halflight info");
        if (settings_page) {
            std::string page = settings_markdown();
            page.pop_back();  // Help ends without a newline
            return Help{page};
        }
        if (manual) {
            Manual written;
            for (auto& [path, text] : manual_files(app)) written.files[*manual / path] = std::move(text);
            return written;
        }
        check(info, info_app);
        take_size_options(info_app, info.picture);
        if (info.picture.settings_file) use_settings(info_app, info.picture);
        check_optics_options(info_app, info.picture);
        check_combinations(info_app, info.picture.settings, occasion_of(info.picture),
                           info.picture.settings_file.value_or(""));
        info.picture.choice.mip_levels = info.picture.settings.texture_lod;
        return info;
    }
    if (pack_app.parsed()) {
        check_leftovers(pack_app, "halflight pack");
        Paths written = {pack.output};
        if (pack.log.file) written.push_back(*pack.log.file);
        check_files({pack.scene}, written);
        return pack;
    }
    if (bench_app.parsed()) {
        check_leftovers(bench_app, "halflight bench");
        return bench;
    }
    if (compare_app.parsed()) {
        check_leftovers(compare_app, "halflight compare");
        if (compare.map) check_files({compare.image, compare.reference}, {*compare.map});
        return compare;
    }
    throw UsageError("command", "is missing; commands are: {}", fmt::join(commands_of(app), ", "));
}

}  // namespace halflight
