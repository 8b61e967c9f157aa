// Tests atomic writing and limited reading of files.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <vector>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "tests/support/error_message.h"
#include "tools/common/temporary_folder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
  protected:
    std::size_t entries() const { return folder_.entries().size(); }

    const TemporaryFolder folder_;
};

TEST_F(Files, RoundTripOfAnyBytes) {
    for (const std::string& bytes : {std::string("\0\n\r\xff text", 9), std::string()}) {
        write_file(folder_ / "a.bin", bytes);
        EXPECT_EQ(read_file(folder_ / "a.bin", bytes.size()), bytes);
    }
    EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, FilesAppearOnlyWhenComplete) {
    const fs::path path = folder_ / "image.exr";
    write_file(path, "old");
    const auto fail = [](const fs::path& temporary) {
        std::ofstream(temporary) << "half of";
        throw std::runtime_error("no more");
    };
    EXPECT_THROW(write_atomically(path, fail), std::runtime_error);
    EXPECT_THROW(write_atomically(folder_ / "b.txt", fail), std::runtime_error);
    write_atomically(path, [&](const fs::path& temporary) {
        EXPECT_EQ(temporary.parent_path(), folder_.path);
        EXPECT_EQ(temporary.extension(), ".exr");
        std::ofstream(temporary) << "new";
        EXPECT_EQ(read_file(path, 100), "old");
    });
    EXPECT_EQ(read_file(path, 100), "new");
    EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, ErrorsNameTheFileAndTheReason) {
    write_file(folder_ / "ten", "0123456789");
    ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    const fs::path long_name = folder_ / std::string(300, 'x');
    const auto write = [](const fs::path& path) { write_file(path, "x"); };
    const auto read = [](const fs::path& path) { read_file(path, 9); };
    const struct {
        std::function<void(const fs::path&)> act;
        fs::path path;
        const char* message;
    } cases[] = {{write, folder_ / "no/a.txt", "cannot write: No such file or directory"},
                 {write, folder_.path, "cannot write: Is a directory"},
                 {write, folder_.path.string() + "/", "does not name a file to write"},
                 {write, "/dev/full", "cannot write: not a regular file"},
                 {write, folder_ / "ten/a.txt", "cannot write: Not a directory"},
                 {write, long_name, "cannot write: File name too long"},
                 {read, folder_ / "none", "cannot read: No such file or directory"},
                 {read, folder_.path, "cannot read: Is a directory"},
                 {read, "/dev/zero", "cannot read: not a regular file"},
                 {read, folder_ / "ten", "has 10 bytes, more than the limit of 9"},
                 {read, folder_ / "pipe", "cannot read: not a regular file"},
                 {check_readable, folder_.path, "cannot read: Is a directory"},
                 {check_writable, folder_.path, "cannot write: Is a directory"}};
    for (const auto& [act, path, message] : cases)
        EXPECT_EQ(error_message([&] { act(path); }), path.string() + ": " + message);
    EXPECT_EQ(error_message([&] { write(""); }), "output: does not name a file to write");
    EXPECT_EQ(entries(), 2u);
}

/// Drops root's privilege to write everywhere as long as the object exists.
struct Nobody {
    explicit Nobody(const fs::path& folder) {
        if (geteuid() != 0) return;
        constexpr uid_t kNobody = 65534;
        works = chown(folder.c_str(), kNobody, kNobody) == 0 && seteuid(kNobody) == 0 &&
                euidaccess(folder.c_str(), W_OK) == 0;
    }
    ~Nobody() { EXPECT_EQ(seteuid(getuid()), 0); }
    bool works = true;  // false if the process cannot become that user, or that user cannot reach the folder
};

TEST_F(Files, ReadOnlyFolderAndFile) {
    const Nobody nobody(folder_.path);
    if (!nobody.works) GTEST_SKIP() << "root cannot become another user here";
    const fs::path path = folder_ / "a.txt";
    write_file(path, "old");
    fs::permissions(path, fs::perms::owner_read);
    EXPECT_EQ(error_message([&] { write_file(path, "new"); }), path.string() + ": cannot write: Permission denied");
    fs::permissions(folder_.path, fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_EQ(error_message([&] { write_file(folder_ / "b", "new"); }),
              (folder_ / "b").string() + ": cannot write: Permission denied");
    fs::permissions(folder_.path, fs::perms::owner_all);
    EXPECT_EQ(read_file(path, 100), "old");
}

TEST_F(Files, PermissionsAreKeptAndOtherwiseFollowTheUmask) {
    const auto mode = [&](const char* name) { return fs::status(folder_ / name).permissions(); };
    const mode_t old = umask(027);
    write_file(folder_ / "new", "");
    umask(old);
    EXPECT_EQ(mode("new"), fs::perms(0640));
    fs::permissions(folder_ / "new", fs::perms(0604));
    write_file(folder_ / "new", "again");
    EXPECT_EQ(mode("new"), fs::perms(0604));
}

TEST_F(Files, SymbolicLinksAreFollowed) {
    fs::create_directories(folder_ / "far");
    write_file(folder_ / "far/target", "old");
    fs::create_symlink("far/target", folder_ / "link");
    fs::create_symlink("link", folder_ / "second");
    write_file(folder_ / "second", "new");
    EXPECT_EQ(read_file(folder_ / "far/target", 9), "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_TRUE(fs::is_symlink(folder_ / "second"));
    fs::create_symlink("far/later", folder_ / "dangling");
    write_file(folder_ / "dangling", "made");
    EXPECT_EQ(read_file(folder_ / "far/later", 9), "made");
    fs::create_symlink("loop", folder_ / "loop");
    EXPECT_NE(error_message([&] { write_file(folder_ / "loop", ""); }).find("symbolic links"), std::string::npos);
}

TEST_F(Files, TemporariesOfKilledWritersCanBeRemoved) {
    const auto die_writing = [&](const fs::path& path) {
        const pid_t child = fork();
        if (child == 0) write_atomically(path, [](const auto&) { raise(SIGKILL); });
        waitpid(child, nullptr, 0);
    };
    const std::vector<fs::path> mine = {folder_ / "a.exr", folder_ / "b.exr"};
    die_writing(folder_ / "a.exr");
    die_writing(folder_ / "other.exr");
    ASSERT_EQ(entries(), 2u) << "the temporary of each file";
    write_atomically(folder_ / "b.exr", [&](const auto& temporary) {
        remove_abandoned(mine);
        EXPECT_TRUE(fs::exists(temporary)) << "its writer lives";
        EXPECT_EQ(entries(), 2u) << "this one and the other process's";
    });
    EXPECT_TRUE(fs::exists(folder_ / "b.exr"));
    const fs::path other[] = {folder_ / "other.exr", folder_ / "none" / "x"};
    remove_abandoned(other);
    EXPECT_EQ(entries(), 1u);
    // The temporary file of a link is in the folder of the link's target.
    fs::create_directories(folder_ / "far");
    fs::create_symlink("far/target", folder_ / "link");
    const fs::path link[] = {folder_ / "link"};
    die_writing(link[0]);
    EXPECT_FALSE(fs::is_empty(folder_ / "far"));
    remove_abandoned(link);
    EXPECT_TRUE(fs::is_empty(folder_ / "far"));
}

TEST_F(Files, AFullDiskFailsAtCloseAtTheLatest) {
    const std::string full = "out.exr: cannot write: No space left on device";
    CheckedFile file("/dev/full", "out.exr");
    file.write("x", 1);  // the byte is only buffered
    EXPECT_EQ(error_message([&] { file.close(); }), full);

    CheckedFile swallowed("/dev/full", "out.exr");
    const std::string much(1 << 20, 'x');
    EXPECT_EQ(error_message([&] { swallowed.write(much.data(), much.size()); }), full);
    EXPECT_EQ(error_message([&] { swallowed.close(); }), full);
}

TEST_F(Files, UnnamedFilesAppearOnlyWhenComplete) {
    const fs::path path = folder_ / "a.pages";
    const int probe = open(folder_.path.c_str(), O_TMPFILE | O_WRONLY, 0600);  // some file systems have no such files
    if (probe >= 0) close(probe);
    for (const char* text : {"first", "second"}) {
        const std::size_t before = entries();
        write_unnamed(path, [&](const fs::path& temporary) {
            CheckedFile file(temporary, path.string());
            file.write(text, std::string_view(text).size());
            file.close();
            EXPECT_EQ(entries(), before + (probe >= 0 ? 0 : 1)) << "the temporary has no name";
        });
        EXPECT_EQ(read_file(path, 100), text);
        EXPECT_EQ(entries(), 1u);
    }
    EXPECT_EQ(fs::status(path).permissions() & fs::perms::owner_all, fs::perms::owner_read | fs::perms::owner_write);
    fs::permissions(path, fs::perms::owner_all);
    fs::create_symlink("a.pages", folder_ / "link");
    write_unnamed(folder_ / "link", [](const fs::path& temporary) { std::ofstream(temporary) << "third"; });
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(read_file(path, 100), "third");
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all) << "a replaced file keeps its permissions";
    const auto fail = [](const fs::path&) { throw std::runtime_error("no more"); };
    EXPECT_THROW(write_unnamed(path, fail), std::runtime_error);
    EXPECT_EQ(read_file(path, 100), "third");
    EXPECT_EQ(entries(), 2u);
    EXPECT_THROW(write_unnamed(folder_ / "no/a", fail), Error);
}

TEST_F(Files, ScratchFilesHaveNoName) {
    ScratchFile file(folder_.path, "out");
    file.append(std::string(1000, 'a'));
    file.append(std::string(1000, 'b'));
    EXPECT_EQ(file.size(), 2000u);
    EXPECT_EQ(entries(), 0u);
    std::string bytes(4, ' ');
    file.read(998, bytes);
    EXPECT_EQ(bytes, "aabb");
    EXPECT_THROW(ScratchFile(folder_ / "no", "out"), Error);
}

TEST_F(Files, ContentsAreComparedByHashWhereTheTimeDiffers) {
    const fs::path path = folder_ / "a";
    const std::string whole(std::size_t{9} << 20, 'a');  // several pieces
    std::string changed = whole;
    changed[whole.size() / 2] = 'b';
    write_file(path, whole);
    const fs::file_time_type time = fs::last_write_time(path), later = time + std::chrono::hours(1);
    const FileContent content = content_of(path);
    EXPECT_EQ(content.bytes, whole.size());
    const auto has = [&](const std::string& bytes, fs::file_time_type at) {
        write_file(path, bytes);
        fs::last_write_time(path, at);
        return has_content(path, content);
    };
    EXPECT_TRUE(has(whole, time) && has(whole, later));
    EXPECT_FALSE(has(changed, later));
    EXPECT_FALSE(has(whole.substr(1), time));
    EXPECT_THROW(content_of(folder_ / "no"), Error);
}

}  // namespace
}  // namespace halflight
