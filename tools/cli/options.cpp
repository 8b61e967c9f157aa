#include "tools/cli/options.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/core/memory_ledger.h"
#include "engine/core/suggestion.h"

namespace halflight {
namespace {

/// Parses X,Y,Z.
std::optional<dvec3> triple(const std::string& text) {
    dvec3 value;
    const char* at = text.data();
    const char* const last = at + text.size();
    for (int i = 0; i < 3; ++i) {
        if (i > 0 && (at == last || *at++ != ',')) return std::nullopt;
        const auto [end, error] = std::from_chars(at, last, value[i]);
        if (error != std::errc() || !std::isfinite(value[i])) return std::nullopt;
        at = end;
    }
    return at == last ? std::optional(value) : std::nullopt;
}

dvec3 point(const std::string& option, const std::string& text) {
    const auto value = triple(text);
    if (!value) throw UsageError(option, "expects X,Y,Z, not '{}'", text);
    return *value;
}

/// Returns what the user of another renderer may have meant by an option, or which option's name was misspelt.
std::string option_meant(const CLI::App& app, const std::string& word) {
    static const std::map<std::string, const char*> kOfOthers = {
        {"--depth", "--bounces"}, {"--environment", "--env"}, {"--eye", "--look-from"},     {"--fov", "--vfov"},
        {"--frame", "--frames"},  {"--hdri", "--env"},        {"--max-depth", "--bounces"}, {"--target", "--look-at"},
        {"-f", "--frames"},       {"-t", "--threads"},        {"-v", "--verbose"},          {"-q", "--quiet"}};
    std::vector<std::string> options;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
    const auto has = [&](const char* name) { return std::ranges::find(options, name) != options.end(); };
    const std::string name = word.substr(0, word.find('='));
    if (const auto of_other = kOfOthers.find(name); of_other != kOfOthers.end() && has(of_other->second))
        return fmt::format("; the option is {}", of_other->second);
    if ((name == "--size" || name == "--resolution") && has("--width")) return "; the options are --width and --height";
    return name.starts_with("--") ? did_you_mean(name, options) : "";
}

}  // namespace

Estimator estimator(const std::string& option, const std::string& list) {
    try {
        return estimator_named(list);
    } catch (const Error& error) {
        throw UsageError(option, error.what());
    }
}

Preview preview(const std::string& option, const std::string& list) {
    try {
        return preview_named(list);
    } catch (const Error& error) {
        throw UsageError(option, error.what());
    }
}

CLI::Option* Options::value(const std::string& names, const char* metavar, const std::string& description,
                            std::function<void(const std::string& name, const std::string& text)> parse) {
    const std::string name = names.substr(0, names.find(','));
    return app_
        .add_option_function<std::string>(
            names, [name, parse](const std::string& text) { parse(name, text); }, description)
        ->type_name(metavar)
        ->group(group_);
}

CLI::Option* Options::repeated(const std::string& names, const char* metavar, const std::string& description,
                               std::function<void(const std::string& name, const std::string& text)> parse) {
    const std::string name = names.substr(0, names.find(','));
    return app_
        .add_option_function<std::vector<std::string>>(
            names,
            [name, parse](const std::vector<std::string>& texts) {
                for (const std::string& text : texts) parse(name, text);
            },
            description)
        ->type_name(metavar)
        ->expected(1)
        ->allow_extra_args(false)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->group(group_);
}

CLI::Option* Options::path(const std::string& name, const char* metavar, const std::string& description,
                           std::optional<std::filesystem::path>& target) {
    return value(name, metavar, description, [&](const auto& n, const auto& text) {
        if (text.empty()) throw UsageError(n, "expects the name of a file");
        target = text;
    });
}

void Options::flag(const std::string& name, bool& target, const std::string& description) {
    app_.add_flag(name, target, description)->group(group_);
}

void Options::flag(const std::string& name, std::function<void()> set, const std::string& description) {
    app_.add_flag_callback(name, std::move(set), description)->group(group_);
}

void Options::alternatives(std::initializer_list<const char*> names) {
    for (auto one = names.begin(); one != names.end(); ++one)
        for (auto other = one + 1; other != names.end(); ++other)
            app_.get_option(*one)->excludes(app_.get_option(*other));
}

void Options::setting(const Setting& s, RenderSettings& settings) {
    const std::string name = fmt::format("--{}", s.name);
    const auto set = [&s, &settings, name](const std::string& text) {
        if (const std::string problem = s.set(settings, text); !problem.empty()) throw UsageError(name, problem);
    };
    std::string description = s.help;
    if (s.type == Setting::Type::flag)
        return flag(
            name, [set] { set("yes"); }, description);
    if (!s.values.empty()) description += ": " + s.values;
    if (const std::string usual = s.get(settings); !usual.empty() && description.find("default") == std::string::npos)
        description += fmt::format(" (default {})", usual);
    const std::string names = *s.aliases ? fmt::format("{},{}", name, s.aliases) : name;
    CLI::Option* const option =
        app_.add_option_function<std::string>(names, set, description)->type_name(s.metavar)->group(group_);
    if (s.type == Setting::Type::list) option->multi_option_policy(CLI::MultiOptionPolicy::Join);
}

std::size_t size_of_text(const std::string& option, const std::string& text) {
    const std::optional<std::size_t> bytes = parse_bytes(text);
    if (!bytes) throw UsageError(option, "expects a size such as 2GiB, 1.5G or 800M, not '{}'", text);
    return *bytes;
}

void add_camera_options(Options& options, ViewArguments& a) {
    options.group("Camera");
    options.value(
        "--camera", "NAME|N",
        "camera of the scene, by name or by number from 0 (default: the first), or a default camera that stands "
        "`inside` "
        "or `outside`. With `all`, `halflight render` makes a "
        "picture of each. The camera's name replaces {camera} in the file's name, or stands before its first dot",
        [&](const auto&, const auto& text) { a.view.camera = text; });
    options.value("--look-from", "X,Y,Z", "position of a free camera, in metres",
                  [&](const auto& name, const auto& text) { a.view.look_from = point(name, text); });
    options.value("--look-at", "X,Y,Z", "point that the free camera looks at",
                  [&](const auto& name, const auto& text) { a.view.look_at = point(name, text); });
    options.value("--up", "X,Y,Z", "upward direction of the free camera (default 0,1,0)",
                  [&](const auto& name, const auto& text) { a.view.up = point(name, text); });
    options.value("--vfov", "DEGREES",
                  fmt::format("vertical field of view in place of that of the camera (default of a free one: {})",
                              a.view.vertical_fov),
                  [&](const auto& name, const auto& text) {
                      a.view.vertical_fov = real(name, text, 0.01, 179);
                      a.view.override_fov = a.view.vertical_fov;
                  });
    options.alternatives({"--camera", "--look-from"});
}

void add_environment_options(Options& options, SceneChoice& choice) {
    options.value(
        "--env", "FILE|COLOUR|NAME",
        "environment: an equirectangular .exr or .hdr, a constant radiance as R,G,B, #rrggbb or white, or a name. By "
        "default a scene gets a neutral sky if its cameras see little by its own light: neutral, studio, sky, "
        "overcast, grey, none",
        [&](const auto& name, const auto& text) { choice.environment = parsed(parse_environment, name, text); });
    options.value(
        "--sky", "ELEVATION,AZIMUTH[,TURBIDITY[,ALBEDO[,ALTITUDE]]]",
        "clear sky with its sun, in nits. ELEVATION: sun above the horizon, degrees from -18 to 90. AZIMUTH: sun "
        "clockwise from north (-Z), degrees. TURBIDITY: haze from 1 to 10 (default 3). ALBEDO: that of the ground, 0 "
        "to 1 (default 0.2). ALTITUDE: metres above the sea, 0 to 10000 (default 0)",
        [&](const auto& name, const auto& text) { choice.environment = parsed(parse_clear_sky, name, text); });
    options.flag(
        "--no-lamps", [&] { choice.lamps = false; },
        "adds no lamps to closed rooms that are dark by the light of the scene and the environment");
    options.value("--env-rotation", "DEGREES", "turns the environment to the right, seen from inside (default 0)",
                  [&](const auto& name, const auto& text) {
                      choice.edits.environment_rotation = real(name, text, kEditRotation.lower, kEditRotation.upper);
                  });
    options.value("--env-intensity", "FACTOR", "factor of the environment's radiance (default 1)",
                  [&](const auto& name, const auto& text) {
                      choice.edits.environment_intensity =
                          static_cast<float>(real(name, text, kEditFactor.lower, kEditFactor.upper));
                  });
    options.alternatives({"--sky", "--env"});
}

void add_variant_option(Options& options, std::string& variant) {
    options.group("Materials");
    options.value("--variant", "NAME", "material variant of the scene; `halflight info SCENE` lists variants",
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "expects the name of a variant");
                      variant = text;
                  });
}

void add_line_width_option(Options& options, double& width) {
    options.group("Geometry");
    options.value(
        "--line-width", "LENGTH", "diameter of points and lines, in units of the scene (default: they are left out)",
        [&](const auto& name, const auto& text) { width = real(name, text, kLineWidth.lower, kLineWidth.upper); });
}

void add_view_options(Options& options, std::optional<std::filesystem::path>& ocio, RenderSettings& settings) {
    options.group("Colour");
    options.path("--ocio", "FILE", "OpenColorIO config (default: $OCIO, else a built-in ACES config)", ocio);
    options.settings(settings);
}

void add_strict_option(Options& options, SceneChoice& choice) {
    options.flag("--strict", choice.strict_scene,
                 "fails for scenes that break the rules of glTF, and for images that cannot be read");
}

void add_memory_option(Options& options) {
    options.value("--memory", "SIZE",
                  "memory that the program may take, such as 2GiB or 800M; by default three quarters of what is free",
                  [](const auto& name, const auto& text) {
                      const std::size_t bytes = size_of_text(name, text);
                      if (bytes <= kProgramBytes)
                          throw UsageError(name, "{} are too little: the program itself takes {}", text_of_bytes(bytes),
                                           text_of_bytes(kProgramBytes));
                      MemoryLedger::process().set_limit(bytes);
                  });
}

void add_page_options(Options& options, ViewArguments& a) {
    options.value("--pages", "FILE",
                  "reads the geometry from a page file that `halflight pack` made of the scene; none: refuses scenes "
                  "that do not fit into memory (default: converts them once, in the user's cache)",
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "expects the name of a file, or none");
                      if (text == "none")
                          a.choice.in_memory = true;
                      else
                          a.choice.pages = text;
                  });
    options.value(
        "--page-pool", "SIZE",
        "memory for pages on the device, such as 512M; by default what the picture leaves of the memory budget",
        [&](const auto& name, const auto& text) { a.settings.pool_bytes = size_of_text(name, text); });
}

void add_device_options(Options& options, ViewArguments& a) {
    options.group("Run");
    options.value("--device", "NAME|N", "device to render on; `halflight info --device` lists devices",
                  [&](const auto&, const auto& text) { a.device = text; });
    options.flag("--gl-debug", a.gl_debug, "lets the driver check every call and explain its errors (slower)");
    options.flag("--allow-outside", a.choice.allow_outside, "allows the scene to name files outside its folder");
    add_memory_option(options);
    add_threads_option(options);
    add_log_options(options, a.log);
}

void add_threads_option(Options& options) {
    options.value(
        "--threads", "N",
        "maximum number of threads for shaders of a software driver, tracing and building (default: all processors; "
        "LP_NUM_THREADS limits the driver alone)",
        [](const auto& name, const auto& text) { limit_threads(whole(name, text, 1, kMostThreads)); });
}

void add_log_options(Options& options, LogChoice& choice) {
    options.value("--log-level", "LEVEL",
                  "messages on stderr; each level includes those before it, and note and detail also show progress: "
                  "error, warning, note, detail (default note)",
                  [&](const auto& name, const auto& text) {
                      const auto level = log_level_named(text);
                      if (!level) throw UsageError(name, "expects error, warning, note or detail, not '{}'", text);
                      choice.level = *level;
                  });
    options.flag(
        "--quiet", [&] { choice.level = LogLevel::error; }, "prints errors only, like --log-level error");
    options.flag(
        "--verbose", [&] { choice.level = LogLevel::detail; }, "prints details, like --log-level detail");
    options.path("--log", "FILE", "appends all messages to a file, with date and time, also those that are not printed",
                 choice.file);
    options.alternatives({"--quiet", "--verbose", "--log-level"});
}

bool given(const CLI::App& app, const std::string& option) {
    const CLI::Option* const known = app.get_option_no_throw(option);
    return known && known->count() > 0;
}

Occasion occasion_of(const RenderArguments& a) {
    const bool one_part = a.part.of > 1, single = a.frames.empty();
    return {.shutter = a.shutter.open > 0,
            .checkpoint = a.checkpoint.has_value(),
            .own_checkpoint = a.checkpoint && single,
            .sequence = !single,
            .part_of_sequence = one_part && !single,
            .light_groups = a.choice.edits.each_light || !a.choice.edits.light_groups.empty(),
            .links = !a.choice.edits.light_links.empty() || !a.choice.edits.shadow_links.empty(),
            .pages = !a.choice.pages.empty(),
            .moved_surfaces = change_surfaces(a.choice.edits),
            .asked = true,
            .finished = true};
}

void check_combinations(const CLI::App& app, const RenderSettings& settings, const Occasion& occasion,
                        const std::filesystem::path& file) {
    const Constraint* const row = broken_constraint(settings, occasion);
    if (!row) return;
    const auto is_given = [&](const char* option) { return given(app, option); };
    const char *const one = row->one.option(is_given), *const other = row->other.option(is_given);
    throw UsageError(one     ? one
                     : other ? other
                             : row->one.options[0],
                     "{}{}", row->text(other ? other : row->other.options[0]),
                     (one && other) || file.empty() ? "" : fmt::format("; {} holds the other one", file.string()));
}

void check_camera_options(const CLI::App& app, const CameraChoice& choice) {
    const auto given = [&](const char* option) { return halflight::given(app, option); };
    if (given("--look-from") != given("--look-at"))
        throw UsageError("--look-from", "needs --look-at, and --look-at needs it");
    if (given("--look-from") && choice.look_from == choice.look_at)
        throw UsageError("--look-from", "expects another point than --look-at");
    if (given("--up") && given("--look-from")) {
        try {
            look_at_camera(*choice.look_from, *choice.look_at, choice.up, 1);
        } catch (const Error&) {
            throw UsageError("--up", "expects a direction that is neither zero nor along the line of sight");
        }
    }
    if (given("--up") && !given("--look-from")) throw UsageError("--up", "needs --look-from and --look-at");
}

void check_optics_options(const CLI::App& app, const ViewArguments& a) {
    const Optics& optics = a.settings.optics;
    const auto given = [&](const char* option) { return halflight::given(app, option); };
    for (const char* option : {"--eye-distance", "--convergence"})
        if (given(option) && optics.stereo == Stereo::none) throw UsageError(option, "needs --stereo");
    if (given("--fisheye-fov") && !optics.is_fisheye())
        throw UsageError("--fisheye-fov", "needs --projection fisheye or fisheye-equisolid");
    if (const std::string side = odd_side(optics, {a.width.value_or(0), a.height.value_or(0)}); !side.empty())
        throw UsageError("--" + side, "must be even with --stereo {}, since it is that of both eyes together",
                         name(optics.stereo));
}

void check_leftovers(const CLI::App& app, const std::string& command) {
    for (const CLI::Option* option : app.get_options())
        if (option->get_positional() && std::ranges::find(option->results(), "") != option->results().end())
            throw UsageError(option->get_name(true), "expects the name of a file");
    const auto extras = app.remaining();
    // The first "--" ends the options. CLI11 has taken the words after it as files.
    const auto word = std::ranges::find_if(extras, [](const std::string& extra) { return extra != "--"; });
    if (word == extras.end()) return;
    throw UsageError(*word, "is not expected{}; see {} --help", option_meant(app, *word), command);
}

/// Converts messages of CLI11, which are "--option: what" or a sentence.
UsageError usage_error(const CLI::ParseError& error, const std::string& command) {
    const std::string text = error.what();
    const auto colon = text.find(": ");
    if (dynamic_cast<const CLI::RequiredError*>(&error))
        return UsageError(text.substr(0, text.find(' ')), "is missing; see {} --help", command);
    const std::string excludes = " excludes ";
    if (const auto at = text.find(excludes); dynamic_cast<const CLI::ExcludesError*>(&error))
        return UsageError(text.substr(0, at), "cannot be given together with {}", text.substr(at + excludes.size()));
    if (colon == std::string::npos) return UsageError("arguments", text);
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error))
        return UsageError(text.substr(0, colon),
                          text.ends_with(" missing") ? "needs a value" : "can be given only once");
    return UsageError(text.substr(0, colon), text.substr(colon + 2));
}

Help help_of(const CLI::App& app) {
    std::string text = app.help();
    text.erase(text.find_last_not_of('\n') + 1);
    return {text};
}

}  // namespace halflight
