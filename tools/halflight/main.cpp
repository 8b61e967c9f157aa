#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string_view>
#include <system_error>

#include "engine/gpu/release_driver.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"

namespace {

constexpr int kFailure = 1;
constexpr int kUsage = 2;
constexpr int kCannotCompare = 4;  // 1 and 2 are verdicts of `halflight compare`

/// Runs the command; returns the exit status.
int run(int argc, char** argv) {
    using namespace halflight;
    const bool comparing = argc > 1 && std::string_view(argv[1]) == "compare";
    const int failure = comparing ? kCannotCompare : kFailure;
    int status = 0;
    try {
        const Arguments arguments = parse_arguments(argc, argv);
        std::visit(
            [](const auto& a) {
                if constexpr (requires { a.log.level; })
                    if (a.log.file) open_log(*a.log.file);
            },
            arguments);
        if (const auto* help = std::get_if<Help>(&arguments)) std::puts(help->text.c_str());
        if (std::holds_alternative<Version>(arguments)) print_version();
        if (const auto* manual = std::get_if<Manual>(&arguments)) write_manual(*manual);
        if (const auto* render = std::get_if<RenderArguments>(&arguments))
            run_render(*render, [=] { return std::get<RenderArguments>(parse_arguments(argc, argv)); });
        if (const auto* denoise = std::get_if<DenoiseArguments>(&arguments)) run_denoise(*denoise);
        if (const auto* thumbnail = std::get_if<ThumbnailArguments>(&arguments)) run_thumbnail(*thumbnail);
        if (std::holds_alternative<PreviewArguments>(arguments)) start_viewer(argv);
        if (const auto* converge = std::get_if<ConvergeArguments>(&arguments)) run_converge(*converge);
        if (const auto* info = std::get_if<InfoArguments>(&arguments)) run_info(*info);
        if (const auto* pack = std::get_if<PackArguments>(&arguments)) run_pack(*pack);
        if (const auto* bench = std::get_if<BenchArguments>(&arguments)) run_bench(*bench);
        if (const auto* pair = std::get_if<CompareArguments>(&arguments))
            status = static_cast<int>(compare::run(*pair));
        check_log();
        if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
            if (errno == EPIPE) return 128 + SIGPIPE;  // the reader, such as head, has enough
            throw Error("standard output", "cannot write");
        }
        return status;
    } catch (const UsageError& error) {
        return fail(comparing ? kCannotCompare : kUsage, error.what());
    } catch (const compare::SizesDiffer& error) {
        return fail(static_cast<int>(compare::Verdict::sizes_differ), error.what());
    } catch (const Interrupted& error) {
        return fail(128 + error.signal, error.what());  // shells report a death by signal with this status
    } catch (const std::bad_alloc&) {
        return fail(failure, "out of memory");
    } catch (const std::system_error& error) {
        return fail(failure, error);
    } catch (const std::exception& error) {
        return fail(failure, error.what());
    }
}

}  // namespace

int main(int argc, char** argv) {
    halflight::hold_standard_streams();
    halflight::handle_signals();
    const int status = run(argc, argv);
    halflight::gpu::release_driver();
    return status;
}
