#include "tools/halflight/watch.h"

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <thread>

#include "engine/gpu/driver_needs.h"
#include "engine/io/gltf/named_files.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/render_parts.h"

namespace halflight {
namespace {

/// Watches the files that the command line and the scene name, whether they exist or not.
void add_named(const RenderArguments& a, FileWatch& files) {
    if (a.ocio) files.add(*a.ocio);
    if (const auto* map = std::get_if<std::filesystem::path>(&a.choice.environment)) files.add(*map);
    files.add(a.choice.pages);
    for (const auto& file : files_named_by(a.choice.scene)) files.add(file);
}

/// Makes the pictures once. Returns whether they are those of the files.
bool render_once(const RenderArguments& first, const std::function<RenderArguments()>& reread, bool again,
                 const std::function<void(const RenderArguments&, Watched*)>& render, Watched& watched) {
    watched.files = FileWatch();
    if (first.settings_file) watched.files.add(*first.settings_file);
    // A file that is being written explains an error, and its next state is waited for anyway.
    const auto tell = [&](std::string_view what) {
        if (!watched.files.differs()) fail(0, what);
    };
    try {
        add_named(first, watched.files);
        RenderArguments a = reread();
        a.overwrite |= again;  // frames and checkpoints are those of an earlier state of the files
        add_named(a, watched.files);
        render(a, &watched);
        return true;
    } catch (const FilesChanged&) {
    } catch (const Interrupted&) {
        throw;
    } catch (const UsageError& error) {
        if (!again) throw;
        tell(error.what());
    } catch (const std::bad_alloc&) {
        tell("out of memory");
    } catch (const std::exception& error) {
        tell(error.what());
    }
    return false;
}

}  // namespace

void Watched::take(const LoadedScene& scene, const ColorConfig& colors) {
    files.add(scene.files());
    files.add(scene.environment_file());
    files.add(colors.files());
}

void render_and_watch(const RenderArguments& a, const std::function<RenderArguments()>& reread,
                      const std::function<void(const RenderArguments&, Watched*)>& render) {
    constexpr auto kPause = std::chrono::milliseconds(50);
    gpu::check_process();
    Watched watched{.context = std::make_shared<gpu::Context>(gpu::Context::create(device_options(a))), .files = {}};
    const Console console(a.log.level);
    const std::string name = (a.outputs.empty() ? *a.movie : a.outputs[0]).string();
    for (bool again = false;; again = true) {
        const bool current = render_once(a, reread, again, render, watched);
        if (!again) console.note("watches {} files for changes; Ctrl+C ends", watched.files.size());
        while (!watched.files.changed()) {
            if (const int signal = stop_signal(); signal && current && !watched.files.differs())
                return;
            else if (signal)
                throw Interrupted(signal, name, "not written since the last change: interrupted");
            std::this_thread::sleep_for(kPause);
        }
    }
}

}  // namespace halflight
