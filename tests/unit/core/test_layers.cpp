// Tests that includes follow rooms.txt: each room may include itself and the rooms listed for it, and no other room of
// the project.
#include <gtest/gtest.h>

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

/// Returns the room of a path relative to the checkout; empty where it is in none.
std::string room_of(const std::string& path) {
    std::string room;
    for (const auto& [name, unused] : allowed())
        if (path.starts_with(name + "/") && name.size() > room.size()) room = name;
    return room;
}

struct Include {
    int line;
    std::string path;
    bool quoted;
};

std::vector<Include> includes_of(const std::string& text) {
    static const std::regex pattern(R"(^\s*#\s*include\s*(["<])([^">]+)[">])");
    std::vector<Include> includes;
    std::istringstream lines(text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::smatch match;
        if (std::regex_search(line, match, pattern)) includes.push_back({number, match[2], match[1] == "\""});
    }
    return includes;
}

/// Returns the forbidden includes of one file, as "path:line: ...".
std::vector<std::string> errors_in(const std::string& path, const std::string& text) {
    std::vector<std::string> errors;
    const std::string room = room_of(path);
    for (const Include& include : includes_of(text)) {
        const std::string where = path + ":" + std::to_string(include.line) + ": ";
        const std::string target = room_of(include.path);
        if (target.empty()) {
            if (include.quoted) errors.push_back(where + "\"" + include.path + "\" is not named from the root");
        } else if (target != room && !allowed().at(room).contains(target)) {
            errors.push_back(where + room + " must not use " + target + " (" + include.path + ")");
        }
    }
    return errors;
}

bool is_source(const fs::path& path) {
    static const std::set<std::string> kExtensions = {".h", ".cpp", ".glsl", ".comp", ".vert", ".frag", ".geom"};
    return kExtensions.contains(path.extension().string());
}

TEST(Layers, EveryIncludePointsDown) {
    const fs::path root = HALFLIGHT_SOURCE_DIR;
    int files = 0;
    for (const char* folder : {"engine", "passes", "renderer", "api", "shaders", "tools", "tests"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            if (!entry.is_regular_file() || !is_source(entry.path())) continue;
            const std::string path = fs::relative(entry.path(), root).string();
            ++files;
            EXPECT_NE(room_of(path), "") << path << " is in no room";
            if (room_of(path).empty()) continue;
            for (const std::string& error : errors_in(path, content(entry.path()))) ADD_FAILURE() << error;
        }
    }
    EXPECT_GT(files, 20) << "too few files were found";
}

TEST(Layers, EveryRoomIsAFolder) {
    // A room lists only rooms above it in the file (otherwise allowed() throws), so there is no cycle.
    EXPECT_GT(allowed().size(), 15u);
    for (const auto& [room, rooms] : allowed()) {
        EXPECT_TRUE(fs::is_directory(fs::path(HALFLIGHT_SOURCE_DIR) / room)) << room;
        EXPECT_FALSE(rooms.contains(room)) << room << " reaches itself";
    }
}

TEST(Layers, ErrorsNameFileAndLine) {
    using Errors = std::vector<std::string>;
    EXPECT_EQ(errors_in("engine/core/a.h", "#pragma once\n#include \"renderer/render.h\"\n"),
              Errors{"engine/core/a.h:2: engine/core must not use renderer (renderer/render.h)"});
    EXPECT_EQ(errors_in("engine/scene/a.cpp", "\n\n  #  include <engine/io/gltf/gltf.h>\n"),
              Errors{"engine/scene/a.cpp:3: engine/scene must not use engine/io/gltf (engine/io/gltf/gltf.h)"});
    EXPECT_EQ(errors_in("engine/color/a.cpp", "#include \"engine/graph/graph.h\"\n").size(), 1u);  // an unlisted room
    EXPECT_EQ(errors_in("shaders/lib/a.glsl", "#include \"shaders/trace.glsl\"\n").size(), 1u);
    EXPECT_EQ(errors_in("passes/a.cpp", "#include \"render.h\"\n"),
              Errors{"passes/a.cpp:1: \"render.h\" is not named from the root"});
    EXPECT_EQ(errors_in("engine/io/a.cpp", "#include \"engine/scene/scene.h\"\n#include <vector>\n"), Errors{});
}

}  // namespace
