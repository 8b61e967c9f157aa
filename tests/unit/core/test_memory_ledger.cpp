// Tests the memory that the system leaves free, sizes as text, and the ledger.
#include "engine/core/memory_ledger.h"

#include <gtest/gtest.h>

#include <fstream>
#include <utility>

#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

class AvailableMemory : public testing::Test {
  protected:
    void write(const std::string& file, const std::string& text) const {
        const std::filesystem::path path = root_ / file;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path) << text;
    }
    std::size_t mebibytes() const { return available_memory(root_.path).value() / kMiB; }

    TemporaryFolder root_;
};

TEST_F(AvailableMemory, IsThatOfTheSystem) {
    EXPECT_FALSE(available_memory(root_.path));
    write("proc/meminfo", "MemTotal:       16384000 kB\nMemFree: 1024 kB\nMemAvailable:    4096000 kB\n");
    EXPECT_EQ(mebibytes(), 4000u);
    EXPECT_GT(available_memory().value_or(0), kMiB);
}

TEST_F(AvailableMemory, IsLimitedByTheGroupsOfVersion2) {
    write("proc/meminfo", "MemAvailable: 4096000 kB\n");
    write("proc/self/cgroup", "0::/farm/job\n");
    write("sys/fs/cgroup/farm/job/memory.max", "max\n");
    write("sys/fs/cgroup/farm/job/memory.current", "1048576\n");
    EXPECT_EQ(mebibytes(), 4000u);
    // The group above has a limit of 1000 MiB. Of the 600 that it uses, 200 are file cache.
    write("sys/fs/cgroup/farm/memory.max", std::to_string(1000 * kMiB));
    write("sys/fs/cgroup/farm/memory.current", std::to_string(600 * kMiB));
    write("sys/fs/cgroup/farm/memory.stat", "anon 1\ninactive_file " + std::to_string(200 * kMiB) + "\n");
    EXPECT_EQ(mebibytes(), 600u);
    write("sys/fs/cgroup/farm/job/memory.max", std::to_string(101 * kMiB));
    EXPECT_EQ(mebibytes(), 100u);
    // A group that has more than its limit for a while leaves nothing.
    write("sys/fs/cgroup/farm/job/memory.current", std::to_string(200 * kMiB));
    EXPECT_EQ(mebibytes(), 0u);
}

TEST_F(AvailableMemory, IsLimitedByTheGroupsOfVersion1) {
    write("proc/self/cgroup", "5:cpu,memory:/job\n0::/\n");
    write("sys/fs/cgroup/memory/job/memory.limit_in_bytes", std::to_string(500 * kMiB));
    write("sys/fs/cgroup/memory/job/memory.usage_in_bytes", std::to_string(100 * kMiB));
    write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
    write("sys/fs/cgroup/memory/memory.usage_in_bytes", std::to_string(900 * kMiB));
    EXPECT_EQ(mebibytes(), 400u);
    // In a container the path of the group is that of the host, and only the top is visible.
    write("proc/self/cgroup", "5:memory:/elsewhere/job\n");
    write("sys/fs/cgroup/memory/memory.limit_in_bytes", std::to_string(1000 * kMiB));
    EXPECT_EQ(mebibytes(), 100u);
}

TEST(Bytes, AreParsedAndHaveUnits) {
    EXPECT_EQ(parse_bytes("4096"), 4096u);
    EXPECT_EQ(parse_bytes("2GiB"), 2048 * kMiB);
    EXPECT_EQ(parse_bytes("1.5G"), 1536 * kMiB);
    EXPECT_EQ(parse_bytes("800 MiB"), 800 * kMiB);
    EXPECT_EQ(parse_bytes("1K"), 1024u);
    EXPECT_EQ(parse_bytes("0.5T"), 512 * 1024 * kMiB);
    for (const char* text : {"", "G", "0", "0.5", "-1G", "2GB", "2Gi", "1e3", "nan", "inf", "2G ", "0x10", "99999999T"})
        EXPECT_FALSE(parse_bytes(text)) << text;
    EXPECT_EQ(text_of_bytes(1023), "1023 bytes");
    EXPECT_EQ(text_of_bytes(1536), "1.5 KiB");
    EXPECT_EQ(text_of_bytes(2048 * kMiB), "2.0 GiB");
}

TEST(MemoryLedger, CountsEntriesWhileTheyLive) {
    MemoryLedger ledger(1000);
    {
        MemoryLedger::Entry scene(ledger, MemoryPart::scene, 300);
        MemoryLedger::Entry bands(ledger, MemoryPart::bands, 200);
        EXPECT_EQ(ledger.bytes(MemoryPart::scene), 300u);
        EXPECT_EQ(ledger.free(), 500u);
        bands = std::move(scene);
        scene = {};
        EXPECT_EQ(ledger.bytes(MemoryPart::scene), 300u);
        EXPECT_EQ(ledger.bytes(MemoryPart::bands), 0u);
        EXPECT_EQ(bands.bytes(), 300u);
        EXPECT_NO_THROW(ledger.check(700, "a.glb", "textures"));
        const std::string message = error_message([&] { ledger.check(701, "a.glb", "textures"); });
        EXPECT_TRUE(message.starts_with("a.glb: ") && message.find("textures") != std::string::npos) << message;
    }
    EXPECT_EQ(ledger.free(), 1000u);
    const MemoryLedger::Entry more(ledger, MemoryPart::picture, 2000);
    EXPECT_EQ(ledger.free(), 0u);
}

}  // namespace
}  // namespace halflight
