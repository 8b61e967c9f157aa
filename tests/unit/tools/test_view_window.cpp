// Tests the parts of the viewer's window that need no window: events, layout, actions, messages, progress, files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <filesystem>
#include <thread>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "tests/support/process.h"
#include "tools/view/actions.h"
#include "tools/view/events.h"
#include "tools/view/file_writer.h"
#include "tools/view/folder_listing.h"
#include "tools/view/fonts.h"
#include "tools/view/progress.h"
#include "tools/view/toasts.h"
#include "tools/view/window_layout.h"

namespace halflight::view {
namespace {

using Kind = InputEvent::Kind;

InputEvent key(int code, bool down) {
    return {.kind = Kind::key, .code = code, .down = down};
}

TEST(Events, NoTapIsLost) {
    EventQueue queue;
    constexpr int kTaps = 50;
    for (int i = 0; i < kTaps; ++i) queue.add(key('F', true)), queue.add(key('F', false));
    int presses = 0, frames = 0;
    bool down = false;
    for (; !queue.empty(); ++frames) {
        const auto events = queue.take();
        ASSERT_EQ(events.size(), 1u) << "a frame sees the key in one state only";
        if (events[0].down && !down) ++presses;
        down = events[0].down;
    }
    EXPECT_EQ(presses, kTaps);
    EXPECT_EQ(frames, 2 * kTaps);
}

TEST(Events, AFrameTakesWhatItCanTellApart) {
    EventQueue queue;
    queue.add({.kind = Kind::position, .value = {1, 1}});
    queue.add({.kind = Kind::position, .value = {2, 2}});
    queue.add(key('A', true));
    queue.add(key('B', true));
    queue.add({.kind = Kind::button, .code = 0, .down = true});
    queue.add({.kind = Kind::position, .value = {9, 9}});
    queue.add({.kind = Kind::button, .code = 0, .down = false});
    queue.add(key('C', true));
    queue.add({.kind = Kind::letter, .letter = 'c'});
    queue.add({.kind = Kind::letter, .letter = 'd'});
    EXPECT_EQ(queue.take().size(), 5u) << "a click happens where it was";
    EXPECT_EQ(queue.take().size(), 2u);
    EXPECT_EQ(queue.take().size(), 3u) << "a click decides where letters go";
    EXPECT_TRUE(queue.take().empty());
}

TEST(Events, LosingTheFocusStandsAlone) {
    EventQueue queue;
    queue.add(key('A', true));
    queue.add({.kind = Kind::focus, .down = false});
    queue.add(key('A', true));
    for (const Kind kind : {Kind::key, Kind::focus, Kind::key}) {
        const auto events = queue.take();
        ASSERT_EQ(events.size(), 1u);
        EXPECT_EQ(events[0].kind, kind);
    }
}

bool overlap(const Rectangle& a, const Rectangle& b) {
    return a.origin.x < b.end().x && b.origin.x < a.end().x && a.origin.y < b.end().y && b.origin.y < a.end().y;
}

TEST(Layout, NothingCoversThePicture) {
    for (const ivec2 size : {ivec2(1280, 720), {2560, 1440}, {320, 240}, {60, 40}, {4000, 300}}) {
        for (const ivec2 picture : {ivec2(1280, 720), {64, 48}, {1, 1000}, {3840, 2160}}) {
            SCOPED_TRACE(fmt::format("{}x{}, picture {}x{}", size.x, size.y, picture.x, picture.y));
            const WindowLayout l = lay_out(size, {.menu = 20, .status = 22, .side = 350}, picture);
            EXPECT_FALSE(overlap(l.picture, l.side));
            EXPECT_FALSE(overlap(l.picture, l.status) && size.y > 42);
            EXPECT_GE(l.picture.origin.y, l.area.origin.y);
            EXPECT_LE(l.picture.size.x, l.area.size.x);
            EXPECT_GE(l.area.size.x, size.x / 3);
            EXPECT_EQ(l.side.end().x, size.x);
        }
    }
}

TEST(Layout, APictureThatFitsIsNotResampled) {
    const Parts parts{.menu = 20, .status = 22, .side = 350};
    const ivec2 picture(960, 540);
    const ivec2 window = window_size(picture, parts, ivec2(1 << 14));
    EXPECT_EQ(lay_out(window, parts, picture).picture.size, picture);
    EXPECT_EQ(lay_out(window + ivec2(1, 1), parts, picture).picture.size, picture);
    EXPECT_EQ(lay_out(picture, {}, picture).picture, (Rectangle{{0, 0}, picture}));
    const WindowLayout half = lay_out(picture / 2, {}, picture);
    EXPECT_EQ(half.picture.size, picture / 2);
    EXPECT_EQ(picture_point(half, picture, {240, 135}), dvec2(480, 270));
    EXPECT_EQ(window_size(picture, parts, {800, 600}), ivec2(800, 582));
}

TEST(Actions, KeysAreUnambiguous) {
    EXPECT_EQ(action_of(key_press("7"))->action, Action::recall);
    EXPECT_EQ(action_of(key_press("S")), nullptr) << "it moves the camera";
    EXPECT_EQ(action_of(key_press("Ctrl+Z"))->action, Action::undo);
    for (const char* name : {"Ctrl+Shift+Z", "Ctrl+Y"}) EXPECT_EQ(action_of(key_press(name))->action, Action::redo);
    EXPECT_EQ(action_of({.key = "=", .ctrl = true, .shift = true})->action, Action::larger_ui) << "a plus sign";
    std::vector<std::string> keys = {"Space", "F1"};
    for (char sign = '!'; sign < 0x7f; ++sign) {
        for (const char* modifiers : {"", "Ctrl+", "Ctrl+Shift+"})
            if (*modifiers == 0 || std::isupper(sign)) keys.push_back(modifiers + std::string{sign});
    }
    for (const std::string& name : keys) {
        const auto has = [&](const ActionRow& row) { return has_key(row, key_press(name)); };
        EXPECT_LE(std::ranges::count_if(actions(), has), 1) << name;
    }
}

TEST(Actions, DocumentsHaveTheTable) {
    const std::string page = read_file(HALFLIGHT_SOURCE_DIR "/docs/viewer.md", 1 << 20);
    for (const ActionRow& row : actions()) {
        std::string keys = std::string("`") + row.keys + "`";
        for (std::size_t at = 0; (at = keys.find(", ", at)) != std::string::npos; at += 4) keys.replace(at, 2, "`, `");
        const std::string line = fmt::format("| {} | {} |\n", keys, row.help);
        EXPECT_NE(page.find(line), std::string::npos) << line;
    }
}

TEST(Toasts, DisappearErrorsLater) {
    Toasts toasts;
    toasts.tell("saved", 0);
    toasts.tell("saved", 1);
    toasts.fail("broken", 1);
    ASSERT_EQ(toasts.all().size(), 2u);
    EXPECT_EQ(toasts.all()[0].count, 2);
    EXPECT_EQ(toasts.total(), 3u);
    EXPECT_FALSE(toasts.expire(4.5)) << "the second message has renewed the first";
    EXPECT_TRUE(toasts.expire(6));
    ASSERT_EQ(toasts.all().size(), 1u);
    EXPECT_TRUE(toasts.all()[0].error);
    toasts.tell("Layer depth", 6, "layer");
    toasts.fail("broken", 7);
    ASSERT_EQ(toasts.all().size(), 2u) << "the same error is shown once, whatever came between";
    EXPECT_EQ(toasts.all()[1].count, 2);
    EXPECT_TRUE(toasts.expire(26.5));
    ASSERT_EQ(toasts.all().size(), 1u) << "it was repeated at 7 s";
    toasts.dismiss(0);
    EXPECT_TRUE(toasts.all().empty());
    toasts.fail("broken", 30);
    EXPECT_TRUE(toasts.expire(1000));
    EXPECT_TRUE(toasts.all().empty());
    toasts.tell("Layer depth", 0, "layer");
    toasts.tell("Layer normal", 1, "layer");
    ASSERT_EQ(toasts.all().size(), 1u) << "a topic has one message";
    EXPECT_EQ(toasts.all()[0].text, "Layer normal");
}

TEST(FolderListing, ShowsFoldersAndFilesThatSuit) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "maps");
    for (const char* name : {"b.glb", "a.GLTF", "notes.txt", ".hidden.glb"}) test::write_text(folder / name, "");
    std::filesystem::create_symlink("nowhere", folder / "broken.glb");
    constexpr std::string_view kExtensions[] = {"glb", "gltf"};
    const std::vector<FolderEntry> expected = {{"maps", true}, {"a.GLTF", false}, {"b.glb", false}};
    EXPECT_EQ(list_folder(folder.path, kExtensions), expected);
    EXPECT_THROW(list_folder(folder / "none", kExtensions), Error);
    EXPECT_EQ(typed_path("/scenes", "../maps/sky.hdr"), "/maps/sky.hdr");
    EXPECT_EQ(typed_path("/scenes", "/a.glb"), "/a.glb");
}

TEST(Progress, NamesEveryState) {
    const std::pair<Progress, const char*> cases[] = {
        {{.activity = "rendering", .limit = 64, .divisor = 8}, "1/8 resolution"},
        {{.activity = "rendering", .samples = 64, .limit = 1024, .seconds = 0.125, .relmse = 0.0009},
         "64 of 1024 samples, 2 min left, error 0.03"},
        {{.activity = "", .samples = 1024, .limit = 1024, .seconds = 1}, "done"},
        {{.activity = "rendering", .samples = 64, .limit = 1024, .region = ivec2(320, 200)}, "region 320x200"}};
    for (const auto& [state, text] : cases)
        EXPECT_NE(progress_line(state).find(text), std::string::npos) << progress_line(state);
    EXPECT_EQ(share_done({.activity = "", .samples = 16, .limit = 64}), 0.25);
}

TEST(Progress, TheClockStartsAgainWithEachView) {
    SampleClock clock;
    for (const unsigned view : {1u, 2u}) {
        clock.record(view, 1, 10.0 * view);
        EXPECT_FALSE(clock.seconds());
        clock.record(view, 5, 10.0 * view + 2);
        EXPECT_EQ(clock.seconds(), 0.5);
    }
}

TEST(Fonts, AreFoundInTheFoldersOfTheSystem) {
    TemporaryFolder folder;
    EXPECT_FALSE(find_font(folder.path.string()));
    const auto place = folder.path / "share/fonts/truetype/noto/NotoSans-Regular.ttf";
    std::filesystem::create_directories(place.parent_path());
    test::write_text(place, "");
    EXPECT_EQ(find_font(folder.path.string() + ":" + (folder.path / "share").string()), place);
}

TEST(FileWriter, ReportsEachFileInOrder) {
    std::atomic<int> changes = 0;
    FileWriter writer([&] { ++changes; });
    const auto main = std::this_thread::get_id();
    bool elsewhere = false;
    writer.write("a", [&] { elsewhere = std::this_thread::get_id() != main; });
    writer.write("b", [] { throw Error("b", "the disk is full"); });
    writer.finish();
    const auto results = writer.results();
    ASSERT_EQ(results.size(), 2u);
    EXPECT_EQ(results[0].name, "a");
    EXPECT_EQ(results[0].error, "");
    EXPECT_EQ(results[1].error, "b: the disk is full");
    EXPECT_TRUE(elsewhere);
    EXPECT_TRUE(writer.results().empty());
    EXPECT_EQ(writer.waiting(), 0u);
}

}  // namespace
}  // namespace halflight::view
