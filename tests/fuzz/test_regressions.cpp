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

/// Runs a target on the files of its own folders, and on those of another target whose seeds it shares.
void run_all(const std::string& name, void (*target)(std::string_view), const std::string& shared = {}) {
    std::size_t count = 0;
    const fs::path fuzz = fs::path(HALFLIGHT_SOURCE_DIR) / "tests/fuzz";
    std::vector<fs::path> folders = {fuzz / "seeds" / name, fuzz / "regressions" / name};
    if (!shared.empty()) folders.insert(folders.end(), {fuzz / "seeds" / shared, fuzz / "regressions" / shared});
    for (const fs::path& folder : folders) {
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
    run_all("edits", edits, "settings");
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
    run_all("ktx2", ktx2);
    run_all("etc1s", etc1s, "ktx2");
    run_all("uastc", uastc, "ktx2");
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
