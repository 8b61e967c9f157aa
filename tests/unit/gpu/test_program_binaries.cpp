// Tests cached program binaries: they equal compiled programs, and damaged ones are ignored.
#include "engine/gpu/program_binaries.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "engine/gpu/program.h"
#include "tests/support/gpu_test.h"
#include "tools/common/temporary_folder.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWriter =
    "layout(local_size_x = 1) in;\nlayout(std430) readonly buffer In { uint add; };\n"
    "layout(std430) writeonly buffer Out { uint result; };\nuniform usamplerBuffer none, one;\n"
    "void main() { result = VALUE + add + texelFetch(none, 0).x + texelFetch(one, 0).x; }\n";

std::string content(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
}

ProgramBinary binary_of(char fill, std::size_t count) {
    return {7, std::vector<char>(count, fill)};
}

TEST(ProgramBinaries, LoadWhatWasStored) {
    const TemporaryFolder folder;
    const ProgramBinaries binaries(folder / "a" / "b", "driver");
    EXPECT_FALSE(binaries.load("key"));
    binaries.store("key", binary_of('x', 1000));
    const auto found = binaries.load("key");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->format, 7u);
    EXPECT_EQ(found->bytes, std::vector<char>(1000, 'x'));
    EXPECT_FALSE(binaries.load("another key"));
    EXPECT_FALSE(ProgramBinaries(folder / "a" / "b", "another driver").load("key"));
    binaries.store("key", binary_of('y', 10));
    EXPECT_EQ(binaries.load("key")->bytes, std::vector<char>(10, 'y')) << "replaced";
}

TEST(ProgramBinaries, DamagedFilesAreIgnored) {
    const TemporaryFolder folder;
    const ProgramBinaries binaries(folder.path, "driver");
    binaries.store("key", binary_of('x', 10));
    const fs::path file = binaries.file("key");
    const std::string good = content(file);
    const auto put = [&](const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; };
    for (std::size_t i = 0; i < good.size(); ++i) {
        put(good.substr(0, i));
        EXPECT_FALSE(binaries.load("key")) << "cut to " << i;
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ 0x10);
        put(bad);
        EXPECT_FALSE(binaries.load("key")) << "byte " << i;
    }
    for (const std::string& bad : {good + "x", std::string(100000, '\xff')}) {
        put(bad);
        EXPECT_FALSE(binaries.load("key")) << "longer than it says";
    }
    fs::resize_file(file, std::uintmax_t{1} << 40);  // a sparse file
    EXPECT_FALSE(binaries.load("key"));
    fs::remove(file);
    ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
    EXPECT_FALSE(binaries.load("key"));
    fs::remove(file);
    fs::create_directory(file);
    EXPECT_FALSE(binaries.load("key"));
    fs::remove(file);
    // A file of another key has the name of this one, as after a hash collision.
    binaries.store("other", binary_of('z', 100));
    fs::copy_file(binaries.file("other"), file, fs::copy_options::overwrite_existing);
    EXPECT_FALSE(binaries.load("key"));
    binaries.store("key", binary_of('x', 100));
    EXPECT_TRUE(binaries.load("key"));
}

TEST(ProgramBinaries, LinksAreNotFollowed) {
    const TemporaryFolder folder, elsewhere;
    const ProgramBinaries binaries(folder.path, "driver"), others(elsewhere.path, "driver");
    others.store("key", binary_of('x', 100));
    const fs::path target = others.file("key"), link = binaries.file("key");
    const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
    fs::last_write_time(target, old);
    fs::create_symlink(target, link);
    EXPECT_FALSE(binaries.load("key")) << "a binary that another folder holds";
    EXPECT_EQ(fs::last_write_time(target), old);
    binaries.store("key", binary_of('y', 50));
    EXPECT_FALSE(fs::is_symlink(link)) << "the link is replaced, not written through";
    EXPECT_EQ(binaries.load("key")->bytes, std::vector<char>(50, 'y'));
    EXPECT_EQ(others.load("key")->bytes, std::vector<char>(100, 'x'));
}

TEST(ProgramBinaries, OnlyTheirOwnFilesAreDeleted) {
    const TemporaryFolder folder;
    const ProgramBinaries binaries(folder.path, "driver", 4000);
    for (const char* name :
         {"my.program", "my.program.txt", "0123456789abcdef.txt", "0123.program", "backup-0123456789"})
        std::ofstream(folder / name) << std::string(5000, 'n');
    const char* const abandoned = "0123456789abcdef.program.123.4.tmp";  // a killed process has left it
    std::ofstream(folder / abandoned) << std::string(5000, 'n');
    fs::last_write_time(folder / abandoned, fs::file_time_type::clock::now() - std::chrono::hours(1));
    binaries.store("a", binary_of('a', 1500));
    EXPECT_TRUE(binaries.load("a"));
    EXPECT_FALSE(fs::exists(folder / abandoned));
    EXPECT_EQ(folder.entries().size(), 6u);
}

TEST(ProgramBinaries, StayWithinTheirSize) {
    const TemporaryFolder folder;
    const ProgramBinaries binaries(folder.path, "driver", 4000);
    std::ofstream(folder.path / "notes.txt") << std::string(10000, 'n');  // neither counted nor deleted
    const auto age = [&](const char* key, int seconds) {
        fs::last_write_time(binaries.file(key), fs::file_time_type::clock::now() - std::chrono::seconds(seconds));
    };
    binaries.store("a", binary_of('a', 1500));
    binaries.store("b", binary_of('b', 1500));
    age("a", 200);
    age("b", 100);
    EXPECT_TRUE(binaries.load("a"));  // marks the binary as recently used
    binaries.store("c", binary_of('c', 1500));
    EXPECT_TRUE(binaries.load("a"));
    EXPECT_FALSE(binaries.load("b")) << "not the least recently used";
    EXPECT_TRUE(binaries.load("c"));
    binaries.store("huge", binary_of('h', 5000));
    EXPECT_FALSE(binaries.load("huge"));
    EXPECT_TRUE(binaries.load("c")) << "nothing is evicted for a file that cannot fit";
    EXPECT_EQ(folder.entries().size(), 3u);
    EXPECT_TRUE(fs::exists(folder.path / "notes.txt"));
}

TEST(ProgramBinaries, AnUnwritableFolderIsNoError) {
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "a file";
    for (const fs::path& path : {folder / "file" / "sub", fs::path("/dev/null/x")}) {
        const ProgramBinaries binaries(path, "driver");
        binaries.store("key", binary_of('x', 10));
        EXPECT_FALSE(binaries.load("key"));
    }
}

class StoredPrograms : public GpuTest {
  protected:
    static std::uint32_t result_of(const Program& program) {
        const Buffer out("out", sizeof(std::uint32_t)), one = Buffer::from("one", std::vector{1u});
        program.bind_storage("Out", out);
        program.bind_storage("In", one);
        program.bind_texture("one", one, GL_R32UI);
        program.bind_texture("none", Buffer("none", sizeof(std::uint32_t)), GL_R32UI);
        program.dispatch(1);
        return out.read<std::uint32_t>().front();
    }
    Program make(const char* value) const {
        return Program::compute({"writer", kWriter}, {{"VALUE", value}}, &binaries);
    }
    void SetUp() override {
        GpuTest::SetUp();
        GLint formats = 0;
        glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
        if (formats == 0) GTEST_SKIP() << "this driver gives no program binaries";
    }

    const TemporaryFolder folder;
    const ProgramBinaries binaries{folder.path, "driver"};
};

TEST_F(StoredPrograms, WorkLikeCompiledPrograms) {
    for (int i = 0; i < 2; ++i) {
        EXPECT_EQ(result_of(make("5u")), 7u);
        EXPECT_EQ(folder.entries().size(), 1u);
    }
    EXPECT_EQ(result_of(make("6u")), 8u) << "other text, another program";
    EXPECT_EQ(folder.entries().size(), 2u);
}

TEST_F(StoredPrograms, AreRecompiledWhereTheDriverRefusesThem) {
    make("5u");
    const fs::path file = fs::directory_iterator(folder.path)->path();
    // A known key suffices to store another binary under it.
    const std::string text = expand({"writer", kWriter}, {{"VALUE", "5u"}}).text;
    const auto good = binaries.load(text);
    ASSERT_TRUE(good);
    EXPECT_EQ(binaries.file(text), file);
    ProgramBinary garbage = *good;
    for (char& c : garbage.bytes) c = static_cast<char>(c ^ 0x55);
    ProgramBinary truncated = *good;
    truncated.bytes.resize(truncated.bytes.size() / 2);
    ProgramBinary foreign = *good;
    foreign.format = 0x1234;
    for (const ProgramBinary& bad : {garbage, truncated, foreign, ProgramBinary{good->format, {}}}) {
        binaries.store(text, bad);
        EXPECT_EQ(result_of(make("5u")), 7u);
        EXPECT_EQ(binaries.load(text)->bytes.size(), good->bytes.size()) << "replaced by a good one";
        EXPECT_EQ(binaries.load(text)->format, good->format);
    }
}

}  // namespace
}  // namespace halflight::gpu
