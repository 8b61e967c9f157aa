// Pictures that are rendered again whenever their files change: `halflight render --watch`.
#pragma once

#include <functional>
#include <memory>

#include "tools/cli/file_watch.h"
#include "tools/halflight/commands.h"

namespace halflight {

/// What the pictures of --watch share.
struct Watched {
    std::shared_ptr<gpu::Context> context;
    FileWatch files;  // files of the picture that is being made, or was made last

    /// Watches the files that a scene and a colour config were read from.
    void take(const LoadedScene& scene, const ColorConfig& colors);
};

/// Ends the picture that is being made, because its files have changed.
struct FilesChanged {};

/// Calls `render`, and again after each change of the files. Errors of files are told; the next change is waited for
/// then, too. Returns when a signal comes while the pictures are those of the files. Throws Interrupted if it comes
/// earlier.
void render_and_watch(const RenderArguments& arguments, const std::function<RenderArguments()>& reread,
                      const std::function<void(const RenderArguments&, Watched*)>& render);

}  // namespace halflight
