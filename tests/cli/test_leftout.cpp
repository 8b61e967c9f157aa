// Tests halflight-leftout: rows for scenes and for left-out parts, each measured with and without the part.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

using Json = nlohmann::json;

class LeftOutTool : public testing::Test {
  protected:
    /// Runs the program on the room with the options `more`; returns its figures.
    Json measure(std::vector<std::string> more) {
        std::vector<std::string> arguments = {scene,       "--width", "32",     "--height", "32",
                                              "--samples", "2",       "--json", file};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome outcome = run_program(arguments);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        printed = outcome.out;
        const Json rows = Json::parse(read_text(file));
        EXPECT_EQ(rows.size(), 1u);
        return rows.at(0);
    }
    static void expect_figures(const Json& figures, std::size_t turns, std::size_t starts) {
        for (const char* side : {"lean", "kept"}) {
            EXPECT_EQ(figures.at("seconds_per_sample").at(side).size(), turns);
            for (const char* step : {"prepare_seconds", "compile_seconds"}) {
                EXPECT_EQ(figures.at(step).at(side).size(), starts);
                for (const double seconds : figures.at(step).at(side)) EXPECT_GT(seconds, 0) << step;
            }
        }
        EXPECT_LE(figures.at("time_ratio").at("lower"), figures.at("time_ratio").at("upper"));
        EXPECT_EQ(figures.at("same_bits"), true);
    }

    TemporaryFolder folder;
    const std::string scene = copy_room(folder.path), file = folder / "figures.json";
    std::string printed;
};

TEST_F(LeftOutTool, ComparesAllAndItems) {
    const Json row = measure({"--turns", "3", "--starts", "2", "--items", "--item", "coat textures", "--item",
                              "tile lists", "--item", "sums of squares"});
    expect_figures(row, 3, 2);
    EXPECT_GT(row.at("bytes").at("kept"), row.at("bytes").at("lean"));
    std::set<std::string> measured;
    for (const Json& part : row.at("left_out")) {
        EXPECT_FALSE(part.at("fact").get<std::string>().empty());
        if (!part.contains("kept_alone")) continue;
        const std::string name = part.at("what");
        const Json& alone = part.at("kept_alone");
        measured.insert(name);
        expect_figures(alone, 3, 2);
        const auto added = alone.at("added").get<std::set<std::string>>();
        EXPECT_TRUE(added.contains(name));
        EXPECT_EQ(added.contains("clearcoat"), name == "coat textures") << name;
        EXPECT_GT(alone.at("bytes").at("kept"), alone.at("bytes").at("lean")) << name;
    }
    EXPECT_EQ(measured, (std::set<std::string>{"coat textures", "sums of squares"}));
    EXPECT_NE(printed.find("\nsums of squares "), std::string::npos) << printed;
}

TEST_F(LeftOutTool, RefusesUnknownNames) {
    const Outcome outcome = run_program({scene, "--items", "--item", "smell"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("smell"), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(run_program({scene, "--item", "clearcoat"}).status, 2) << "without --items";
}

}  // namespace
}  // namespace halflight::test
