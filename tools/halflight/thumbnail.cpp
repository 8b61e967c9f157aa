#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <utility>

#include "engine/core/memory_ledger.h"
#include "engine/io/file_kind.h"
#include "engine/io/temporary_name.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/render_options.h"
#include "tools/halflight/render_parts.h"

namespace halflight {
namespace {

constexpr std::size_t kAddressesBeside = std::size_t{1} << 30;  // code, stacks and the driver, bytes

/// Message of the time limit. The handler of a signal must not make texts.
char out_of_time[512];

void end_process(int) {
    [[maybe_unused]] const auto written = write(STDERR_FILENO, out_of_time, std::strlen(out_of_time));
    _exit(1);
}

/// Ends the process after its time, whatever it then does, and refuses memory beyond its limit. Scenes of strangers may
/// take any amount of both.
void limit_process(const ThumbnailArguments& a) {
    fmt::format_to_n(out_of_time, sizeof out_of_time - 1,
                     "halflight: {:.400}: not rendered within {} s, which --limit can change\n",
                     a.choice.scene.string(), a.limit);
    std::signal(SIGALRM, end_process);
    alarm(static_cast<unsigned>(a.limit));
    MemoryLedger& ledger = MemoryLedger::process();
    ledger.set_limit(std::min(ledger.limit(), a.bytes));
    rlimit addresses{};
    getrlimit(RLIMIT_AS, &addresses);
    addresses.rlim_cur = std::min<rlim_t>(addresses.rlim_cur, a.bytes + kAddressesBeside);
    setrlimit(RLIMIT_AS, &addresses);
}

}  // namespace

void add_thumbnail_options(CLI::App& app, ThumbnailArguments& a) {
    app.add_option("SCENE", a.choice.scene, "glTF 2.0 scene, .gltf or .glb")->type_name("")->required();
    app.add_option("OUTPUT", a.outputs, "picture: .png, .jpg or .tif")->type_name("")->required()->expected(1);
    a.settings.denoise = true;
    a.settings.samples = 64;
    a.settings.time_limit = 0.7;
    a.choice.in_memory = true;
    a.needs_surfaces = true;
    Options options(app);
    options.group("Picture");
    options.value("--size", "PIXELS", "width and height, 16 to 1024 (default 256)",
                  [&](const auto& name, const auto& text) { a.width = a.height = whole(name, text, 16, 1024); });
    options.value("--time", "SECONDS",
                  fmt::format("adds samples, at most {}, until the time is spent, 0.1 to 1000 (default {:g})",
                              a.settings.samples, a.settings.time_limit),
                  [&](const auto& name, const auto& text) { a.settings.time_limit = real(name, text, 0.1, 1000); });
    options.group("Run");
    options.value("--limit", "SECONDS",
                  fmt::format("ends the program with an error after this time, 1 to 10000 (default {})", a.limit),
                  [&](const auto& name, const auto& text) { a.limit = whole(name, text, 1, 10000); });
    options.value(
        "--memory", "SIZE",
        fmt::format("memory that the program may take; larger scenes are refused (default {})", text_of_bytes(a.bytes)),
        [&](const auto& name, const auto& text) { a.bytes = size_of_text(name, text); });
    add_log_options(options, a.log);
}

void finish_thumbnail_options(const CLI::App& app, ThumbnailArguments& a) {
    check_leftovers(app, "halflight thumbnail");
    if (std::error_code none; std::filesystem::is_directory(a.outputs[0], none))
        throw UsageError(a.outputs[0].string(), "is a folder, not a name for the thumbnail");
    // Some file managers want a temporary file without an extension, or a hidden one such as
    // .gnome_desktop_thumbnail.X.
    const bool temporary = !is_picture_name(a.outputs[0]) && a.outputs[0].filename().string().starts_with(".");
    if (!a.outputs[0].has_extension() || temporary) {
        check_files({a.choice.scene}, {a.outputs[0]});
        const std::string beside = fmt::format("{}{}.png", temporary_prefix(a.outputs[0]), getpid());
        a.named = std::exchange(a.outputs[0], a.outputs[0].parent_path() / beside);
    }
    if (!is_picture_name(a.outputs[0]) || has_exr(a))
        throw UsageError(a.outputs[0].string(), "a thumbnail is a .png, .jpg or .tif");
    check_render_files(a);
    a.view.replace_blind = true;
    a.choice.picture_bytes = picture_bytes(a);
}

void run_thumbnail(const ThumbnailArguments& a) {
    limit_process(a);
    run_render(a);
    if (!a.named) return;
    std::error_code error, none;
    std::filesystem::rename(a.outputs[0], *a.named, error);
    if (!error) return;
    std::filesystem::remove(a.outputs[0], none);
    throw Error(a.named->string(), "cannot be written: {}", error.message());
}

}  // namespace halflight
