// Runs the seeds of the fuzz targets, truncated ones, and their findings; each file of regressions/ was a bug.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

namespace fs = std::filesystem;

void run_all(const char* name, void (*target)(std::string_view)) {
    std::size_t count = 0;
    for (const char* kind : {"seeds", "regressions"}) {
        const fs::path folder = fs::path(HALFLIGHT_SOURCE_DIR) / "tests/fuzz" / kind / name;
        if (!fs::exists(folder)) continue;
        for (const auto& entry : fs::directory_iterator(folder)) {
            std::ifstream file(entry.path(), std::ios::binary);
            const std::string bytes{std::istreambuf_iterator<char>(file), {}};
            EXPECT_NO_THROW(target(bytes)) << entry.path();
            const std::size_t step = std::max<std::size_t>(bytes.size() / 64, 1);
            for (std::size_t length = 0; length < bytes.size(); length += length < 32 ? 1 : step)
                EXPECT_NO_THROW(target({bytes.data(), length})) << entry.path() << ", " << length << " bytes";
            ++count;
        }
    }
    EXPECT_GT(count, 0u);
}

TEST(FuzzRegressions, Arguments) {
    run_all("arguments", arguments);
}
TEST(FuzzRegressions, Color) {
    run_all("color", color);
}
TEST(FuzzRegressions, Draco) {
    run_all("draco", draco);
}
TEST(FuzzRegressions, Edits) {
    run_all("edits", edits);
}
TEST(FuzzRegressions, Environment) {
    run_all("environment", environment);
}
TEST(FuzzRegressions, Gltf) {
    run_all("gltf", gltf);
}
TEST(FuzzRegressions, Meshopt) {
    run_all("meshopt", meshopt);
}
TEST(FuzzRegressions, Ktx2) {
    for (const auto target : {ktx2, etc1s, uastc}) run_all("ktx2", target);
}
TEST(FuzzRegressions, Webp) {
    run_all("webp", webp);
}
TEST(FuzzRegressions, Pages) {
    run_all("pages", pages);
}
TEST(FuzzRegressions, Settings) {
    run_all("settings", settings);
}

}  // namespace
}  // namespace halflight::fuzz
