#include "tools/view/script.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "api/halflight/scene_edits.h"
#include "engine/core/error.h"
#include "tools/view/actions.h"

namespace halflight::view {
namespace {

constexpr double kAny = std::numeric_limits<double>::max();
constexpr double kWhole = 1 << 24;
constexpr double kPixels = 1e6;  // maximum length of a drag, pixels: many turns
constexpr double kWorld = 1e9;   // largest coordinate, world units

/// Kinds of words: t text, o on or off, n number, i integer, x index, which has no other bounds than 0 and kWhole.
struct Form {
    std::string_view name;
    std::string_view words;
    double lower = -kAny;  // bounds of the command's numbers
    double upper = kAny;
};
constexpr std::array kForms = {
    Form{"wait", "t"},
    Form{"wait", "ti", 1, kWhole},
    Form{"wait", "tn", 1e-9, 1e9},
    Form{"reference", "t"},
    Form{"camera", "t"},
    Form{"animation", "t"},
    Form{"frame", "i", kLeastFrame, kMostFrame},
    Form{"play", "n", 0, 1e6},
    Form{"orbit", "nn", -kPixels, kPixels},
    Form{"pan", "nn", -kPixels, kPixels},
    Form{"turn", "nn", -kPixels, kPixels},
    Form{"dolly", "n", 1e-6, 1e6},
    Form{"fly", "nnn", -kWorld, kWorld},
    Form{"walk", "nnn", -kWorld, kWorld},
    Form{"focus", "nn", -kPixels, kPixels},
    Form{"lens", "nn", -kPixels, kPixels},
    Form{"fstop", "n", 0.1, 1000},
    Form{"key", "t"},
    Form{"view", "t"},
    Form{"component", "to"},
    Form{"compare", "o"},
    Form{"split", "n", 0, 1},
    Form{"exposure", "n", -64, 64},
    Form{"transform", "tt"},
    Form{"rotation", "n", kEditRotation.lower, kEditRotation.upper},
    Form{"intensity", "n", kEditFactor.lower, kEditFactor.upper},
    Form{"emission", "n", kEditFactor.lower, kEditFactor.upper},
    Form{"tint", "nnn", kEditColor.lower, kEditColor.upper},
    Form{"add-light", "t"},
    Form{"lamp", "t"},
    Form{"material", "t"},
    Form{"node", "t"},
    Form{"select", "t"},
    Form{"click", "nn", -kPixels, kPixels},
    Form{"search", "t"},
    Form{"handles", "t"},
    Form{"drag", "nnnn", -kPixels, kPixels},
    Form{"undo", ""},
    Form{"redo", ""},
    Form{"environment", "t"},
    Form{"variant", "t"},
    Form{"hide", "t"},
    Form{"show", "t"},
    Form{"light", "xn", kEditFactor.lower, kEditFactor.upper},
    Form{"light", "xnnn", kEditColor.lower, kEditColor.upper},
    Form{"light", "t"},
    Form{"place", "xnnn", kEditPosition.lower, kEditPosition.upper},
    Form{"aim", "xnnn", kEditPosition.lower, kEditPosition.upper},
    Form{"clay", "o"},
    Form{"bounces", "i", 0, 1024},
    Form{"preview", "t"},
    Form{"clamp", "n", 0, 1e9},
    Form{"denoise", "t"},
    Form{"backfaces", "t"},
    Form{"lamps", "o"},
    Form{"culling", "t"},
    Form{"section", "t"},
    Form{"against", "t"},
    Form{"comparison", "t"},
    Form{"probe", "nnt", 0, kPixels},
    Form{"histogram", "t"},
    Form{"input", "n", 0, 1e6},
    Form{"input", "tt"},
    Form{"state", "t"},
    Form{"region", "o"},
    Form{"region", "iiii", 0, kPixels},
    Form{"measure", "o"},
    Form{"bookmark", "t"},
    Form{"recall", "t"},
    Form{"open", "t"},
    Form{"reload", ""},
    Form{"screenshot", "t"},
    Form{"window", "t"},
    Form{"save", ""},
    Form{"timings", "t"},
    Form{"quit", ""},
};

/// Returns whether the first word of the text is a colour: #rrggbb.
bool begins_with_color(std::string_view text) {
    const std::string_view word = text.substr(0, text.find_first_of(" \t\r"));
    return word.size() == 7 && word.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string_view::npos;
}

class Parser {
  public:
    Parser(const std::string& file, int line) : file_(file), line_(line) {}

    template <class... Args>
    [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(fmt::format("{}:{}", file_, line_), fmt::format(format, std::forward<Args>(args)...));
    }

    std::vector<std::string> words(std::string_view text) const {
        std::vector<std::string> all;
        for (std::size_t i = 0; i < text.size();) {
            if (text[i] == ' ' || text[i] == '\t' || text[i] == '\r') {
                ++i;
            } else if (text[i] == '#' && (all.empty() || !begins_with_color(text.substr(i)))) {
                break;
            } else if (text[i] == '"') {
                const std::size_t end = text.find('"', i + 1);
                if (end == std::string_view::npos) fail("a quotation mark is not closed");
                all.emplace_back(text.substr(i + 1, end - i - 1));
                i = end + 1;
            } else {
                const std::size_t end = std::min(text.find_first_of(" \t\r\"", i), text.size());
                all.emplace_back(text.substr(i, end - i));
                i = end;
            }
        }
        return all;
    }

    Command command(std::vector<std::string> words) const {
        Command command;
        command.name = words.front();
        command.words.assign(words.begin() + 1, words.end());
        command.line = line_;
        const auto named = [&](const Form& f) { return f.name == command.name; };
        if (std::ranges::none_of(kForms, named)) fail("unknown command '{}'", command.name);
        const bool error = command.name == "wait" && command.words.size() == 2 && command.words[0] == "error";
        const auto form = std::ranges::find_if(kForms, [&](const Form& f) {
            return named(f) && f.words.size() == command.words.size() && (!error || f.words == "tn");
        });
        if (form == kForms.end()) {
            const auto usual = std::ranges::find_if(kForms, named);
            fail("'{}' takes {} argument{}, not {}", command.name, usual->words.size(),
                 usual->words.size() == 1 ? "" : "s", command.words.size());
        }
        for (std::size_t i = 0; i < form->words.size(); ++i) {
            const char kind = form->words[i];
            if (kind == 'o' && command.words[i] != "on" && command.words[i] != "off")
                fail("'{}' takes on or off", command.name);
            if (kind != 't' && kind != 'o') command.numbers.push_back(number(command, *form, i));
        }
        check(command);
        return command;
    }

  private:
    double number(const Command& command, const Form& form, std::size_t index) const {
        const std::string& text = command.words[index];
        double value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool is_index = form.words[index] == 'x';
        const bool whole = is_index || form.words[index] == 'i';
        if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
            (whole && value != std::floor(value)))
            fail("'{}' needs a {}number, not '{}'", command.name, whole ? "whole " : "", text);
        const double lower = is_index ? 0 : form.lower, upper = is_index ? kWhole : form.upper;
        if (value < lower || value > upper)
            fail("'{}' needs a number from {} to {}, not {}", command.name, lower, upper, text);
        return value;
    }

    void check(const Command& c) const {
        const bool until = c.words.size() == 2 ? c.words[0] == "samples" || c.words[0] == "error"
                                               : c.words.size() == 1 && c.words[0] == "first";
        if (c.name == "wait" && !until)
            fail("unknown 'wait {}'; valid are 'wait first', 'wait samples N' and 'wait error E'", c.words[0]);
        if (c.name == "region" && c.numbers.empty() && c.on()) fail("'region' takes X0 Y0 X1 Y1 or off");
        if (c.name == "key" && !action_of(key_press(c.words[0])))
            fail("unknown key '{}'; F1 shows the keys", c.words[0]);
        const auto ends_in = [&](std::string_view end) { return c.words[0].ends_with(end); };
        if (c.name == "screenshot" && !ends_in(".png") && !ends_in(".exr"))
            fail("a screenshot must be a .png or an .exr");
        if (c.name == "window" && !ends_in(".png")) fail("a picture of the window must be a .png");
    }

    const std::string& file_;
    int line_;
};

}  // namespace

std::vector<Command> parse_script(const std::string& file, std::string_view text) {
    std::vector<Command> commands;
    int line = 0;
    for (std::size_t from = 0; from <= text.size();) {
        const std::size_t to = std::min(text.find('\n', from), text.size());
        const Parser parser(file, ++line);
        const std::vector<std::string> words = parser.words(text.substr(from, to - from));
        if (!words.empty()) commands.push_back(parser.command(words));
        from = to + 1;
    }
    return commands;
}

}  // namespace halflight::view
