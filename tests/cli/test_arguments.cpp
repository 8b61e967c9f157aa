// Tests refusals of the program. Those of the parser are tables, which run in this process. The others run as a user
// meets them: exit status, one line that names the file or option, and no files left behind.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <regex>

#include "tests/cli/command_test.h"
#include "tools/halflight/arguments.h"

namespace halflight::test {
namespace {

/// Returns the error with which the parser refuses a command line; empty if it accepts it.
std::string usage_error(const Strings& arguments) {
    std::vector<const char*> argv = {"halflight"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    argv.push_back(nullptr);
    try {
        parse_arguments(static_cast<int>(argv.size()) - 1, argv.data());
    } catch (const UsageError& error) {
        return error.what();
    }
    return "";
}

/// Expects that the parser refuses a command line, and that the error is about `element`.
void expect_usage_error(const Strings& arguments, const std::string& element) {
    const std::string error = usage_error(arguments);
    EXPECT_TRUE(error.starts_with(element + ": ")) << testing::PrintToString(arguments) << "\n" << error;
}

TEST(UsageErrors, NameTheFirstOption) {
    struct Rows {
        const char* command;  // is valid without the options below
        const char* options;  // cases, separated by bars; the first word of each is refused
    };
    const Rows tables[] = {
        {"", "frobnicate | --frobnicate"},
        {"info", "--needs | --names | --check"},
        {"info --device", "--env 1,1,1 | --png | --variant red | --needs"},
        {"info a.glb", R"(a.glb | --width 0 | --up 0,1,0 | --time | --shutter 101 | --env white --sky 45,0 |
                          --look-from 0,1,0 --look-at 0,1.0,0)"},
        {"view a.glb", "--look-from 0,1,0 --look-at 0,1.0,0 | --env white --sky 45,0 | --size 640 | --frame 1"},
        {"merge a.glb o.exr", "--sample-parts 1 | --checkpoint 1 --sample-parts 2"},
        {"merge a.glb o.#.exr", "--frames 1 --sample-parts 2"},
        {"pack a.glb o.pages", "--json"},
        {"pack a.glb", "a.glb"},
        {"bench --scene a.glb", R"(--clock sun | --nodes x | --variants off,none --frames | --turns many | --turns 0 |
                                   --size wide | --size 4294967297x9)"},
        {"compare a.exr b.exr", "--metric psnr | --fail -1 | --ppd nan | --map map.jpg"},
        {"converge a.glb -o out",
         R"(--method plain,fast | --method plain,plain | --estimator lights=sun | --clock sun | --external blender |
            --estimator lights=tree --estimator lights=tree | --preview temporal,filter | --warm-up 8 | --seeds 0 |
            --warm-up 8 --preview filter | --samples 1,4,4 | --samples 1,,4 | --samples 1 --seconds 1)"},
        {"render a.glb", "o.bmp | exr | x.jpeg2000"},
        {"render a.glb o.exr",
         R"(o.exr | ./o.exr | --frobnicate | --widht=16 | -f 4 | --size 16x16 | --exposure 1 | --width 0 | --seed -1 |
            --samples | --samples 1 --samples 2 | --error 1 --samples 15 | --error 0 | --error-metric mse |
            --error-metric psnr --error 1 | --best-effort | --adaptive --samples 15 |
            --denoise-error 8 --denoise --adaptive | --denoise --samples 1 | --denoise --preview cache |
            --denoise-frames 1 | --aov noisy,denoiser | --aov none,albedo | --aov albedo,smell | --bounces -1 |
            --filter sinc | --look-from 0,0,1 | --look-from 0,0 --look-at 0,0,0 | --look-from 0,0,nan --look-at 0,0,0 |
            --up 0,1,0 | --up 0,1,0 --look-from 0,5,0 --look-at 0,0,0 | --camera 0 --look-from 0,0,1 --look-at 0,0,0 |
            --env-intensity -1 | --env-rotation left | --env white --sky 45,0 | --light sun |
            --material floor.rough=0.2 | --culling nonsense | --culling off --culling raster | --primary trace |
            --estimator light=tree | --estimator lights=bush | --estimator lights=tree --estimator lights=tree |
            --preview fog | --preview temporal | --error 0.1 --preview cache | --quiet --verbose | --log-level debug |
            --progress xml | --threads 0 | --threads 1025 | --threads all | --threads 1.5 | --texture-pool much |
            --projection cylinder | --fisheye-fov 361 | --fisheye-fov 90 --projection panorama | --stereo both |
            --eye-distance 1 | --convergence 1 | --width 33 --stereo side-by-side | --height 33 --stereo over-under |
            --aperture -1 --focus 2 | --crop 5,5,5,9 | --crop 5,5,9 |
            --crop 5,5,9,9 --denoise --denoise-frames 1 | --aov-names mitsuba | --jpeg-quality 5 | --tiff-type 8 |
            --exr-compression dwa | --exr-compression pxr24 --aov depth | --exr-compression dwaa --aov depth |
            --exr-compression dwab --aov depth | --part 1/2 --stats s.json |
            --sample-parts 3 --samples 2 | --overwrite | --fps 24 | --shutter 0.5 | --shutter 101 |
            --checkpoint 1 --denoise-frames 1 --denoise | --movie m.mp4)"},
        {"render a.glb o.exr --animation all",
         R"(--shutter-times 4 | --shutter-ramp 1 | --shutter-ramp 2 --shutter 1 | --shutter-position left --shutter 1 |
            --shutter-times 5 --shutter 0.5 --samples 4)"},
        {"render --demo o.png", "a.glb | a.glb b.png"},
        {"render a.glb o.png", "--aov albedo | --jpeg-quality 5"},
        {"render a.glb o.jpg", "--jpeg-quality 0"},
        {"render a.glb o.tif", "--tiff-type 12 | --working-space acescg | --exposure 1 --tiff-type float"},
        {"render a.glb --transparent", "o.jpg"},
        {"render a.glb --turntable 4", "o.exr"},
        {"render a.glb f.#.exr", R"(--turntable 0 | --frame 1 --turntable 4 | --frames 2-1 |
                                    --frame 1 --frames 1-2)"},
        {"render a.glb --frame 3", "f.%04d.exr"},
        {"render a.glb --frames 1-2", R"(f.exr | f.png g.#.exr | f.#.%d.exr | --aov depth --movie m.mp4 |
                                         --movie m.mp4 --part 1/2 | --movie m.mp4 --check)"},
        {"render a.glb --frames 1-2 --movie m.mp4", "--checkpoint 1"},
        {"render a.glb f.#.exr --frames 1-2",
         "--part 4/3 | --overwrite --check | --preview temporal --part 1/2 | --preview cache --shutter 0.5"},
    };
    for (const auto& [command, options] : tables) {
        std::istringstream cases(options);
        for (std::string one; std::getline(cases, one, '|');) {
            const Strings more = words(one.c_str());
            expect_usage_error(words(command, more), more[0]);
        }
    }
}

TEST(UsageErrors, NameOptionsOfValuesOutOfRange) {
    struct Values {
        const char* option;
        Strings values;
        Strings more = {};
    };
    const Values tables[] = {
        {"--samples", {"0", "-1", "1.5", "many", "", "1e3", "99999999999999999999"}},
        {"--time", {"-1", "nan", "inf", "soon"}},
        {"--filter-radius", {"0", "-1", "17", "nan"}},
        {"--clamp", {"1e-50", "-1", "inf", "much"}},
        {"--line-width", {"0", "-1", "nan", "1e10", "thick"}},
        {"--focus", {"0", "-1", "nan", "1.2,0.5", "0.5,0.5,0.5", "near", ""}, {"--fstop", "2"}},
        {"--blades", {"1", "2", "-3", "2.5"}, {"--fstop", "2", "--focus", "2"}},
        {"--env", {"1,2", "0.5", "1, 2, 3", "Studio", "#12345", "1,-1,1"}},
        {"--sky", {"91,0", "45"}},
        {"--keep", {"clearcoat,smell", "light tree", "clearcaot"}},
        {"--variant", {""}},
        {"--output", {""}},
        {"--fps", {"0", "-1", "nan", "24/0", "1e3", "24/1.5", "2000000"}, {"--frames", "1"}},
    };
    for (const auto& [option, values, more] : tables)
        for (const std::string& value : values)
            expect_usage_error(words("render a.glb o.exr", more, Strings{option, value}), option);
    for (const char* command : {"info", "render", "view"}) expect_usage_error({command, ""}, "SCENE");
    expect_usage_error({"render", "a.glb", ""}, "OUTPUT");
}

TEST(UsageErrors, NameWhatIsMissingOrMeant) {
    const std::tuple<const char*, const char*, const char*> rows[] = {
        {"", "command", "render, merge, denoise, view"},
        {"rendr", "rendr", "did you mean 'render'"},
        {"render", "SCENE", "halflight render --help"},
        {"render a.glb", "OUTPUT", "halflight render --help"},
        {"render a.glb --frames 1-9", "OUTPUT", ""},
        {"merge a.glb", "OUTPUT", "halflight merge --help"},
        {"merge a.glb o.exr", "--sample-parts", "--part I/N"},
        {"info", "SCENE", ""},
        {"pack", "SCENE", ""},
        {"pack a.glb", "OUTPUT", ""},
        {"compare a.exr", "REFERENCE", ""},
        {"converge a.glb", "--output", ""},
        {"info -- a.glb --needs", "--needs", "is not expected"},
        {"render a.glb o.exr --sampels 4", "--sampels", "did you mean '--samples'"},
        {"render a.glb o.exr --env Studio", "--env", "did you mean 'studio'"},
        {"render a.glb o.exr --aov depht", "--aov", "did you mean 'depth'"},
        {"render a.glb o.exr --spp 0", "--samples", ""},
        {"render a.glb o.exr -s 0", "--samples", ""},
        {"render a.glb o.exr --spp 1 -s 2", "--samples", "once"},
        {"render a.glb f.##.exr", "f.##.exr", "--frames"},
        {"render a.glb f.#.exr f.%d.exr --frames 1-2", "f.1.exr", "twice"},
        {"render a.glb o.exr --stats o.exr", "o.exr", "twice"},
        {"render a.glb o.exr --log o.exr", "o.exr", "twice"},
        {"render a.glb o.exr --stats s --dump-graph s", "s", "twice"},
        {"render a.glb o.exr --stats a.glb", "a.glb", "both"},
        {"render a.glb sky.exr --env sky.exr", "sky.exr", "both"},
        {"render a.glb s.exr --settings s.exr", "s.exr", "both"},
        {"render a.glb --frames 1 --movie m.avi", "m.avi", ""},
        {"render a.glb --frames 1 --movie m.#.mp4", "m.#.mp4", ""},
    };
    for (const auto& [command, element, told] : rows) {
        expect_usage_error(words(command), element);
        expect_has(usage_error(words(command)), told);
    }
    std::string folders;
    for (int i = 0; i < 5; ++i) folders += std::string(200, 'x') + '/';  // more than a message holds
    expect_has(usage_error(words("render a.glb --transparent", folders + "a.jpg")), "a.jpg: ");
}

class Refusal : public CommandTest {
  protected:
    /// Calls refused() for a render of the room to out.exr; the render is short in case it is not refused.
    void render_refused(int status, const Strings& more, const std::string& element,
                        const RunOptions& options = {}) const {
        refused(status, with_defaults(words("render", scene, file("out.exr"), more), "--width 8 --height 8"), element,
                options);
    }
    std::string scene = copy_room(folder.path);
};

TEST_F(Refusal, UsageErrorsHaveTheirStatus) {
    refused(2, {}, "command: is missing");
    render_refused(2, words("--samples 0"), "--samples: ");
    render_refused(2, {"--log", scene}, "room.gltf: is both input and output");
    refused(4, words("compare a.exr"), "REFERENCE: is missing");  // 1 and 2 are verdicts of compare
}

/// The scene, its camera and the settings together decide these.
TEST_F(Refusal, SettingsThatDoNotFitTogether) {
    const std::tuple<int, const char*, const char*> rows[] = {
        {2, "--fstop 2", "--fstop: needs --focus"},
        {2, "--light-group =lamp", "--light-group: '' cannot name a light group"},
        {2, "--light-group rest=lamp", "--light-group: 'rest' is the group of all lights"},
        {2, "--light-group a.R=lamp", "--light-group: 'a.R' cannot name a light group"},
        {2, "--light-group a=light:", "--light-group: expects NAME=LIGHT"},
        {2, "--light-link light", "--light-link: expects LIGHT=OBJECT"},
        {2, "--shadow-link light=-", "--shadow-link: expects LIGHT=OBJECT"},
        {2, "--hide node:", "--hide: expects the name"},
        {2, "--shadow-catcher mesh:", "--shadow-catcher: expects the name"},
        {1, "--working-space acescc", "did you mean 'ACEScg'"},
        {1, "--focus 2", "focus: "},
        {1, "--aperture 5", "aperture: "},
        {2, "--fstop 2 --focus 2 --primary raster --quiet", "--primary: "},
        {2, "--projection panorama --primary raster --quiet", "--primary: "},
        {2, "--projection fisheye --fstop 2 --focus 2 --quiet", "--focus: "},
        {1, "--stereo left --convergence 0.01 --quiet", "render settings: the eyes"},
        {1, "--camera rear", "no camera 'rear'"},
        {1, "--camera 2", "no camera '2'"},
        {1, "--camera frnt", "did you mean 'front'"},
        {1, "--variant red", "room.gltf: has no material variants"},
        {1, "--line-width 1 --pages none.pages", "room.gltf: pages hold no points and lines"},
        {1, "--working-space sideways", "--working-space: "},
        {1, "--stats /dev/stdout", "/dev/stdout: cannot write"},
        {1, "--ocio none.ocio", "none.ocio"},
        {1, "--device abacus", "abacus"},
    };
    for (const auto& [status, options, element] : rows) render_refused(status, words(options), element);
    for (const char* option : {"--view", "--display", "--look"})
        refused(1, words("render", scene, file("out.png"), option, "Rosy"), "Rosy");
    refused(1, words("info", scene, "--variant red"), "room.gltf: has no material variants");
    refused(1, words("info", scene, "--camera nobody"), "no camera 'nobody'");
    refused(1, words("converge", scene, "-o", file("report"), "--fstop 2 --focus 0.5,0.5"), "focus: ");
    const Strings tall = words("render", scene, "--width 8 --height 65504 --quiet");
    refused(1, words(tall, file("tall.jpg")), "tall.jpg: ");
    refused(1, words(tall, file("tall.#.jpg"), "--frames 1-2"), "tall.#.jpg: ");
}

TEST_F(Refusal, StrictCommandsNeedEveryImage) {
    write_text(file("missing.gltf"), R"({"asset": {"version": "2.0"}, "images": [{"uri": "a.webp"}],
        "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}],
        "materials": [{"normalTexture": {"index": 0}}]})");
    const std::string gltf = file("missing.gltf");
    refused(1, words("render", gltf, file("out.exr"), "--samples 1 --strict"), "missing.gltf: images[0] (a.webp): ");
    refused(1, words("info", gltf, "--strict"), "missing.gltf: images[0] (a.webp): ");
    expect_has(done({"info", gltf}).out, "textures do without it");
}

TEST_F(Refusal, StrictCommandsRefuseHarmlessFaults) {
    const std::string gltf = file("faulty.gltf");
    write_text(gltf, R"({"asset": {"version": "2.0"}, "nodes": [{}], "materials": [{"name": null}]})");
    for (const Strings& command :
         {words("render", gltf, file("out.exr")), words("info", gltf), words("pack", gltf, file("out.pages")),
          words("converge", gltf, "-o", file("report"))})
        refused(1, words(command, "--strict"), "faulty.gltf: materials[0].name: is null");
    const Outcome bench = run_program(words("bench --scene", gltf, "--strict"));  // names the device first
    EXPECT_EQ(bench.status, 1);
    expect_has(bench.err, "faulty.gltf: materials[0].name: is null");
    expect_has(done({"info", gltf}).out, "materials[0].name: is null, it is ignored");
}

TEST_F(Refusal, PicturesWiderThanTheDriverAllows) {
    if (test_device() != "software") GTEST_SKIP() << "the limits are those of llvmpipe";
    const auto expect_wide = [&](const char* width, const Strings& more) {
        render_refused(1, words("--width", width, "--height 16 --samples 2 --quiet", more), "render settings: ");
    };
    expect_wide("16384", words("--projection panorama --denoise"));  // the denoiser adds margins to the width
    expect_wide("16400", {"--denoise"});
    Strings groups = {"--env", "white"};
    for (int i = 0; i < 31; ++i) groups.insert(groups.end(), {"--light-group", fmt::format("g{}=environment", i)});
    expect_wide("16384", groups);
}

TEST_F(Refusal, FilesThatCannotBeReadOrWritten) {
    write_text(file("empty.glb"), "");
    write_text(file("file"), "");
    write_text(file("cut.gltf"), read_text(scene).substr(0, 300));
    write_text(file("bad.ocio"), "ocio_profile_version: 2\nroles: [\n");
    std::filesystem::create_directory(file("dir.exr"));
    std::filesystem::create_directory(file("sub"));
    std::string outside = read_text(scene);
    write_text(file("sub/outside.gltf"), outside.replace(outside.find("room.bin"), 8, "../room.bin"));
    refused(1, {"info", file("none.glb")}, "none.glb: cannot read");
    refused(1, {"info", file("none\n.glb")}, ".glb: cannot read");
    refused(1, words("info -- -none.glb"), "-none.glb: cannot read");
    refused(1, {"info", folder.path}, folder.path.string() + ": cannot read");
    refused(1, {"info", file("empty.glb")}, "empty.glb: ");
    refused(1, {"info", file("cut.gltf")}, "cut.gltf: ");
    refused(1, {"info", file("sub/outside.gltf")}, "outside.gltf: buffers[0]");
    done({"info", file("sub/outside.gltf"), "--allow-outside"});
    refused(1, words("info", scene, "--needs --env", file("no.hdr")), "no.hdr: ");
    refused(1, words("info", scene), "standard output: cannot write", {.stdout_path = "/dev/full"});
    render_refused(1, {"--env", file("none.exr")}, "none.exr: cannot read");
    render_refused(1, {"--ocio", file("bad.ocio")}, "bad.ocio");
    render_refused(1, {}, "none.ocio", {.environment = {"OCIO=" + file("none.ocio")}});
    render_refused(1, {"--log", folder.path}, "cannot write");
    render_refused(1, {"--log", std::string(300, 'a')}, "aaa: cannot write");
    render_refused(1, {"--stats", file("file/stats.json")}, "stats.json: cannot write");
    render_refused(1, {"--dump-graph", file("file/graph.dot")}, "graph.dot: cannot write");
    refused(1, {"render", scene, file("dir.exr")}, "dir.exr: cannot write");
    refused(1, {"render", scene, file("file/out.exr")}, "out.exr: cannot write");
    for (const char* date : {"", "junk", "12x", "-1", "99999999999999999999"})
        render_refused(1, {"--quiet"},
                       "SOURCE_DATE_EPOCH: ", {.environment = {fmt::format("SOURCE_DATE_EPOCH={}", date)}});
}

TEST_F(Refusal, LinksToInputsAreNotOverwritten) {
    const std::string link = file("link.png"), before = read_text(scene);
    std::filesystem::create_symlink(scene, link);
    std::filesystem::create_symlink(scene, file("f.2.exr"));
    refused(2, {"render", scene, link}, "link.png: is both input and output");
    refused(2, words("render", scene, file("f.#.exr"), "--frames 1-2"), "f.2.exr: is both input and output");
    EXPECT_EQ(read_text(scene), before);
}

TEST_F(Refusal, UnwritableFolder) {
    // Root may write everywhere except in /sys.
    std::filesystem::path unwritable = "/sys";
    if (geteuid() != 0) {
        unwritable = folder / "locked";
        std::filesystem::create_directory(unwritable);
        std::filesystem::permissions(unwritable, std::filesystem::perms::owner_read);
    } else if (!std::filesystem::exists("/sys/kernel")) {
        GTEST_SKIP() << "needs /sys, where root cannot write either";
    }
    refused(1, {"render", scene, unwritable / "out.exr"}, "out.exr: cannot write");
}

TEST_F(Refusal, NoDevice) {
    render_refused(1, words("--device counting"), "no OpenGL 4.5 context for device 'counting'");
    render_refused(1, {}, "GPU: ", {.environment = {"__EGL_VENDOR_LIBRARY_DIRS=" + folder.path.string()}});
}

/// All layers of 64 x 64 noisy pixels need more than this number of bytes, compressed or not.
constexpr int kTooFewBytes = 8192;
const char* const kNoisy = "--width 64 --height 64 --samples 1 --aov all --quiet";

TEST_F(Refusal, LimitOfFileSize) {
    // The driver's shader cache and the kept sources of shaders must not reach the limit.
    render_refused(1, words(kNoisy), "out.exr: ",
                   {.environment = {"MESA_SHADER_CACHE_DISABLE=true", "HALFLIGHT_SHADER_SOURCES"},
                    .wrapper = {"prlimit", "--fsize=" + std::to_string(kTooFewBytes)}});
}

/// A disk of few bytes at a folder, as long as the object exists. Root alone may mount one.
class SmallDisk {
  public:
    SmallDisk(std::string path, int bytes) : path_(std::move(path)) {
        std::filesystem::create_directory(path_);
        const std::string size = "size=" + std::to_string(bytes);
        mounted_ = mount("tmpfs", path_.c_str(), "tmpfs", 0, size.c_str()) == 0;
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    ~SmallDisk() {
        if (mounted_) umount(path_.c_str());
    }
    bool mounted() const { return mounted_; }

  private:
    std::string path_;
    bool mounted_ = false;
};

TEST_F(Refusal, DiskIsFull) {
    const SmallDisk disk(file("disk"), kTooFewBytes);
    if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a small disk";
    refused(1, words("render", scene, file("disk/out.exr"), kNoisy), "No space left on device");
    EXPECT_TRUE(std::filesystem::is_empty(file("disk"))) << "something was left on the full disk";
}

TEST_F(Refusal, PicturesAreNamedWhereStatisticsFail) {
    const SmallDisk disk(file("disk"), 4096);
    if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a small disk";
    const Outcome outcome = run_program(words("render", scene, file("out.exr"), "--width 16 --height 16 --samples 1",
                                              "--stats", file("disk/stats.json")));
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_search(outcome.err, std::regex("wrote .*out.exr: .*\nhalflight: .*stats.json: .*\n$")))
        << outcome.err;
}

TEST_F(Refusal, FullDisksHoldWholeLinesOfStatistics) {
    const SmallDisk disk(file("disk"), 16384);
    if (!disk.mounted()) GTEST_SKIP() << "needs the right to mount a small disk";
    const Outcome outcome =
        run_program(words("render", scene, file("f.#.exr"), "--frames 1-8 --width 16 --height 16 --samples 1 --quiet",
                          "--stats", file("disk/stats.jsonl")));
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    expect_has(outcome.err, "stats.jsonl: cannot write");
    const std::string lines = read_text(file("disk/stats.jsonl"));
    EXPECT_GT(lines.size(), 4096u);
    EXPECT_TRUE(lines.ends_with("}\n")) << lines.substr(lines.size() - std::min<std::size_t>(lines.size(), 80));
}

TEST_F(Refusal, ALaterSignalEndsTheProgramWhereItWaits) {
    // Nothing reads the help text, so the program waits for room in the pipe.
    const std::string pipe = file("pipe");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const int ends = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_GE(fcntl(ends, F_SETPIPE_SZ, 4096), 4096);
    const Outcome outcome = run_program(
        {"render", "--help"},
        {.wrapper = {"sh", "-c", "\"$@\" & p=$!; sleep 0.5; kill -TERM $p; sleep 0.7; kill -HUP $p; wait $p", "sh"},
         .stdout_path = pipe,
         .most_seconds = 30});
    close(ends);  // ends the program if it still waits
    EXPECT_EQ(outcome.status, 128 + SIGHUP);
}

}  // namespace
}  // namespace halflight::test
