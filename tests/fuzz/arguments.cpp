#include "tools/halflight/arguments.h"

#include <unordered_set>

#include "engine/core/frames.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

void frames(const std::string& text) {
    try {
        const std::vector<FrameNumber> list = parse_frames("--frames", text);
        const std::unordered_set<FrameNumber> distinct(list.begin(), list.end());
        if (list.empty() || list.size() > kMaxFrames) throw Broken("a list of no frames, or of too many");
        if (distinct.size() != list.size()) throw Broken("a frame comes twice");
    } catch (const Error& error) {
        if (std::string_view(error.what()).find("--frames: ") != 0) throw Broken("the option is not named");
    }
}

void command_line(const std::vector<std::string>& words) {
    std::vector<const char*> argv = {"halflight"};
    for (const std::string& word : words) argv.push_back(word.c_str());
    argv.push_back(nullptr);
    try {
        const Arguments arguments = parse_arguments(static_cast<int>(argv.size()) - 1, argv.data());
        const auto* render = std::get_if<RenderArguments>(&arguments);
        if (render && (render->choice.scene.empty() || render->outputs.empty())) throw Broken("nothing to render");
    } catch (const Error&) {
        // main() prints this error as one line.
    }
}

}  // namespace

void arguments(std::string_view input) {
    std::vector<std::string> lines(1);
    for (const char c : input) {
        if (c == '\n')
            lines.emplace_back();
        else if (c != '\0')  // NUL ends a word of argv
            lines.back() += c;
    }
    frames(lines.front());
    lines.erase(lines.begin());
    command_line(lines);
}

}  // namespace halflight::fuzz
