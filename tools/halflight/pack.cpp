#include "api/halflight/pack.h"

#include <string>
#include <vector>

#include "engine/core/stopwatch.h"
#include "engine/io/files.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/progress.h"

namespace halflight {

void run_pack(const PackArguments& a) {
    make_folder_of(a.output);
    check_writable(a.output);
    remove_abandoned({&a.output, 1});
    const Stopwatch watch;
    ProgressDisplay display(stderr, progress_form(a.log.quiet()), 0);
    PackOptions options;
    options.allow_outside = a.choice.allow_outside;
    options.strict = a.choice.strict_scene;
    options.straight_glass = a.choice.edits.straight_glass;
    options.progress = [&](double share) {
        if (const int signal = stop_signal()) throw Interrupted(signal, a.output.string(), "not written: interrupted");
        display.show(share, watch.seconds());
    };
    // Warnings come at the end, after the bar.
    std::vector<std::string> warnings;
    const Log log([&](Log::Kind, std::string_view line) { warnings.emplace_back(line); });
    const paging::PageFileSizes sizes = pack_scene(a.scene, a.output, options, log);
    display.clear();
    const Console console(a.log.level);
    for (const std::string& warning : warnings) console.warn("{}", warning);
    console.note("{}: {} written in {}", a.output.string(), text_of_bytes(sizes.file), clock_text(watch.seconds()));
}

}  // namespace halflight
