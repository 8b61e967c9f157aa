#include <gtest/gtest.h>

#include "engine/core/frames.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

using Frames = std::vector<std::uint32_t>;

Frames frames(std::string_view text) {
    return parse_frames("--frames", text);
}

std::string refusal(std::string_view text) {
    return error_message([&] { frames(text); });
}

TEST(Frames, ListsAndRanges) {
    EXPECT_EQ(frames("7"), Frames{7});
    EXPECT_EQ(frames("1-4"), (Frames{1, 2, 3, 4}));
    EXPECT_EQ(frames("1-10x4"), (Frames{1, 5, 9}));
    EXPECT_EQ(frames("1-9x4"), (Frames{1, 5, 9}));
    EXPECT_EQ(frames("1-9x100"), Frames{1});
    EXPECT_EQ(frames("5-5"), Frames{5});
    EXPECT_EQ(frames("1,5,9-12"), (Frames{1, 5, 9, 10, 11, 12}));
    EXPECT_EQ(frames("007"), Frames{7});
    EXPECT_EQ(frames("0"), Frames{0});
}

TEST(Frames, DuplicatesAreRemovedAndOrderIsKept) {
    EXPECT_EQ(frames("9,1-3,2,9"), (Frames{9, 1, 2, 3}));
    EXPECT_EQ(frames("1-10x4,1-4"), (Frames{1, 5, 9, 2, 3, 4}));
}

TEST(Frames, UpToTheLargestNumber) {
    EXPECT_EQ(frames("4294967295"), Frames{4294967295u});
    EXPECT_EQ(frames("4294967294-4294967295x4294967295"), Frames{4294967294u});
    EXPECT_EQ(frames("0-4294967295x4294967295"), (Frames{0, 4294967295u}));
    EXPECT_EQ(frames("4294967290-4294967295x3"), (Frames{4294967290u, 4294967293u}));
}

TEST(Frames, AnythingElseIsRefused) {
    for (const char* text : {"",
                             ",",
                             "1,",
                             ",1",
                             "1,,2",
                             " 1",
                             "1 ",
                             "-1",
                             "+1",
                             "1-",
                             "-",
                             "1--2",
                             "1-2-3",
                             "1x2",
                             "1-2x",
                             "1-2x-1",
                             "1-2X2",
                             "1.5",
                             "1e3",
                             "0x10",
                             "a",
                             "4294967296",
                             "99999999999999999999",
                             "1:2"})
        EXPECT_TRUE(refusal(text).starts_with("--frames: expects N, A-B or A-BxSTEP between commas, not '")) << text;
    EXPECT_EQ(refusal("1,9-3"), "--frames: '9-3' ends before it begins");
    EXPECT_EQ(refusal("1-9x0"), "--frames: '1-9x0' has a step of 0");
}

TEST(Frames, AreLimitedInNumber) {
    EXPECT_EQ(frames("1-1048576").size(), kMaxFrames);
    EXPECT_EQ(frames("0-4294967295x4096").size(), kMaxFrames);
    EXPECT_EQ(refusal("0-1048576"), "--frames: '0-1048576' means 1048577 frames, more than 1048576");
    EXPECT_EQ(refusal("0-4294967295"), "--frames: '0-4294967295' means 4294967296 frames, more than 1048576");
    EXPECT_EQ(refusal("0-1048575,5000000"), "--frames: means more than 1048576 frames");
}

TEST(Frames, AsText) {
    const auto again = [](const char* text) { return frames_text(frames(text)); };
    EXPECT_EQ(frames_text({}), "");
    EXPECT_EQ(again("7"), "7");
    EXPECT_EQ(again("1,2,4,5,6,9"), "1,2,4-6,9");
    EXPECT_EQ(again("3,2,1,2"), "3,2,1") << "in their order";
    EXPECT_EQ(again("1-9x2,20"), "1-9x2,20");
    EXPECT_EQ(again("0,10,20,21,22"), "0-20x10,21,22");
    EXPECT_EQ(again("1,3,8,10"), "1,3,8,10");
    EXPECT_EQ(again("4294967293-4294967295,0-2"), "4294967293-4294967295,0-2");
}

TEST(Frames, InParts) {
    const std::vector<std::uint32_t> frames{5, 1, 9, 10, 11, 12, 2};
    for (const std::uint32_t of : {1u, 2u, 3u, 7u, 10u, 4294967295u}) {
        std::vector<std::uint32_t> together;
        for (std::uint32_t i = 1; i <= std::min(of, 10u); ++i) {
            const auto part = part_of(frames, {i, of});
            EXPECT_LE(part.size(), (frames.size() + of - 1) / of);
            together.insert(together.end(), part.begin(), part.end());
        }
        if (of <= 10) {
            EXPECT_EQ(together, frames) << of;
        }
    }
    EXPECT_EQ(part_of(frames, {4294967295u, 4294967295u}), (std::vector<std::uint32_t>{2}));
    const ListPart part = parse_part("--part", "3/24");
    EXPECT_EQ(part.number, 3u);
    EXPECT_EQ(part.of, 24u);
    for (const char* text :
         {"", "3", "/", "3/", "/24", "0/24", "25/24", "-1/24", "3/24 ", "3/0", "3/2/1", "1/99999999999"})
        EXPECT_THROW(parse_part("--part", text), Error) << text;
}

TEST(FrameRates, AreExact) {
    const auto rate = [](const char* text) { return parse_frame_rate("--fps", text); };
    EXPECT_EQ(rate("24"), (FrameRate{24, 1}));
    EXPECT_EQ(rate("12.5"), (FrameRate{25, 2}));
    EXPECT_EQ(rate("50/2"), (FrameRate{25, 1}));
    EXPECT_EQ(rate("1000000"), (FrameRate{1000000, 1}));
    for (const char* text : {"23.976", "23.98", "23.976024", "24000/1001"})
        EXPECT_EQ(rate(text), (FrameRate{24000, 1001})) << text;
    for (const char* text : {"29.97", "29.970", "29.97003"}) EXPECT_EQ(rate(text), (FrameRate{30000, 1001})) << text;
    EXPECT_EQ(rate("59.94"), (FrameRate{60000, 1001}));
    EXPECT_EQ(rate("24.00"), (FrameRate{24, 1})) << "not 23.976";
    EXPECT_EQ(rate("29.5"), (FrameRate{59, 2}));
    EXPECT_EQ(rate("24").seconds(0), 0);
    EXPECT_EQ(rate("24").seconds(36), 1.5);
    EXPECT_DOUBLE_EQ(rate("29.97").seconds(30000), 1001);
    EXPECT_EQ(text(rate("25")), "25");
    EXPECT_EQ(text(rate("29.97")), "30000/1001");
}

TEST(FrameRates, InvalidRatesAreRefused) {
    const auto refusal = [](const char* text) { return error_message([&] { parse_frame_rate("--fps", text); }); };
    for (const char* text : {"", ".", "-24", "+24", "24 ", "1e3", "nan", "24/", "/24", "24/0", "24/1.5", "2.5/2",
                             "1.2.3", "1234567890123", "0x18"})
        EXPECT_TRUE(refusal(text).starts_with("--fps: expects frames per second as N, N.N or N/D, not '")) << text;
    for (const char* text : {"0", "0.0009", "1000001", "1/1001", "24.0000000001"})
        EXPECT_TRUE(refusal(text).starts_with("--fps: expects 0.001 to 1000000 frames per second, not '")) << text;
}

TEST(Frames, AreToldAmongAll) {
    EXPECT_EQ(frames_of_all({9, 3, 8, 7}, 24, {}), "frames 3,7-9 (4 of 24)");
    EXPECT_EQ(frames_of_all({4}, 24, {2, 5}), "frame 4 (1 of part 2/5)");
}

}  // namespace
}  // namespace halflight
