// halflight-view: the program that `halflight view` starts.
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <system_error>
#include <vector>

#include "engine/gpu/driver_needs.h"
#include "tools/cli/console.h"
#include "tools/cli/picture_arguments.h"
#include "tools/cli/signals.h"
#include "tools/view/viewer.h"

int main(int argc, char** argv) {
    using namespace halflight;
    hold_standard_streams();
    handle_signals();
    std::vector<const char*> words(argv, argv + argc);
    if (argc < 2 || std::strcmp(argv[1], "view") != 0) words.insert(words.begin() + 1, "view");
    try {
        const auto arguments = parse_view_arguments(static_cast<int>(words.size()), words.data());
        if (const auto* help = std::get_if<Help>(&arguments)) std::puts(help->text.c_str());
        if (const auto* preview = std::get_if<PreviewArguments>(&arguments)) {
            if (preview->log.file) open_log(*preview->log.file);
            gpu::prepare_process();
            const auto reread = [&] {
                return std::get<PreviewArguments>(parse_view_arguments(static_cast<int>(words.size()), words.data()));
            };
            view::Viewer(*preview, reread).run();
            check_log();
        }
        if (const int signal = stop_signal()) return 128 + signal;
        return 0;
    } catch (const UsageError& error) {
        return fail(2, error.what());
    } catch (const std::bad_alloc&) {
        return fail(1, "out of memory");
    } catch (const std::system_error& error) {
        return fail(1, error);
    } catch (const std::exception& error) {
        return fail(1, error.what());
    }
}
