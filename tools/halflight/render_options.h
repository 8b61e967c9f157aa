// Options of `halflight render`, which `halflight merge` shares.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "engine/core/versioned_file.h"
#include "tools/cli/options.h"
#include "tools/halflight/arguments.h"

namespace halflight {

using Paths = std::vector<std::filesystem::path>;

/// Throws UsageError if a file is written twice, or read and written.
void check_files(const Paths& read, const Paths& written);

/// Throws UsageError if a file that a picture writes is written twice, or read. scene_files: files that the scene
/// has beside its main one, once they are known.
void check_render_files(const RenderArguments& arguments, std::span<const VersionedFile> scene_files = {});

/// Declares the options of the scene's light.
void add_light_options(Options& options, ViewArguments& arguments);

/// Declares all options of `halflight render`.
void add_render_options(CLI::App& app, RenderArguments& arguments);
/// Completes and checks the arguments of a command with these options.
void finish_render_options(const CLI::App& app, RenderArguments& arguments);

/// Declares the options of files and of their colours.
void add_output_options(Options& options, RenderArguments& arguments);
/// Throws UsageError for options of files that no output takes.
void check_output_options(const CLI::App& app, const RenderArguments& arguments);
/// Declares --device, --gl-debug, --no-shader-cache, --memory, --threads and the options of messages.
void add_run_basics(Options& options, RenderArguments& arguments);

/// Declares all options of `halflight denoise`.
void add_denoise_options(CLI::App& app, DenoiseArguments& arguments);
/// Completes and checks its arguments.
void finish_denoise_options(const CLI::App& app, DenoiseArguments& arguments);

/// Declares all options of `halflight thumbnail`.
void add_thumbnail_options(CLI::App& app, ThumbnailArguments& arguments);
/// Completes and checks its arguments.
void finish_thumbnail_options(const CLI::App& app, ThumbnailArguments& arguments);

}  // namespace halflight
