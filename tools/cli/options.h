// Declarations of command-line options, and options that several commands have.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "engine/settings/constraints.h"
#include "engine/settings/settings_table.h"
#include "tools/cli/picture_arguments.h"
#include "tools/cli/threads.h"

namespace halflight {

inline constexpr int kMinWindow = 16, kMaxWindow = 16384;  ///< sides of the viewer's pictures, pixels

/// Parses WxH, two sides from kMinWindow to kMaxWindow. Throws UsageError.
ivec2 parse_size(const std::string& subject, const std::string& text);

/// Parses all of `text` as a number from `lower` to `upper`; `kind` names it in the UsageError.
template <class T>
T number(const std::string& option, const std::string& text, T lower, T upper, std::string_view kind) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= lower && value <= upper))
        throw UsageError(option, "expects {} from {} to {}, not '{}'", kind, lower, upper, text);
    return value;
}

template <class T>
T whole(const std::string& option, const std::string& text, T lower, T upper) {
    return number<T>(option, text, lower, upper, "a whole number");
}

inline double real(const std::string& option, const std::string& text, double lower, double upper) {
    return number<double>(option, text, lower, upper, "a number");
}

/// Calls f(option, text) and turns its Error, whose subject begins with the option, into a UsageError. The rest of the
/// subject names an element of the text ("--material: floor") and stays in the message.
template <class F>
auto parsed(F f, const std::string& option, const std::string& text) {
    try {
        return f(option, text);
    } catch (const Error& error) {
        const std::string begin = option + ": ";
        std::string_view what = error.what();
        if (what.starts_with(begin)) what.remove_prefix(begin.size());
        throw UsageError(option, "{}", what);
    }
}

/// Parses the value of an option. Throws UsageError if it is malformed.
Estimator estimator(const std::string& option, const std::string& list);
Preview preview(const std::string& option, const std::string& list);

/// Declares the options of a command.
class Options {
  public:
    explicit Options(CLI::App& app) : app_(app) {}

    void group(std::string name) { group_ = std::move(name); }
    /// Declares an option with a value. `names`: "--name", or several names with commas between them. `parse` gets the
    /// first one.
    CLI::Option* value(const std::string& names, const char* metavar, const std::string& description,
                       std::function<void(const std::string& name, const std::string& text)> parse);
    /// Declares an option that may be given several times; `parse` is called for each.
    CLI::Option* repeated(const std::string& names, const char* metavar, const std::string& description,
                          std::function<void(const std::string& name, const std::string& text)> parse);
    CLI::Option* path(const std::string& name, const char* metavar, const std::string& description,
                      std::optional<std::filesystem::path>& target);
    void flag(const std::string& name, bool& target, const std::string& description);
    void flag(const std::string& name, std::function<void()> set, const std::string& description);
    /// Declares that at most one of these options may be given.
    void alternatives(std::initializer_list<const char*> names);
    /// Declares the option of a setting. `settings` holds its default, and its value after parsing.
    void setting(const Setting& setting, RenderSettings& settings);
    /// Declares the options of all settings of the current group for which wanted(setting) is true.
    template <class Wanted>
    void settings(RenderSettings& values, const Wanted& wanted) {
        for (const Setting& s : known_settings())
            if (s.group == group_ && std::invoke(wanted, s)) setting(s, values);
    }
    void settings(RenderSettings& values) {
        settings(values, [](const Setting&) { return true; });
    }

  private:
    CLI::App& app_;
    std::string group_;
};

/// Parses a size in bytes, such as 2GiB. Throws UsageError if it is malformed.
std::size_t size_of_text(const std::string& option, const std::string& text);

void add_camera_options(Options& options, ViewArguments& arguments);
/// Declares --env, --sky, --env-rotation and --env-intensity.
void add_environment_options(Options& options, SceneChoice& choice);
/// Declares --light, --material, --node, --hide, --shadow-catcher, --light-group, --light-link and
/// --shadow-link.
void add_edit_options(Options& options, ViewArguments& arguments);
/// Declares --variant.
void add_variant_option(Options& options, std::string& variant);
/// Declares --line-width.
void add_line_width_option(Options& options, double& width);
/// Declares --ocio and the settings of the view transform.
void add_view_options(Options& options, std::optional<std::filesystem::path>& ocio, RenderSettings& settings);
/// Declares --device, --gl-debug, --allow-outside, --memory, --threads and the options of messages.
void add_device_options(Options& options, ViewArguments& arguments);
/// Declares --threads, which limits the threads of the process when it is parsed.
void add_threads_option(Options& options);
/// Declares --log-level, --quiet, --verbose and --log.
void add_log_options(Options& options, LogChoice& choice);
/// Declares --pages and --page-pool.
void add_page_options(Options& options, ViewArguments& arguments);
/// Declares --strict, for commands that write no picture of a scene.
void add_strict_option(Options& options, SceneChoice& choice);
/// Declares --memory, which sets the limit of MemoryLedger::process() when it is parsed.
void add_memory_option(Options& options);

/// Declares --fps and --animation; `usual` names the default in the help text.
void add_animation_options(Options& options, std::optional<std::string>& animation, std::optional<FrameRate>& rate,
                           const std::string& usual);
/// Declares --shutter.
void add_shutter_option(Options& options, RenderArguments& arguments);
/// Declares --accept-sources.
void add_accept_sources(Options& options, RenderArguments& arguments);
/// Declares the options of sequences: frames, animation, shutter, movie, ...
void add_sequence_options(Options& options, RenderArguments& arguments);
/// Throws UsageError for options of sequences that do not fit together.
void check_sequence_options(const CLI::App& app, const RenderArguments& arguments);
/// Returns the output files of all frames; the unchanged outputs without --frames.
std::vector<std::filesystem::path> output_files(const RenderArguments& arguments);

/// Copies --width and --height, if given, to arguments.width and arguments.height.
void take_size_options(const CLI::App& app, ViewArguments& arguments);
/// Declares --settings of `halflight render`.
void add_settings_option(Options& options, RenderArguments& arguments);
/// Reads the settings file; options given on the command line override it.
void use_settings(const CLI::App& app, RenderArguments& arguments);

/// Declares all options of `halflight view`.
void add_preview_options(CLI::App& app, PreviewArguments& arguments);
/// Reads the file that settings are saved to, if it exists; options override it.
void use_settings(const CLI::App& app, PreviewArguments& arguments);

/// Returns whether an option was given; false if the command lacks it.
bool given(const CLI::App& app, const std::string& option);
/// Returns the features of the arguments that are no settings.
Occasion occasion_of(const RenderArguments& arguments);
/// Throws UsageError for settings that cannot be combined (engine/settings/constraints.h), with the options that were
/// given. file: settings file that holds the others; empty: none.
void check_combinations(const CLI::App& app, const RenderSettings& settings, const Occasion& occasion,
                        const std::filesystem::path& file);
/// Throws UsageError for camera options that do not fit together.
void check_camera_options(const CLI::App& app, const CameraChoice& choice);

/// Throws UsageError for options of projection and eyes that do not fit together. Settings files must have been read.
void check_optics_options(const CLI::App& app, const ViewArguments& arguments);

/// Checks the options of `halflight view` after parsing, and reads its settings file.
void finish_preview_options(const CLI::App& app, PreviewArguments& arguments);

/// Throws UsageError for words on the command line that no option takes, and for names of files that are empty;
/// `command` is named in it.
void check_leftovers(const CLI::App& app, const std::string& command);
/// Returns a parse error as a UsageError that names the option.
UsageError usage_error(const CLI::ParseError& error, const std::string& command);
/// Returns the text of --help.
Help help_of(const CLI::App& app);

}  // namespace halflight
