// Tests the program where the system has little to give: a full disk of the driver's cache, and little address space.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

const std::string kScene = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";

std::vector<std::string> picture(const std::string& name, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all = {"render", kScene, name, "--width", "8", "--height", "8", "--samples", "1"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

/// Returns a command that runs a program with a file system of `size` bytes at `folder`, which it alone sees.
std::vector<std::string> with_small_disk(const std::string& folder, const std::string& size) {
    const std::string mount = "mount -t tmpfs -o size=" + size + " none \"$0\" && exec \"$@\"";
    return {"unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, folder};
}

/// Mesa's shader cache and ours lie on a disk that is full from the start, or fills while shaders are stored.
TEST(ScarceResources, AFullCacheDiskChangesNoPicture) {
    const TemporaryFolder folder;
    const std::string cache = folder / "cache";
    std::filesystem::create_directory(cache);
    const auto probe = with_small_disk(cache, "64k");
    std::vector<std::string> command = probe;
    command.push_back("true");
    if (run(command).status != 0) GTEST_SKIP() << "no file system can be mounted here";
    const RunOptions large{.environment = {"XDG_CACHE_HOME=" + cache, "MESA_SHADER_CACHE_DIR"}};
    const Outcome whole = run_program(picture(folder / "whole.exr", {"--reproducible"}), large);
    ASSERT_EQ(whole.status, 0) << whole.err;
    for (const std::string size : {"4k", "64k", "1400k", "2M"}) {
        for (const bool ours : {true, false}) {
            RunOptions small = large;
            small.wrapper = with_small_disk(cache, size);
            std::vector<std::string> arguments = picture(folder / "small.exr", {"--reproducible", "--quiet"});
            if (!ours) arguments.push_back("--no-shader-cache");
            const Outcome outcome = run_program(arguments, small);
            EXPECT_EQ(outcome.status, 0) << size << ": " << outcome.err;
            EXPECT_EQ(outcome.err, "") << size;
            EXPECT_TRUE(read_text(folder / "small.exr") == read_text(folder / "whole.exr")) << size;
        }
    }
}

TEST(ScarceResources, ALimitOfTheAddressSpaceIsNamed) {
#ifdef HALFLIGHT_SANITIZED
    GTEST_SKIP() << "address sanitizers reserve terabytes of address space";
#endif
    const TemporaryFolder folder;
    for (const int mib : {256, 320, 400, 480, 560}) {
        const std::string bytes = std::to_string(std::int64_t{mib} << 20);
        const Outcome outcome = run_program(picture(folder / "a.exr"), {.wrapper = {"prlimit", "--as=" + bytes}});
        EXPECT_EQ(outcome.status, 1) << mib;
        EXPECT_NE(outcome.err.find("the address space is limited to " + std::to_string(mib) + " MiB (ulimit -v)"),
                  std::string::npos)
            << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
    }
}

}  // namespace
}  // namespace halflight::test
