#include "engine/gpu/shader_source.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <regex>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/gpu/dead_code.h"
#include "engine/gpu/embedded_shaders.h"

namespace halflight::gpu {
namespace {

constexpr std::string_view kRoot = "shaders/";
constexpr std::string_view kOptional = "OPTIONAL(";
constexpr std::string_view kFeature = "HALFLIGHT_";

/// Returns the folder that is read instead of the embedded shaders; empty: none.
std::string development_folder() {
    const char* folder = std::getenv("HALFLIGHT_SHADERS");
    return folder != nullptr ? folder : "";
}

/// Returns the text of a file of shaders/, if it exists.
std::optional<std::string> load(std::string_view name) {
    if (!name.starts_with(kRoot)) return std::nullopt;
    if (const std::string folder = development_folder(); !folder.empty()) {
        std::ifstream file(folder + "/" + std::string(name.substr(kRoot.size())), std::ios::binary);
        if (!file) return std::nullopt;
        return std::string(std::istreambuf_iterator<char>(file), {});
    }
    const auto& shaders = all_embedded_shaders();
    const auto found =
        std::lower_bound(shaders.begin(), shaders.end(), name,
                         [](const EmbeddedShader& shader, std::string_view n) { return shader.name < n; });
    if (found == shaders.end() || found->name != name) return std::nullopt;
    return std::string(found->text);
}

std::string_view trimmed(std::string_view s) {
    const auto first = s.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return {};
    return s.substr(first, s.find_last_not_of(" \t\r") - first + 1);
}

/// Returns the rest of a line after a directive: directive("  # include <x>", "include") is "<x>".
std::optional<std::string_view> directive(std::string_view line, std::string_view word) {
    line = trimmed(line);
    if (!line.starts_with('#')) return std::nullopt;
    line = trimmed(line.substr(1));
    if (!line.starts_with(word)) return std::nullopt;
    return trimmed(line.substr(word.size()));
}

class Expander {
  public:
    explicit Expander(ExpandedSource& out) : out_(out) {}

    void add(const std::string& name, std::string_view text) {
        const std::size_t file = number_of(name);
        there_[file].push_back(branch_);
        bool continued = false;  // the line continues the one before
        bool for_cpp = false;    // the line is C++ of a shared header, which has no conditions of its own
        for (std::size_t number = 1; !text.empty(); ++number) {
            const std::size_t end = std::min(text.find('\n'), text.size());
            const std::string_view line = text.substr(0, end);
            text.remove_prefix(std::min(end + 1, text.size()));
            if (directive(line, "el") || directive(line, "endif")) for_cpp = false;
            if (for_cpp) continue;
            if (directive(line, "ifdef") == "__cplusplus") for_cpp = true;
            const std::string_view code = trimmed(line);
            const bool continues = code.ends_with('\\');
            const bool is_code = std::exchange(continued, continues) || continues;
            if (!is_code && (code.empty() || code.starts_with("//"))) continue;
            if (directive(line, "version") || directive(line, "pragma once")) continue;
            if (const auto target = included(line)) {
                include(*target, name, number);
                continue;
            }
            if (code.starts_with(kOptional)) {
                std::string declaration(code);
                const std::size_t first = number;
                for (std::size_t lines = 1; declaration.find('}') == std::string::npos && lines < 4; ++lines) {
                    const std::size_t next = std::min(text.find('\n'), text.size());
                    (declaration += ' ') += trimmed(text.substr(0, next));
                    text.remove_prefix(std::min(next + 1, text.size()));
                    ++number;
                }
                put_optional(declaration, {file, first});
                continue;
            }
            if (directive(line, "if")) branch_.push_back(++last_branch_);
            if (directive(line, "el") && !branch_.empty()) branch_.back() = ++last_branch_;  // #else, #elif
            if (directive(line, "endif") && !branch_.empty()) branch_.pop_back();
            put(line, {file, number});
        }
    }

  private:
    /// Branches of conditions around a line, outermost first. Each number stands for one branch of one condition.
    using Branch = std::vector<std::size_t>;

    /// Includes of other folders ("engine/...") are C++.
    static std::optional<std::string> included(std::string_view line) {
        const auto rest = directive(line, "include");
        if (!rest || !rest->starts_with('"')) return std::nullopt;
        const std::string_view target = rest->substr(1, rest->find('"', 1) - 1);
        if (target.starts_with("engine/")) return std::nullopt;
        return std::string(target);
    }

    /// Returns whether the compiler has met the file whenever it meets the present line.
    bool is_there(std::size_t file) const {
        return std::ranges::any_of(there_[file], [&](const Branch& branch) {
            return branch.size() <= branch_.size() && std::equal(branch.begin(), branch.end(), branch_.begin());
        });
    }

    /// Adds an included file, unless it is there. Only the compiler can evaluate conditions. If another branch may have
    /// added the file, a macro guards it.
    void include(const std::string& target, const std::string& from, std::size_t line) {
        const std::size_t file = number_of(target);
        if (is_there(file)) return;
        const auto text = load(target);
        if (!text) throw Error(fmt::format("{}:{}", from, line), "there is no shader file \"{}\"", target);
        const ExpandedSource::Line place{number_of(from), line};
        const std::string macro = fmt::format("HALFLIGHT_INCLUDED_{}", file);
        const bool maybe_there = !there_[file].empty();
        if (maybe_there) {
            put("#ifndef " + macro, place);
            branch_.push_back(++last_branch_);
        }
        if (!branch_.empty()) put("#define " + macro, place);
        add(target, *text);
        if (maybe_there) {
            put("#endif", place);
            // Files that this one includes are there as well, whichever include has added it.
            for (std::vector<Branch>& branches : there_)
                if (std::ranges::find(branches, branch_) != branches.end())
                    branches.emplace_back(branch_.begin(), branch_.end() - 1);
            branch_.pop_back();
        }
    }

    /// Adds a block that exists under a condition, and an array in its place for code that the condition leaves out.
    void put_optional(std::string_view line, ExpandedSource::Line place) {
        const std::size_t declaration = line.find("layout(");
        const std::size_t open = line.find('{'), close = line.find('}');
        const std::string& name = out_.files[place.file];
        if (declaration == std::string_view::npos || close == std::string_view::npos || open > close)
            throw Error(fmt::format("{}:{}", name, place.number), "{}) needs a block", kOptional);
        const std::string_view condition = trimmed(line.substr(kOptional.size(), declaration - kOptional.size()));
        std::string members(line.substr(open + 1, close - open - 1));
        if (const std::size_t array = members.find("[]"); array != std::string::npos) members.insert(array + 1, 1, '1');
        put(fmt::format("#if ({}", condition), place);
        put(line.substr(declaration), place);
        put("#else", place);
        put(members, place);
        put("#endif", place);
    }

    std::size_t number_of(const std::string& name) {
        const auto found = std::ranges::find(out_.files, name);
        if (found != out_.files.end()) return static_cast<std::size_t>(found - out_.files.begin());
        out_.files.push_back(name);
        there_.emplace_back();
        return out_.files.size() - 1;
    }

    void put(std::string_view text, ExpandedSource::Line line) {
        (out_.text += text) += '\n';
        out_.lines.push_back(line);
    }

    ExpandedSource& out_;
    std::vector<std::vector<Branch>> there_;  // branches in which each file was added
    Branch branch_;                           // branches around the present line
    std::size_t last_branch_ = 0;
};

/// Returns the lines of those defines that the text, or the value of any define, mentions. Features that are mentioned
/// and neither given nor defined by the text are 0.
std::string mentioned(const Defines& defines, std::string_view text) {
    std::set<std::string_view> words, defined;
    constexpr std::string_view kDefine = "#define ";
    for (std::size_t at = 0; (at = text.find(kDefine, at)) != std::string_view::npos;) {
        at += kDefine.size();
        defined.insert(text.substr(at, std::find_if_not(text.begin() + std::ptrdiff_t(at), text.end(), in_identifier) -
                                           text.begin() - std::ptrdiff_t(at)));
    }
    const auto add_words = [&](std::string_view from) {
        for (auto at = from.begin(); (at = std::find_if(at, from.end(), in_identifier)) != from.end();) {
            const auto end = std::find_if_not(at, from.end(), in_identifier);
            words.emplace(at, end);
            at = end;
        }
    };
    add_words(text);
    for (const auto& [name, value] : defines.values()) add_words(value);
    std::string lines;
    for (const auto& [name, value] : defines.values())
        if (words.erase(name) > 0) lines += fmt::format("#define {} {}\n", name, value);
    for (const std::string_view word : words)
        if (word.starts_with(kFeature) && !defined.contains(word)) lines += fmt::format("#define {} 0\n", word);
    return lines;
}

}  // namespace

bool in_identifier(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

void Defines::set(std::string name, std::string value) {
    const auto at = std::lower_bound(values_.begin(), values_.end(), name,
                                     [](const auto& entry, const std::string& n) { return entry.first < n; });
    if (at != values_.end() && at->first == name) {
        at->second = std::move(value);
    } else {
        values_.emplace(at, std::move(name), std::move(value));
    }
}

ExpandedSource expand(const ShaderSource& source, const Defines& defines) {
    std::optional<std::string> text = source.text;
    if (text->empty()) text = load(source.name);
    if (!text) throw Error(source.name, "there is no such shader file");
    ExpandedSource out;
    Expander(out).add(source.name, *text);
    out.text = without_dead_code(out.text, defines);
    const std::string head = "#version 450 core\n" + mentioned(defines, out.text);
    out.text.insert(0, head);
    out.lines.insert(out.lines.begin(), static_cast<std::size_t>(std::ranges::count(head, '\n')), {0, 1});
    return out;
}

CompileMessage first_message(std::string_view log, const ExpandedSource& source) {
    static const std::regex kPlace(R"(^\d+(?::(\d+)\(\d+\)|\((\d+)\)) ?: (.*)$)");
    std::string first;
    for (std::size_t begin = 0; begin < log.size();) {
        const std::size_t end = std::min(log.find('\n', begin), log.size());
        const std::string line(trimmed(log.substr(begin, end - begin)));
        begin = end + 1;
        const bool is_error = line.find("error") != std::string::npos || line.find("ERROR") != std::string::npos;
        if (first.empty() || is_error) first = line;
        if (is_error) break;
    }
    std::smatch match;
    if (!std::regex_match(first, match, kPlace)) return {source.files.front(), first};
    const std::size_t line = std::stoul(match[1].str() + match[2].str());
    if (line == 0 || line > source.lines.size()) return {source.files.front(), first};
    const auto [file, number] = source.lines[line - 1];
    return {fmt::format("{}:{}", source.files[file], number), match[3]};
}

ShaderWatch::ShaderWatch() : folder_(development_folder()), known_(files()) {}

ShaderWatch::Files ShaderWatch::files() const {
    Files found;
    if (!watching()) return found;
    std::error_code none;  // files removed in the meantime count as missing
    std::filesystem::recursive_directory_iterator at(folder_, none), end;
    for (; !none && at != end; at.increment(none)) {
        std::error_code gone;
        if (!at->is_regular_file(gone)) continue;
        const auto time = at->last_write_time(gone);
        const auto bytes = at->file_size(gone);
        if (!gone) found[at->path()] = {time, bytes};
    }
    return found;
}

bool ShaderWatch::changed() {
    if (!watching()) return false;
    Files now = files();
    if (now == known_) return false;
    known_ = std::move(now);
    return true;
}

std::vector<std::string_view> embedded_shaders() {
    std::vector<std::string_view> names;
    for (const EmbeddedShader& shader : all_embedded_shaders()) names.push_back(shader.name);
    return names;
}

}  // namespace halflight::gpu
