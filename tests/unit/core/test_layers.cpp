// Tests that includes and declarations follow rooms.txt: each room may include itself and the rooms listed for it, and
// no other room of the project. It may name no type that only other rooms define, either.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

using Rooms = std::set<std::string>;

std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns for each room of rooms.txt the rooms that it may include directly or indirectly.
const std::map<std::string, Rooms>& allowed() {
    static const auto table = [] {
        std::map<std::string, Rooms> t;
        std::istringstream lines(content(fs::path(HALFLIGHT_SOURCE_DIR) / "rooms.txt"));
        std::string line;
        while (std::getline(lines, line)) {
            if (line.empty() || line[0] == '#') continue;
            std::istringstream words(line);
            std::string room, colon, used;
            words >> room >> colon;
            Rooms& rooms = t[room];
            while (words >> used) {
                if (!t.contains(used))
                    throw std::runtime_error("rooms.txt: " + room + " uses " + used + ", which is not above it");
                rooms.insert(used);
                rooms.insert(t.at(used).begin(), t.at(used).end());
            }
        }
        return t;
    }();
    return table;
}

/// Returns the room of a path relative to the checkout; empty if it is in none.
std::string room_of(const std::string& path) {
    std::string room;
    for (const auto& [name, unused] : allowed())
        if (path.starts_with(name + "/") && name.size() > room.size()) room = name;
    return room;
}

/// Reports the forbidden includes of one file, whose path is relative to the checkout.
void check_includes(const std::string& path, const std::string& text) {
    static const std::regex pattern(R"(^\s*#\s*include\s*(["<])([^">]+)[">])");
    const std::string room = room_of(path);
    EXPECT_NE(room, "") << path << " is in no room";
    std::istringstream lines(text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        if (room.empty() || line.find('#') == std::string::npos || !std::regex_search(line, match, pattern)) continue;
        const std::string target = room_of(match[2]);
        const std::string where = path + ":" + std::to_string(number) + ": " + match[2].str();
        if (target.empty()) {
            EXPECT_NE(match[1].str(), "\"") << where << " is not named from the root";
        } else {
            EXPECT_TRUE(target == room || allowed().at(room).contains(target)) << where << " must not be used here";
        }
    }
}

bool is_source(const fs::path& path) {
    static const std::set<std::string> kExtensions = {".h", ".cpp", ".glsl", ".comp", ".vert", ".frag", ".geom"};
    return kExtensions.contains(path.extension().string());
}

/// Returns the paths of all sources relative to the checkout, with their text.
const std::map<std::string, std::string>& sources() {
    static const auto files = [] {
        std::map<std::string, std::string> all;
        const fs::path root = HALFLIGHT_SOURCE_DIR;
        for (const char* folder : {"engine", "passes", "renderer", "api", "shaders", "tools", "tests"})
            for (const auto& entry : fs::recursive_directory_iterator(root / folder))
                if (entry.is_regular_file() && is_source(entry.path()))
                    all[fs::relative(entry.path(), root).string()] = content(entry.path());
        return all;
    }();
    return files;
}

/// Calls f(line number, name) for each line that the pattern matches; its last group is the name.
template <class F>
void for_each_match(const std::string& text, const std::regex& pattern, F f) {
    std::istringstream lines(text);
    std::string line;
    std::smatch match;
    for (int number = 1; std::getline(lines, line); ++number)
        if ((line.find("class ") != std::string::npos || line.find("struct ") != std::string::npos) &&
            std::regex_search(line, match, pattern))
            f(number, match[match.size() - 1].str());
}

TEST(Layers, EveryIncludePointsDown) {
    for (const auto& [path, text] : sources()) check_includes(path, text);
    EXPECT_GT(sources().size(), 20u) << "too few files were found";
}

TEST(Layers, EveryDeclarationPointsDown) {
    // Types of namespaces begin in the first column, and nested ones do not.
    static const std::regex definition(R"(^(?:class|struct|enum class)\s+(?:alignas\(\w+\)\s+)?(\w+)[^;]*\{)"),
        declaration(R"((?:^|\bfriend\s+)(?:class|struct)\s+(?:\w+::)*(\w+);)");
    std::map<std::string, Rooms> defined;
    for (const auto& [path, text] : sources())
        for_each_match(text, definition,
                       [&, &path = path](int, const std::string& name) { defined[name].insert(room_of(path)); });
    int declarations = 0;
    for (const auto& [path, text] : sources())
        for_each_match(text, declaration, [&, &path = path](int number, const std::string& name) {
            const std::string room = room_of(path);
            const Rooms& in = defined[name];  // empty: a type of a library, or a nested one
            ++declarations;
            EXPECT_TRUE(
                in.empty() || in.contains(room) ||
                std::ranges::any_of(in, [&](const std::string& other) { return allowed().at(room).contains(other); }))
                << path << ":" << number << ": " << name << ", a type of " << *in.begin() << ", must not be named here";
        });
    EXPECT_GT(declarations, 30) << "too few declarations were found";
}

TEST(Layers, NoEffectIncludesAnother) {
    // A header of passes/ that declares add_... is an effect, unless it is a step that several effects share.
    static const std::regex effect(R"(\badd_\w+\(graph::Graph&)"), include("#include \"(passes/[^\"]+)\"");
    int effects = 0;
    for (const auto& [path, text] : sources()) {
        if (!path.starts_with("passes/")) continue;
        const std::string own = path.substr(0, path.rfind('.'));
        for (std::sregex_iterator at(text.begin(), text.end(), include), end; at != end; ++at) {
            const std::string header = (*at)[1];
            if (header.starts_with("passes/steps/") || !std::regex_search(sources().at(header), effect)) continue;
            EXPECT_EQ(header, own + ".h") << path << " includes another effect";
            ++effects;
        }
    }
    EXPECT_GT(effects, 10) << "too few effects were found";
}

TEST(Layers, EveryFeatureOfShadersIsGiven) {
    // A feature that nobody sets is 0 (engine/gpu/shader_source.h), so a misspelt one would be off in silence.
    static const std::regex feature(R"(\bHALFLIGHT_(\w+))"), defined(R"(#define HALFLIGHT_(\w+))"),
        given(R"re("(?:HALFLIGHT_)?([A-Z][A-Z_0-9]*)")re"), comment("//.*"),
        of_lobe("_(ROW|LAYER|LAYERS|BANK_[0-9]|BANK_SHIFT)$");
    std::set<std::string> known = {"INCLUDED"};
    const auto add_all = [&](const std::string& text, const std::regex& pattern) {
        for (std::sregex_iterator at(text.begin(), text.end(), pattern), end; at != end; ++at) known.insert((*at)[1]);
    };
    for (const auto& [path, text] : sources())
        if (!path.starts_with("tests/")) add_all(text, path.starts_with("shaders/") ? defined : given);
    int features = 0;
    for (const auto& [path, text] : sources()) {
        if (!path.starts_with("shaders/")) continue;
        const std::string code = std::regex_replace(text, comment, "");
        for (std::sregex_iterator at(code.begin(), code.end(), feature), end; at != end; ++at, ++features) {
            const std::string name = (*at)[1];
            EXPECT_TRUE(known.contains(name) || known.contains(std::regex_replace(name, of_lobe, "")))
                << path << ": nobody sets HALFLIGHT_" << name;
        }
    }
    EXPECT_GT(features, 100) << "too few features were found";
}

TEST(Layers, EveryRoomIsAFolder) {
    // A room lists only rooms above it in the file (otherwise allowed() throws), so there is no cycle.
    EXPECT_GT(allowed().size(), 15u);
    for (const auto& [room, rooms] : allowed()) {
        EXPECT_TRUE(fs::is_directory(fs::path(HALFLIGHT_SOURCE_DIR) / room)) << room;
        EXPECT_FALSE(rooms.contains(room)) << room << " reaches itself";
    }
}

}  // namespace
