#include <gtest/gtest.h>

#include "engine/core/frames.h"
#include "engine/core/suggestion.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

using Frames = std::vector<FrameNumber>;

Frames frames(std::string_view text) {
    return parse_frames("--frames", text);
}

std::string refusal(std::string_view text) {
    return error_message([&] { frames(text); });
}

TEST(Frames, ListsAndRanges) {
    const std::pair<const char*, Frames> cases[] = {
        {"7", {7}},
        {"007", {7}},
        {"0", {0}},
        {"1-4", {1, 2, 3, 4}},
        {"1-10x4", {1, 5, 9}},
        {"1-9x4", {1, 5, 9}},
        {"1-9x100", {1}},
        {"5-5", {5}},
        {"1,5,9-12", {1, 5, 9, 10, 11, 12}},
        {"9,1-3,2,9", {9, 1, 2, 3}},  // the order is kept, duplicates are removed
        {"1-10x4,1-4", {1, 5, 9, 2, 3, 4}},
        {"-5", {-5}},
        {"-5--1x2,3", {-5, -3, -1, 3}},
        {"-2-1", {-2, -1, 0, 1}},
        {"-2147483648", {kLeastFrame}},
        {"4294967295", {4294967295u}},
        {"4294967294-4294967295x4294967295", {4294967294u}},
        {"0-4294967295x4294967295", {0, 4294967295u}},
        {"4294967290-4294967295x3", {4294967290u, 4294967293u}},
    };
    for (const auto& [text, expected] : cases) EXPECT_EQ(frames(text), expected) << text;
}

TEST(Frames, AnythingElseIsRefused) {
    const auto expect_refused = [](std::initializer_list<const char*> texts) {
        for (const char* text : texts) EXPECT_TRUE(refusal(text).starts_with("--frames: ")) << text;
    };
    expect_refused({"", ",", "1,", ",1", "1,,2", " 1", "1 ", "--1", "+1", "1-", "-", "1--2", "1-2-3", "1x2", "1-2x"});
    expect_refused({"1-2x-1", "1-2X2", "1.5", "1e3", "0x10", "a", "1:2", "4294967296", "99999999999999999999"});
    expect_refused({"9-3", "-1--3", "-2147483649", "1-9x0", "0-1048576", "0-4294967295", "0-1048575,5000000"});
    EXPECT_EQ(frames("1-1048576").size(), kMaxFrames);
    EXPECT_EQ(frames("0-4294967295x4096").size(), kMaxFrames);
}

TEST(Frames, AsText) {
    EXPECT_EQ(frames_text({}), "");
    for (const char* text : {"7", "1,2,4-6,9", "3,2,1", "1-9x2,20", "0-20x10,21,22", "1,3,8,10",
                             "4294967293-4294967295,0-2", "-7--5,-9,-3", "-9--1x4"})
        EXPECT_EQ(frames_text(frames(text)), text);
    EXPECT_EQ(frames_text(frames("1,2,4,5,6,9")), "1,2,4-6,9");
    EXPECT_EQ(frames_of_all({9, 3, 8, 7}, 24, {}), "frames 3,7-9 (4 of 24)");
    EXPECT_EQ(frames_of_all({4}, 24, {2, 5}), "frame 4 (1 of part 2/5)");
}

TEST(Frames, InParts) {
    const Frames frames{5, 1, 9, 10, 11, 12, 2};
    for (const std::uint32_t of : {1u, 2u, 3u, 7u, 10u, 4294967295u}) {
        Frames together;
        for (std::uint32_t i = 1; i <= std::min(of, 10u); ++i) {
            const auto part = part_of(frames, {i, of});
            EXPECT_LE(part.size(), (frames.size() + of - 1) / of);
            together.insert(together.end(), part.begin(), part.end());
        }
        if (of <= 10) {
            EXPECT_EQ(together, frames) << of;
        }
    }
    EXPECT_EQ(part_of(frames, {4294967295u, 4294967295u}), (Frames{2}));
    const ListPart part = parse_part("--part", "3/24");
    EXPECT_EQ(part.number, 3u);
    EXPECT_EQ(part.of, 24u);
    for (const char* text :
         {"", "3", "/", "3/", "/24", "0/24", "25/24", "-1/24", "3/24 ", "3/0", "3/2/1", "1/99999999999"})
        EXPECT_THROW(parse_part("--part", text), Error) << text;
}

TEST(FrameRates, AreExact) {
    const auto rate = [](const char* text) { return parse_frame_rate("--fps", text); };
    const std::pair<FrameRate, std::vector<const char*>> cases[] = {
        {{24, 1}, {"24", "24.00"}},
        {{25, 1}, {"25", "50/2"}},
        {{25, 2}, {"12.5"}},
        {{59, 2}, {"29.5"}},
        {{1000000, 1}, {"1000000"}},
        {{24000, 1001}, {"23.976", "23.98", "23.976024", "24000/1001"}},
        {{30000, 1001}, {"29.97", "29.970", "29.97003"}},
        {{60000, 1001}, {"59.94"}}};
    for (const auto& [expected, texts] : cases)
        for (const char* text : texts) EXPECT_EQ(rate(text), expected) << text;
    EXPECT_EQ(rate("24").seconds(36), 1.5);
    EXPECT_DOUBLE_EQ(rate("29.97").seconds(30000), 1001);
    EXPECT_EQ(text(rate("25")), "25");
    EXPECT_EQ(text(rate("29.97")), "30000/1001");
}

TEST(FrameRates, InvalidRatesAreRefused) {
    for (const char* text :
         {"",       ".",     "-24",   "+24",           "24 ",  "1e3", "nan",    "24/",     "/24",    "24/0",
          "24/1.5", "2.5/2", "1.2.3", "1234567890123", "0x18", "0",   "0.0009", "1000001", "1/1001", "24.0000000001"})
        EXPECT_TRUE(error_message([&] { parse_frame_rate("--fps", text); }).starts_with("--fps: ")) << text;
}

TEST(Suggestion, NamesTheLikeliestWord) {
    const std::vector<std::string> names = {"depth", "albedo", "direct_diffuse", "direct_glossy", "ids"};
    const std::pair<const char*, const char*> cases[] = {
        {"depht", "depth"}, {"deph", "depth"}, {"albeddo", "albedo"}, {"Direct_glosy", "direct_glossy"}};
    for (const auto& [word, name] : cases)
        EXPECT_EQ(did_you_mean(word, names), std::string("; did you mean '") + name + "'?");
    for (const char* far : {"id", "smell", ""}) EXPECT_EQ(did_you_mean(far, names), "") << far;
    EXPECT_EQ(did_you_mean(std::string(1000, 'a'), {std::string(1001, 'a')}), "") << "so long a word is no name";
    EXPECT_EQ(did_you_mean("depth", {}), "");
}

}  // namespace
}  // namespace halflight
