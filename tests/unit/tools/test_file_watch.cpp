// Tests FileWatch: which changes of files it sees, and when.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "engine/io/files.h"
#include "engine/io/gltf/named_files.h"
#include "tests/support/process.h"
#include "tools/cli/file_watch.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

class Files : public testing::Test {
  protected:
    static void pause(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }
    /// Returns whether the watch reports a change within a second.
    static bool waits(FileWatch& watch) {
        for (int i = 0; i < 100; ++i, pause(10))
            if (watch.changed()) return true;
        return false;
    }

    const TemporaryFolder folder;
    const std::filesystem::path a = folder / "a", b = folder / "b";
};

TEST_F(Files, EachKindOfChangeIsSeen) {
    const auto changes = [&](const std::function<void()>& change) {
        test::write_text(a, "1234");
        pause(20);  // clocks of file systems tick every few milliseconds
        FileWatch watch;
        watch.add(a);
        watch.add(b);
        EXPECT_FALSE(watch.differs() || watch.changed());
        change();
        EXPECT_TRUE(watch.differs());
        EXPECT_TRUE(waits(watch));
        watch.renew();
        EXPECT_FALSE(watch.differs());
        std::filesystem::remove(b);
    };
    changes([&] { test::write_text(a, "12345"); });
    changes([&] { test::write_text(a, "4321"); });
    changes([&] { test::write_text(b, "appears"); });
    changes([&] { std::filesystem::remove(a); });
    changes([&] {
        std::filesystem::copy_file(a, b);  // the same size and time
        std::filesystem::last_write_time(b, std::filesystem::last_write_time(a));
        std::filesystem::rename(b, a);
    });
}

TEST_F(Files, ChangesBeforeTheWatchAndDuringReadingCount) {
    test::write_text(a, "1");
    const VersionedFile read = versioned(a);
    pause(20);
    test::write_text(a, "2");
    FileWatch watch;
    watch.add(read);
    EXPECT_TRUE(watch.differs()) << "it was changed after it was read";
    watch.add(versioned(a));
    EXPECT_TRUE(watch.differs()) << "the earlier version counts";
    watch.replace(versioned(a));
    EXPECT_FALSE(watch.differs());
}

TEST_F(Files, FilesThatAreBeingWrittenAreWaitedFor) {
    test::write_text(a, "");
    FileWatch watch;
    watch.add(a);
    for (int i = 1; i <= 40; ++i, pause(10)) {
        test::write_text(a, std::string(static_cast<std::size_t>(i), 'x'));
        EXPECT_FALSE(watch.changed()) << "after " << i << " writes";
    }
    EXPECT_TRUE(waits(watch));
}

TEST_F(Files, ScenesNameTheirFilesAlsoIfTheyAreDamaged) {
    using Names = std::vector<std::filesystem::path>;
    const auto named = [&](const std::string& name, const std::string& text) {
        test::write_text(folder / name, text);
        Names names = files_named_by(folder / name);
        for (auto& path : names) path = path.lexically_relative(folder.path);
        return names;
    };
    const std::string json =
        R"({"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:,uri"}], "images": [{"uri": "c.png"}],)";
    const Names expected = {"a b.bin", "a%20b.bin", "c.png", "s.gltf"};
    EXPECT_EQ(named("s.gltf", json + R"("extras": {"name": "uri", "text": "no"}})"), expected);
    EXPECT_EQ(named("s.gltf", json + "]"), expected);
    EXPECT_EQ(named("s.gltf", ""), Names{"s.gltf"});
    EXPECT_EQ(files_named_by(folder / "none.glb"), Names{folder / "none.glb"});
    std::string glb("glTF\2\0\0\0\0\0\0\0", 12);
    for (std::size_t i = 0; i < 4; ++i) glb += static_cast<char>(json.size() >> 8 * i & 255);
    EXPECT_EQ(named("s.glb", glb + "JSON" + json + "binary"), (Names{"a b.bin", "a%20b.bin", "c.png", "s.glb"}));
    EXPECT_EQ(named("s.glb", glb.substr(0, 14)), Names{"s.glb"});
    EXPECT_EQ(named("l.parts.json", R"({"parts": [{"uri": "s.gltf"}, {"uri": "l.parts.json"}]})"),
              (Names{"l.parts.json", "s.gltf"}));
}

}  // namespace
}  // namespace halflight
