// Options as the commands declare them, and those that commands have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/halflight/arguments.h"

namespace halflight {

inline constexpr int kMaxSamples = 1 << 24;  // a float32 counts no further
inline constexpr int kMaxBounces = 1024;
inline constexpr int kMinWindow = 16, kMaxWindow = 16384;  // sides, pixels

/// All of `text` as a number from `lower` to `upper`; `kind` says in the UsageError what was wanted.
template <class T>
T number(const std::string& option, const std::string& text, T lower, T upper, std::string_view kind) {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= lower && value <= upper))
        throw UsageError(option, "wants {} from {} to {}, not '{}'", kind, lower, upper, text);
    return value;
}

template <class T>
T whole(const std::string& option, const std::string& text, T lower, T upper) {
    return number<T>(option, text, lower, upper, "a whole number");
}

inline double real(const std::string& option, const std::string& text, double lower, double upper) {
    return number<double>(option, text, lower, upper, "a number");
}

/// As a UsageError where it is none.
Estimator estimator(const std::string& option, const std::string& list);

Preview preview(const std::string& option, const std::string& list);

/// The names in a comma list; a repeated option is joined by line ends.
std::vector<std::string> split_names(const std::string& list);

/// Options that take one value, which a function turns into what it means.
class Options {
  public:
    explicit Options(CLI::App& app) : app_(app) {}

    void group(std::string name) { group_ = std::move(name); }
    CLI::Option* value(const std::string& name, const char* metavar, const std::string& description,
                       std::function<void(const std::string& name, const std::string& text)> parse);
    CLI::Option* path(const std::string& name, const char* metavar, const std::string& description,
                      std::optional<std::filesystem::path>& target);
    void flag(const std::string& name, bool& target, const std::string& description);

  private:
    CLI::App& app_;
    std::string group_;
};

void add_camera_options(Options& options, ViewArguments& arguments);
void add_size_options(Options& options, ViewArguments& arguments);
void add_filter_options(Options& options, ViewArguments& arguments);
/// RenderSettings::clamp.
void add_clamp_option(Options& options, float& clamp);
void add_light_options(Options& options, ViewArguments& arguments);
void add_environment_option(Options& options, EnvironmentChoice& environment);
/// Config, display, view, look, exposure; what is transformed is told as `of`: " of the .png".
void add_view_options(Options& options, std::optional<std::filesystem::path>& ocio, ViewTransform& view,
                      const std::string& of);
/// Device, what the scene may name, quiet.
void add_device_options(Options& options, ViewArguments& arguments);

/// What plays, and when frames are; `usual` is what plays where nothing is said.
void add_animation_options(Options& options, std::optional<std::string>& animation, std::optional<FrameRate>& rate,
                           const std::string& usual);
/// RenderArguments::shutter.
void add_shutter_option(Options& options, RenderArguments& arguments);
/// Which frames, and the same.
void add_sequence_options(Options& options, RenderArguments& arguments);
void check_sequence_options(const CLI::App& app, const RenderArguments& arguments);
/// What --preview cannot go with.
void check_preview_options(const CLI::App& app, const RenderArguments& arguments);
/// Of all frames, the names that the command line stands for; without --frames its outputs as they are.
std::vector<std::filesystem::path> output_files(const RenderArguments& arguments);

/// --settings of `halflight render`, and what the file says put where the command line says nothing.
void add_settings_option(Options& options, RenderArguments& arguments);
void use_settings(const CLI::App& app, RenderArguments& arguments);

/// All of `halflight view`.
void add_preview_options(CLI::App& app, PreviewArguments& arguments);
void check_preview_options(const CLI::App& app, const PreviewArguments& arguments);
/// Of the file that it would save to, where it is there (take_settings()).
void use_settings(const CLI::App& app, PreviewArguments& arguments);

/// All of `halflight converge`.
void add_converge_options(CLI::App& app, ConvergeArguments& arguments);
void check_converge_options(const CLI::App& app, ConvergeArguments& arguments);

/// Throws UsageError where both were given.
void exclude(const CLI::App& app, const char* one, const char* other);
/// What the options of one command's camera make of each other.
void check_camera_options(const CLI::App& app);

}  // namespace halflight
