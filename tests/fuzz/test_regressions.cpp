// Runs the fuzz targets on their seeds and findings; each file of regressions/ was a bug.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {
namespace {

namespace fs = std::filesystem;

struct Target {
    const char* name;
    void (*run)(std::string_view);
    std::vector<const char*> folders;  // below seeds/ and regressions/
    int damaged = 0;                   // number of copies of each file in which random bytes are changed
};

TEST(FuzzRegressions, SeedsAndTheirDamagedCopiesKeepTheGuarantees) {
    const Target targets[] = {{"arguments", arguments, {"arguments"}},
                              {"color", color, {"color"}},
                              {"draco", draco, {"draco"}, 200},
                              {"edits", edits, {"edits", "settings"}},
                              {"environment", environment, {"environment"}},
                              {"gltf", gltf, {"gltf"}, 200},
                              {"ies", ies, {"ies"}, 1000},
                              {"meshopt", meshopt, {"meshopt"}, 200},
                              {"ktx2", ktx2, {"ktx2"}, 1000},
                              {"etc1s", etc1s, {"etc1s", "ktx2"}, 1000},
                              {"uastc", uastc, {"uastc", "ktx2"}, 1000},
                              {"webp", webp, {"webp"}, 1000},
                              {"pages", pages, {"pages"}},
                              {"settings", settings, {"settings"}}};
    const std::size_t limit = MemoryLedger::process().limit();
    const fs::path fuzz = fs::path(HALFLIGHT_SOURCE_DIR) / "tests/fuzz";
    for (const auto& [name, run, folders, damaged] : targets) {
        SCOPED_TRACE(name);
        std::vector<fs::path> files;
        for (const char* kind : {"seeds", "regressions"})
            for (const char* folder : folders)
                if (fs::exists(fuzz / kind / folder))
                    for (const auto& entry : fs::directory_iterator(fuzz / kind / folder))
                        files.push_back(entry.path());
        EXPECT_FALSE(files.empty());
        for (const fs::path& path : files) {
            const std::string bytes = read_file(path, 1 << 24);
            EXPECT_NO_THROW(run(bytes)) << path;
            const std::size_t step = std::max<std::size_t>(bytes.size() / 64, 1);
            for (std::size_t length = 0; length < bytes.size(); length += length < 32 ? 1 : step)
                EXPECT_NO_THROW(run({bytes.data(), length})) << path << ", " << length << " bytes";
            std::mt19937 random(1);
            for (int i = 0; i < damaged; ++i) {
                std::string copy = bytes;
                for (int k = 0; k < 1 + i % 3; ++k) copy[random() % copy.size()] = static_cast<char>(random());
                EXPECT_NO_THROW(run(copy)) << path << ", copy " << i;
            }
        }
    }
    MemoryLedger::process().set_limit(limit);
}

}  // namespace
}  // namespace halflight::fuzz
