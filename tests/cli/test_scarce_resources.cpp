// Tests the program where the system has little to give: a full disk of the driver's cache, or limits of address space,
// stack and threads. Other tests give it files that are pipes, devices or links.
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <regex>

#include "tests/cli/command_test.h"
#include "tests/cli/virtual_display.h"

namespace halflight::test {
namespace {

const std::string kScene = HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb";

Strings picture(const std::string& name, const Strings& more = {}) {
    return words("render", kScene, name, "--width 8 --height 8 --samples 1", more);
}

/// Returns a command that runs a program with a file system of `size` bytes at `folder`, which it alone sees.
Strings with_small_disk(const std::string& folder, const std::string& size) {
    const std::string mount = "mount -t tmpfs -o size=" + size + " none \"$0\" && exec \"$@\"";
    return {"unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, folder};
}

using ScarceResources = CommandTest;
using AwkwardFiles = CommandTest;

/// Mesa's shader cache and ours lie on a disk that is full from the start, or fills while shaders are stored.
TEST_F(ScarceResources, AFullCacheDiskChangesNoPicture) {
    const std::string cache = folder / "cache";
    std::filesystem::create_directory(cache);
    const auto probe = with_small_disk(cache, "64k");
    if (run(words(probe, "true")).status != 0) GTEST_SKIP() << "no file system can be mounted here";
    const RunOptions large{.environment = {"XDG_CACHE_HOME=" + cache, "MESA_SHADER_CACHE_DIR"}};
    const Outcome whole = run_program(picture(folder / "whole.exr", {"--reproducible"}), large);
    ASSERT_EQ(whole.status, 0) << whole.err;
    for (const std::string size : {"4k", "1400k"}) {
        for (const bool ours : {true, false}) {
            RunOptions small = large;
            small.wrapper = with_small_disk(cache, size);
            Strings arguments = picture(folder / "small.exr", {"--reproducible", "--quiet"});
            if (!ours) arguments.push_back("--no-shader-cache");
            const Outcome outcome = run_program(arguments, small);
            EXPECT_EQ(outcome.status, 0) << size << ": " << outcome.err;
            EXPECT_EQ(outcome.err, "") << size;
            EXPECT_TRUE(read_text(folder / "small.exr") == read_text(folder / "whole.exr")) << size;
        }
    }
}

TEST_F(ScarceResources, ALimitOfTheAddressSpaceIsNamed) {
#ifdef HALFLIGHT_SANITIZED
    GTEST_SKIP() << "address sanitizers reserve terabytes of address space";
#endif
    for (const int mib : {256, 400, 560}) {
        const std::string bytes = std::to_string(std::int64_t{mib} << 20);
        refused(1, picture(file("a.exr")), "limited to " + std::to_string(mib) + " MiB (ulimit -v)",
                {.wrapper = {"prlimit", "--as=" + bytes}});
    }
    const Strings large_stack{"prlimit", "--stack=4000000000"};
    if (run_program({"--version"}, {.wrapper = large_stack}).status != 0) return;  // the system forbids such stacks
    // Threads would get stacks of 4 GB, and the driver would wait for them.
    done(picture(file("a.exr")), {.wrapper = {"prlimit", "--as=8000000000", "--stack=4000000000"}});
}

/// Runs the program with limits of threads. They count all processes of a user, so tests take a user without any.
class FewThreads : public CommandTest {
  protected:
    void SetUp() override {
        if (run_program({"--version"}, {.wrapper = as_user}).status != 0) GTEST_SKIP() << "needs another user's rights";
        std::filesystem::copy_file(kScene, scene);
        std::filesystem::permissions(folder / "", std::filesystem::perms::all);
        // Mesa starts up to three more writers of its cache while shaders are new.
        ASSERT_EQ(render(kMany).status, 0);
    }
    /// Lets the program start at most `most` threads besides the main one.
    Outcome run_with(int most, const Strings& arguments) const {
        RunOptions few{.environment = environment, .wrapper = wrapper, .most_seconds = 300};
        for (const std::string& word : {std::string("prlimit"), "--nproc=" + std::to_string(most + 1)})
            few.wrapper.push_back(word);
        // setpriv comes last, because it can start a program in a folder that only root may enter.
        few.wrapper.insert(few.wrapper.end(), as_user.begin(), as_user.end());
#ifdef HALFLIGHT_VIEW  // which the program cannot start as that user
        if (arguments[0] == "view") return run(words(HALFLIGHT_VIEW, arguments), few);
#endif
        return run_program(arguments, few);
    }
    Outcome render(int most, const Strings& more = {}) const {
        Strings arguments = words(picture(file("a.exr"), more), "--device software");
        arguments[1] = scene;
        return run_with(most, arguments);
    }
    /// Returns the threads that drivers need, besides the main one, as the message names them; 0 if it does not.
    static int needed(const Outcome& outcome) {
        std::smatch found;
        const std::regex text("only \\d+ of the (\\d+) threads that drivers need can be started");
        return std::regex_search(outcome.err, found, text) ? std::stoi(found[1]) : 0;
    }

    static constexpr int kMany = 1000;  // threads, more than any test needs
    const std::string scene = folder / "scene.glb";
    const std::string user = std::to_string(100'000 + getpid());
    const Strings as_user{"setpriv", "--reuid=" + user, "--regid=" + user, "--clear-groups"};
    Strings wrapper{};
    Strings environment{"HALFLIGHT_SHADER_SOURCES",  // a folder that the user may not write to
                        "MESA_SHADER_CACHE_DIR", "LP_NUM_THREADS", "XDG_CACHE_HOME=" + (folder / "cache").string()};
};

TEST_F(FewThreads, AreNamedByRender) {
    const int all = needed(render(2));
    EXPECT_GT(all, 2);
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
    const Outcome refused = render(all - 1);
    EXPECT_EQ(refused.status, 1);
    EXPECT_EQ(needed(refused), all) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
    const Outcome enough = render(all);
    EXPECT_EQ(enough.status, 0) << enough.err;
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
}

/// TBB has no worker then, and each of the driver's two pools has one thread at most.
TEST_F(FewThreads, SufficeForOneThreadOrProcessor) {
    constexpr int kOne = 6;
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
    EXPECT_EQ(needed(render(kOne - 1, {"--threads", "1"})), kOne);
    const Outcome one_thread = render(kOne, {"--threads", "1"});
    EXPECT_EQ(one_thread.status, 0) << one_thread.err;
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
    wrapper = {"taskset", "--cpu-list", std::to_string(sched_getcpu())};
    EXPECT_EQ(needed(render(kOne - 1)), kOne);
    const Outcome one_processor = render(kOne);
    EXPECT_EQ(one_processor.status, 0) << one_processor.err;
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
}

/// The viewer has two displays, one for the window and one for the thread that renders.
TEST_F(FewThreads, AreNamedByTheViewer) {
    if (run_program({"view", "--help"}).status != 0) GTEST_SKIP() << "the viewer was not built";
    const VirtualDisplay display;
    if (display.name().empty()) GTEST_SKIP() << display.why_not();
    environment.insert(environment.end(), {"DISPLAY=" + display.name(), "LIBGL_ALWAYS_SOFTWARE=1"});
    write_text(folder / "script.txt", "wait samples 2\nscreenshot " + (folder / "a.exr").string() + "\n");
    const Strings view = {"view", scene,      "--size",   "16x16",    "--threads",
                          "1",    "--device", "software", "--script", folder / "script.txt"};
    constexpr int kOne = 12;
    EXPECT_EQ(run_with(kMany, view).status, 0);
    EXPECT_TRUE(std::filesystem::remove(folder / "a.exr"));
    EXPECT_EQ(needed(run_with(kOne - 1, view)), kOne);
    const Outcome enough = run_with(kOne, view);
    EXPECT_EQ(enough.status, 0) << enough.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "a.exr"));
}

TEST_F(ScarceResources, ALimitOfTheStackIsNamed) {
    const auto stack = [](int kib) {
        return RunOptions{.wrapper = {"prlimit", "--stack=" + std::to_string(kib * 1024)}};
    };
    refused(1, picture(file("a.exr")), "GPU: the stack is limited to 256 KiB (ulimit -s)", stack(256));
#ifndef HALFLIGHT_SANITIZED  // sanitizers enlarge the frames of functions
    done(picture(file("a.exr")), stack(1024));
#endif
}

TEST_F(AwkwardFiles, LogsThatCannotBeWrittenAreNamed) {
    const std::string fifo = folder / "fifo";
    ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
    for (const std::string& log : {std::string("/dev/full"), fifo}) {
        const Outcome outcome = run_program(picture(file("a.exr"), {"--log", log}), {.most_seconds = 60});
        EXPECT_EQ(outcome.status, 1) << log;
        expect_has(outcome.err, log + ": cannot write: ");
    }
}

TEST_F(AwkwardFiles, AReaderThatEndsDoesNotEndARender) {
    const std::string command = "exec 3>&2 2> >(head -c 1 >&3); exec \"$@\"";
    done(picture(file("a.#.exr"), words("--frames 1-3 --progress json")), {.wrapper = {"bash", "-c", command, "sh"}});
    EXPECT_TRUE(std::filesystem::exists(folder / "a.3.exr"));
}

/// A user may place checkpoints on another disk by a link.
TEST_F(AwkwardFiles, LinksToFoldersOfCheckpointsStay) {
    std::filesystem::create_directories(folder / "scratch");
    std::filesystem::create_directories(folder / "a.exr.parts");
    std::filesystem::create_directory_symlink("../scratch", folder / "a.exr.parts/1-of-2");
    const Strings whole = words(kScene, file("a.exr"), "--width 8 --height 8 --samples 2");
    for (const char* part : {"1/2", "2/2"}) done(words("render", whole, "--part", part));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "a.exr.parts/1-of-2"));
    done(words("merge", whole, "--sample-parts 2"));
}

TEST_F(AwkwardFiles, FilesOfTheSceneAreNotOverwritten) {
    const std::string image = file("wood.png"), gltf = file("s.gltf");
    done(picture(image));
    const std::string before = read_text(image);
    write_text(gltf,
               R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "wood.png"}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]},
                      {"componentType": 5126, "count": 3, "type": "VEC2"}]})");
    refused(2, words("render", gltf, image, "--width 8 --height 8 --samples 1 --quiet"),
            "wood.png: is both input and output");
    // Logs, statistics and reports are texts, and no page file replaces a texture.
    const Strings texts[] = {words("render", gltf, file("new.exr"), "--samples 1 --log", image),
                             words("render", kScene, file("new.exr"), "--samples 1 --stats", image),
                             words("render", kScene, file("new.exr"), "--samples 1 --dump-graph", image),
                             words("render", kScene, file("new.#.exr"), "--samples 1 --frames 1 --stats", image),
                             words("converge", kScene, "-o", file("report"), "--log", image),
                             words("pack", gltf, file("s.pages"), "--log", image),
                             words("bench --scene", gltf, "--json", image)};
    for (const Strings& arguments : texts) refused(1, arguments, image + ": exists and is a PNG picture");
    for (const std::string& name : {image, gltf}) {
        const std::string bytes = read_text(name);
        refused(1, {"pack", kScene, name}, name + ": exists and is no page file");
        EXPECT_TRUE(read_text(name) == bytes);
    }
    EXPECT_TRUE(read_text(image) == before);
    std::filesystem::copy(image, file("still.camera.exr"));
    refused(2, picture(file("still.exr"), words("--camera all --env", file("still.camera.exr"))), "still.camera.exr");
}

}  // namespace
}  // namespace halflight::test
