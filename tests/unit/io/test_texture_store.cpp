// Tests files of texture tiles: sizes, damage, disks that are full, and the cache.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <set>

#include "engine/core/cache_folder.h"
#include "engine/io/texture_store.h"
#include "tests/support/error_message.h"
#include "tests/unit/core/environment_variable.h"
#include "tests/unit/io/file_size_limit.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

TextureImage noise(int width, int height, unsigned seed = 1, bool deep = false) {
    TextureImage image{.name = "noise", .width = width, .height = height, .rgba = {}, .deep = deep};
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < 4 * static_cast<std::size_t>(image.pitch()) * static_cast<std::size_t>(height); ++i)
        image.rgba.edit().push_back(static_cast<std::uint8_t>(random()));
    return image;
}

/// Returns the descriptors of this process that are regular files.
std::set<int> open_files() {
    std::set<int> files;
    for (int descriptor = 0; descriptor < 256; ++descriptor) {
        struct stat info {};
        if (fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode)) files.insert(descriptor);
    }
    return files;
}

class TextureStores : public testing::Test {
  protected:
    const TemporaryFolder folder_;
};

TEST_F(TextureStores, GiveBackTheTexelsOfAnySize) {
    auto store = std::make_shared<TextureStore>(folder_.path);
    std::vector<std::pair<TextureImage, TextureImage>> images;  // in memory, in tiles
    for (const ivec2 size : {ivec2(1, 1), ivec2(64, 64), ivec2(65, 63), ivec2(200, 130), ivec2(16384, 1), ivec2(1, 700),
                             ivec2(128, 64), ivec2(129, 65)}) {
        for (const bool deep : {false, true}) {
            const TextureImage image = noise(size.x, size.y, 1, deep);
            TextureImage tiled = image;
            store->take(tiled);
            EXPECT_TRUE(tiled.rgba.empty());
            images.emplace_back(image, tiled);
        }
    }
    EXPECT_GT(store->bytes(), 100000u);
    store.reset();  // the file lasts as long as its images
    for (const auto& [image, tiled] : images) {
        SCOPED_TRACE(fmt::format("{} x {}", image.width, image.height));
        EXPECT_TRUE(all_texels(tiled) == image.rgba);
        const ivec2 last(image.width - 1, image.height - 1);
        EXPECT_EQ(texel_of(tiled, last), texel_of(image, last));
        EXPECT_EQ(texel_of(tiled, last / 2), texel_of(image, last / 2));
    }
    std::vector<std::uint8_t> tile(ImageTiles::kBytes, 1);
    images[4].second.tiles->read({2, 0}, tile);
    EXPECT_EQ(tile[4], 0) << "beyond the image";
    EXPECT_EQ(folder_.entries().size(), 0u) << "the file has no name";
}

TEST_F(TextureStores, DetectDamage) {
    const std::set<int> before = open_files();
    const auto store = std::make_shared<TextureStore>(folder_.path);
    TextureImage tiled = noise(200, 200);
    store->take(tiled);
    int file = -1;
    for (const int descriptor : open_files())
        if (!before.contains(descriptor)) file = descriptor;
    ASSERT_GE(file, 0);
    char byte = 0;
    const auto middle = static_cast<off_t>(store->bytes() / 2);
    ASSERT_EQ(pread(file, &byte, 1, middle), 1);
    byte = static_cast<char>(byte ^ 16);
    ASSERT_EQ(pwrite(file, &byte, 1, middle), 1);
    const std::string message = error_message([&] { all_texels(tiled); });
    EXPECT_TRUE(message.starts_with(folder_.path.string() + ": ")) << message;
    EXPECT_NE(message.find(" of noise)"), std::string::npos) << message;
    ASSERT_EQ(ftruncate(file, 100), 0);
    EXPECT_TRUE(error_message([&] { all_texels(tiled); }).starts_with(folder_.path.string() + ": "));
}

TEST_F(TextureStores, ReportDisksThatAreFull) {
    EXPECT_THROW(TextureStore(folder_ / "no"), Error);
    const auto store = std::make_shared<TextureStore>(folder_.path);
    TextureImage image = noise(500, 500);
    const std::string message = error_message([&] {
        const test::FileSizeLimit tight(200000);
        store->take(image);
    });
    EXPECT_TRUE(message.starts_with(folder_.path.string() + ": ") && message.ends_with(": File too large")) << message;
}

TEST_F(TextureStores, LieInAFolderThatExists) {
    test::EnvironmentVariable temporary("TMPDIR", folder_.path.c_str()), cache("XDG_CACHE_HOME", folder_.path.c_str());
    EXPECT_EQ(scratch_folder(), folder_.path);
    temporary.set((folder_ / "no").c_str());
    EXPECT_EQ(scratch_folder(), folder_ / "halflight/temporary");
    cache.set("/dev/null");
    EXPECT_EQ(scratch_folder(), "/tmp");
}

// --- Cache -----------------------------------------------------------------------------------------------------------

class TextureCache : public testing::Test {
  protected:
    std::shared_ptr<TextureStore> store() const {
        return std::make_shared<TextureStore>(folder_.path, folder_ / "cache/textures");
    }
    /// Returns the only file of the cache.
    std::filesystem::path file() const {
        std::vector<std::filesystem::path> files;
        for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache/textures"))
            files.push_back(entry.path());
        EXPECT_EQ(files.size(), 1u);
        return files.at(0);
    }
    static TextureImage with_levels(unsigned seed = 1, bool deep = false) {
        TextureImage image = noise(130, 70, seed, deep);
        add_levels(image, {.color = true, .data = true});
        return image;
    }
    static void expect_same(const TextureImage& tiled, const TextureImage& image) {
        EXPECT_EQ(ivec2(tiled.width, tiled.height), ivec2(image.width, image.height));
        EXPECT_EQ(tiled.deep, image.deep);
        EXPECT_TRUE(all_texels(tiled) == image.rgba);
        for (const auto levels : {&TextureImage::color_levels, &TextureImage::data_levels}) {
            ASSERT_EQ((tiled.*levels).size(), (image.*levels).size());
            for (std::size_t l = 0; l < (image.*levels).size(); ++l)
                expect_same((tiled.*levels)[l], (image.*levels)[l]);
        }
    }
    const TemporaryFolder folder_;
};

TEST_F(TextureCache, HoldsTilesAndLevels) {
    const TextureImage image = with_levels(), other = with_levels(2, true);
    TextureImage first = image, second, third = other, fourth;
    {
        const auto writer = store();
        EXPECT_FALSE(writer->find(7, first));
        writer->take(first, 7);
        EXPECT_EQ(writer->bytes(), 0u) << "nothing is in the temporary file";
    }
    expect_same(first, image);
    const auto reader = store();
    ASSERT_TRUE(reader->find(7, second));
    expect_same(second, image);
    reader->take(third, 8);
    ASSERT_TRUE(store()->find(8, fourth));
    expect_same(fourth, other);
    std::filesystem::remove_all(folder_ / "cache");
    expect_same(second, image);
    EXPECT_FALSE(reader->find(7, fourth));
}

TEST_F(TextureCache, KeysFollowContentAndUses) {
    const std::set<std::uint64_t> keys = {
        TextureStore::key("a", {}), TextureStore::key("b", {}), TextureStore::key("a", {.color = true}),
        TextureStore::key("a", {.data = true}), TextureStore::key("a", {.data = true, .normal = true})};
    EXPECT_EQ(keys.size(), 5u);
    EXPECT_EQ(TextureStore::key("a", {}), TextureStore::key("a", {}));
}

TEST_F(TextureCache, MakesDamagedAndForeignFilesAnew) {
    const TextureImage image = with_levels();
    TextureImage tiled = image;
    store()->take(tiled, 7);
    const std::filesystem::path path = file();
    const std::string whole = read_file(path, 1 << 30);
    const auto find_with = [&](const std::string& bytes) {
        std::ofstream(path, std::ios::binary) << bytes;  // write_file() would wait for the disk
        TextureImage found;
        if (!store()->find(7, found)) return false;
        expect_same(found, image);  // Zstandard ignores some bits
        return true;
    };
    EXPECT_TRUE(find_with(whole));
    for (const std::size_t length : {std::size_t{0}, std::size_t{10}, whole.size() / 2, whole.size() - 1})
        EXPECT_FALSE(find_with(whole.substr(0, length))) << length;
    int found = 0;
    for (std::size_t from_end = 1; from_end < 100; ++from_end) {
        std::string damaged = whole;
        damaged[whole.size() - from_end] = static_cast<char>(damaged[whole.size() - from_end] ^ 16);
        found += find_with(damaged) ? 1 : 0;
    }
    EXPECT_LT(found, 5);
    EXPECT_FALSE(find_with(std::string(5000, 'x')));
    EXPECT_FALSE(find_with(whole + "x"));
    tiled = image;
    store()->take(tiled, 7);
    EXPECT_TRUE(read_file(path, 1 << 30) == whole);
    std::filesystem::copy_file(path, path.parent_path() / ("0000000000000008" + path.filename().string().substr(16)));
    EXPECT_FALSE(store()->find(8, tiled)) << "a file of another key";

    std::string damaged = whole;  // the damage is in a tile, which is checked when it is read
    damaged[1000] = static_cast<char>(damaged[1000] ^ 16);
    write_file(path, damaged);
    TextureImage unread;
    ASSERT_TRUE(store()->find(7, unread));
    EXPECT_TRUE(error_message([&] { all_texels(unread); }).starts_with(path.string() + ": "));
    EXPECT_FALSE(std::filesystem::exists(path)) << "the next start makes it anew";
}

TEST_F(TextureCache, IsIgnoredWhereItCannotBeUsed) {
    write_file(folder_ / "cache", "a file");
    const TextureImage image = with_levels();
    TextureImage tiled = image;
    const auto without = store();
    without->take(tiled, 7);
    expect_same(tiled, image);
    EXPECT_GT(without->bytes(), 0u);
    EXPECT_FALSE(without->find(7, tiled));
}

}  // namespace
}  // namespace halflight
