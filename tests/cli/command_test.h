// Command lines as values, and the fixture of tests that run the program with them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "engine/io/exr.h"
#include "tests/support/process.h"

namespace halflight::test {

using Strings = std::vector<std::string>;

inline void add_words(Strings& words, const char* text) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words.push_back(word);
}
inline void add_words(Strings& words, const std::string& word) {
    words.push_back(word);
}
inline void add_words(Strings& words, const std::filesystem::path& word) {
    words.push_back(word);
}
inline void add_words(Strings& words, const Strings& more) {
    words.insert(words.end(), more.begin(), more.end());
}

/// Returns a command line. Literals are split at blanks; a string or path is one word; lists are appended.
template <class... Parts>
Strings words(const Parts&... parts) {
    Strings all;
    (add_words(all, parts), ...);
    return all;
}

/// Adds options with one value each, such as "--width 32 --samples 1", unless they are given already.
inline Strings with_defaults(Strings arguments, const char* options) {
    const Strings defaults = words(options);
    for (std::size_t i = 0; i < defaults.size(); i += 2)
        if (std::ranges::find(arguments, defaults[i]) == arguments.end())
            arguments.insert(arguments.end(), {defaults[i], defaults[i + 1]});
    return arguments;
}

inline bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}
inline void expect_has(const std::string& text, const std::string& part) {
    EXPECT_TRUE(has(text, part)) << text << "\nlacks " << part;
}

inline nlohmann::json json_file(const std::filesystem::path& path) {
    return nlohmann::json::parse(read_text(path));
}
/// Parses a JSON value per line.
inline std::vector<nlohmann::json> json_lines(const std::string& text) {
    std::vector<nlohmann::json> values;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) values.push_back(nlohmann::json::parse(line));
    return values;
}

/// Returns what an .exr file says about its bias; empty if nothing.
inline std::string bias_of(const std::filesystem::path& exr) {
    return read_exr(exr).attributes.extra["bias"];
}
inline Strings channel_names(const ExrFile& exr) {
    Strings names;
    for (const ExrChannel& channel : exr.channels) names.push_back(channel.name);
    return names;
}
inline bool same_values(const ExrChannel& a, const ExrChannel& b) {
    const auto bits = [](float v) { return std::bit_cast<std::uint32_t>(v); };  // ids may be NaN
    return std::ranges::equal(a.values, b.values, {}, bits, bits);
}
/// Returns whether two .exr files have the same channels with the same bits.
inline bool same_pixels(const std::filesystem::path& a, const std::filesystem::path& b) {
    const ExrFile x = read_exr(a), y = read_exr(b);
    return channel_names(x) == channel_names(y) && std::ranges::equal(x.channels, y.channels, same_values);
}

/// Runs commands of the program with files in a folder of its own.
class CommandTest : public testing::Test {
  protected:
    std::string file(const std::string& name) const { return folder / name; }
    /// Runs a command that must succeed.
    static Outcome done(const Strings& arguments, const RunOptions& options = {}) {
        Outcome outcome = run_program(arguments, options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return outcome;
    }
    /// Runs a command that must fail with one line, which contains `element`, and leave no file behind.
    void refused(int status, const Strings& arguments, const std::string& element,
                 const RunOptions& options = {}) const {
        SCOPED_TRACE(testing::PrintToString(arguments));
        const auto before = folder.entries();
        const Outcome outcome = run_program(arguments, options);
        EXPECT_EQ(outcome.status, status) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        EXPECT_TRUE(outcome.err.starts_with("halflight: ")) << outcome.err;
        EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
        expect_has(outcome.err, element);
        EXPECT_EQ(folder.entries(), before) << "something is left behind";
    }

    TemporaryFolder folder;
};

}  // namespace halflight::test
