// Includes point down the layers only: each room may use those listed for it, itself, and nothing else of ours.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// What each room may include beside itself. A room is a folder; the longest one that a path starts with counts.
const std::map<std::string, std::set<std::string>>& allowed() {
    static const auto table = [] {
        using Rooms = std::set<std::string>;
        const auto plus = [](Rooms rooms, const Rooms& more) {
            rooms.insert(more.begin(), more.end());
            return rooms;
        };
        std::map<std::string, Rooms> t;
        t["engine/core"] = {};
        t["shaders/shared"] = {"engine/core"};
        const Rooms ground = {"engine/core", "shaders/shared"};
        t["engine/scene"] = ground;
        t["engine/gpu"] = ground;
        t["engine/io"] = plus(ground, {"engine/scene"});
        const Rooms first = plus(ground, {"engine/scene", "engine/gpu", "engine/io"});
        for (const char* room : {"engine/graph", "engine/color", "engine/reference"}) t[room] = first;
        t["engine/rays"] = plus(first, {"engine/graph"});  // its kernels are passes of a graph
        t["passes"] = plus(first, {"engine/graph", "engine/rays", "engine/color", "engine/reference"});
        t["tools"] = plus(t["passes"], {"passes"});
        t["tests"] = plus(t["tools"], {"tools", "shaders", "shaders/lib"});  // kernels within their texts
        t["shaders/lib"] = {"shaders/shared"};
        t["shaders"] = {"shaders/lib", "shaders/shared"};  // kernels
        return t;
    }();
    return table;
}

/// The room of a path relative to the checkout; empty where it is in none.
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

/// What is wrong with the includes of one file, as "path:line: ...".
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

std::string content(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

bool is_source(const fs::path& path) {
    static const std::set<std::string> kExtensions = {".h", ".cpp", ".glsl", ".comp", ".vert", ".frag", ".geom"};
    return kExtensions.contains(path.extension().string());
}

TEST(Layers, EveryIncludePointsDown) {
    const fs::path root = HALFLIGHT_SOURCE_DIR;
    int files = 0;
    for (const char* folder : {"engine", "passes", "shaders", "tools", "tests"}) {
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            if (!entry.is_regular_file() || !is_source(entry.path())) continue;
            const std::string path = fs::relative(entry.path(), root).string();
            ++files;
            EXPECT_NE(room_of(path), "") << path << " is in no room";
            if (room_of(path).empty()) continue;
            for (const std::string& error : errors_in(path, content(entry.path()))) ADD_FAILURE() << error;
        }
    }
    EXPECT_GT(files, 20) << "the walk found too little to mean anything";
}

TEST(Layers, RoomsFormNoCycle) {
    // A room that is allowed another must not be allowed by it, over any number of steps.
    for (const auto& [room, rooms] : allowed()) {
        std::set<std::string> reached;
        std::vector<std::string> open(rooms.begin(), rooms.end());
        while (!open.empty()) {
            const std::string next = open.back();
            open.pop_back();
            if (!reached.insert(next).second) continue;
            const auto& more = allowed().at(next);
            open.insert(open.end(), more.begin(), more.end());
        }
        EXPECT_FALSE(reached.contains(room)) << room << " reaches itself";
    }
}

TEST(Layers, ErrorsNameFileAndLine) {
    using Errors = std::vector<std::string>;
    EXPECT_EQ(errors_in("engine/core/a.h", "#pragma once\n#include \"passes/render.h\"\n"),
              Errors{"engine/core/a.h:2: engine/core must not use passes (passes/render.h)"});
    EXPECT_EQ(errors_in("engine/scene/a.cpp", "\n\n  #  include <engine/io/gltf.h>\n"),
              Errors{"engine/scene/a.cpp:3: engine/scene must not use engine/io (engine/io/gltf.h)"});
    EXPECT_EQ(errors_in("engine/color/a.cpp", "#include \"engine/graph/graph.h\"\n").size(), 1u);  // sideways
    EXPECT_EQ(errors_in("shaders/lib/a.glsl", "#include \"shaders/trace.glsl\"\n").size(), 1u);
    EXPECT_EQ(errors_in("passes/a.cpp", "#include \"render.h\"\n"),
              Errors{"passes/a.cpp:1: \"render.h\" is not named from the root"});
    EXPECT_EQ(errors_in("engine/io/a.cpp", "#include \"engine/scene/scene.h\"\n#include <vector>\n"), Errors{});
}

}  // namespace
