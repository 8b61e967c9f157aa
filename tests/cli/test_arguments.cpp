// Tests refusals of the program: exit status, one clear line, and no files left behind.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <regex>

#include "tests/support/process.h"

namespace halflight::test {
namespace {

class Refusal : public testing::Test {
  protected:
    /// Runs `render`; expects the status and "halflight: " with `message` (a regular expression) as the only line.
    void expect(const std::vector<std::string>& arguments, int status, const std::string& message,
                const RunOptions& options = {}) {
        const auto before = folder.entries();
        const Outcome outcome = run_program(arguments, options);
        std::string command;
        for (const std::string& argument : arguments) command += " " + argument;
        EXPECT_EQ(outcome.status, status) << command << "\n" << outcome.err;
        EXPECT_EQ(outcome.out, "") << command;
        EXPECT_TRUE(std::regex_match(outcome.err, std::regex("halflight: " + message + "\n"))) << command << "\n"
                                                                                               << outcome.err;
        EXPECT_EQ(folder.entries(), before) << command << " left something behind";
    }
    /// Calls expect() for a render of the room to out.exr; the render is short in case it is not refused.
    void expect_render(std::vector<std::string> more, int status, const std::string& message,
                       const RunOptions& options = {}) {
        std::vector<std::string> arguments = {"render", scene, folder / "out.exr", "--width", "8", "--height", "8"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        expect(arguments, status, message, options);
    }

    TemporaryFolder folder;
    std::string scene = copy_room(folder.path);
};

TEST_F(Refusal, InvalidCommands) {
    const std::string exr = folder / "out.exr", png = folder / "out.png";
    expect({}, 2, "command: is missing; commands are: render, merge, view, converge, info, pack, bench, compare");
    expect({"frobnicate"}, 2,
           "frobnicate: is no command; commands are: render, merge, view, converge, info, pack, bench, compare");
    expect({"--frobnicate"}, 2, "--frobnicate: is not expected; .*");
    expect({"render"}, 2, "SCENE: is missing; see halflight render --help");
    expect({"render", scene}, 2, "OUTPUT: is missing; see halflight render --help");
    expect({"info"}, 2, "SCENE: is missing.*");
    for (const char* command : {"info", "render", "view"})
        expect({command, ""}, 2, "SCENE: expects the name of a file");
    expect({"info", scene, scene}, 2, ".*: is not expected; .*");
    expect({"info", "--", "-none.glb"}, 1, "-none.glb: cannot read: No such file or directory");
    expect({"info", "--", scene, "--needs"}, 2, "--needs: is not expected; .*");
    expect({"render", scene, exr, exr}, 2, ".*out.exr: is given twice as output");
    expect({"render", scene, folder / "out.bmp"}, 2, ".*out.bmp: an output is an .exr, .png, .jpg or .tif");
    expect({"render", scene, folder / "exr"}, 2, ".*exr: an output is an .exr, .png, .jpg or .tif");
    expect({"render", scene, png, "--aov", "albedo"}, 2, "--aov: needs an .exr output");
    expect({"render", scene, exr, "--exposure", "1"}, 2,
           "--exposure: needs an output through the view transform, such as a .png, or a movie");
}

TEST_F(Refusal, Lenses) {
    for (const char* value : {"0", "-1", "nan", "1.2,0.5", "0.5,0.5,0.5", "near", ""})
        expect_render({"--fstop", "2", "--focus", value}, 2, "--focus: expects auto, none, infinity, a distance .*");
    for (const char* value : {"1", "2", "-3", "2.5"})
        expect_render({"--fstop", "2", "--focus", "2", "--blades", value}, 2, "--blades: expects 0 or a whole .*");
    expect_render({"--focus", "2", "--aperture", "-1"}, 2, "--aperture: expects 0 or a number .*");
    expect_render({"--fstop", "2"}, 2,
                  "--fstop: needs --focus, or an output through the view transform such as a .png or a movie");
    expect_render({"--focus", "2"}, 1, "focus: needs an f-number \\(--fstop\\) or an aperture \\(--aperture\\)");
    expect_render({"--aperture", "5"}, 1, "aperture: blurs nothing without a focus \\(--focus\\)");
    expect_render({"--fstop", "2", "--focus", "2", "--primary", "raster", "--quiet"}, 1,
                  ".*primary raster shows no depth .*");
    expect_render({"--projection", "cylinder"}, 2, "--projection: expects one of auto, panorama, .*");
    expect_render({"--fisheye-fov", "361"}, 2, "--fisheye-fov: expects a number from 0.01 to 360, not '361'");
    expect_render({"--stereo", "both"}, 2, "--stereo: expects one of none, left, right, .*");
    for (const char* option : {"--eye-distance", "--convergence"})
        expect_render({option, "1"}, 2, std::string(option) + ": needs --stereo");
    expect_render({"--projection", "panorama", "--fisheye-fov", "90"}, 2,
                  "--fisheye-fov: needs --projection fisheye or fisheye-equisolid");
    for (const char* odd : {"--width", "--height"})
        expect({"render", scene, folder / "out.exr", odd, "33", "--stereo",
                odd == std::string("--width") ? "side-by-side" : "over-under"},
               2, std::string(odd) + ": must be even with --stereo .*, since it is that of both eyes together");
    expect_render({"--projection", "panorama", "--primary", "raster", "--quiet"}, 1,
                  "render settings: primary raster shows no panorama, for which every ray is traced");
    expect_render({"--projection", "fisheye", "--fstop", "2", "--focus", "2"}, 1,
                  "render settings: depth of field needs a perspective or orthographic camera, not the projection "
                  "fisheye");
    expect_render({"--stereo", "left", "--convergence", "0.01"}, 1,
                  "render settings: the eyes must converge farther away than they are apart");
    expect({"converge", scene, "-o", folder / "report", "--fstop", "2", "--focus", "0.5,0.5"}, 1,
           "focus: the reference needs a distance, not a point of the picture");
}

TEST_F(Refusal, StrictCommandsNeedEveryImage) {
    const std::string gltf = folder / "missing.gltf";
    std::ofstream(gltf) << R"({"asset": {"version": "2.0"}, "images": [{"uri": "a.webp"}],
        "textures": [{"extensions": {"EXT_texture_webp": {"source": 0}}}],
        "materials": [{"normalTexture": {"index": 0}}]})";
    expect({"render", gltf, folder / "out.exr", "--samples", "1", "--strict"}, 1,
           ".*missing.gltf: images\\[0\\] \\(a.webp\\): .*a.webp.*");
    expect({"info", gltf, "--strict"}, 1, ".*missing.gltf: images\\[0\\] \\(a.webp\\): .*a.webp.*");
    const Outcome info = run_program({"info", gltf});
    EXPECT_EQ(info.status, 0) << info.err;
    EXPECT_NE(info.out.find("textures do without it"), std::string::npos) << info.out;
}

TEST_F(Refusal, OptionsOutOfRange) {
    expect_render({"--frobnicate"}, 2, "--frobnicate: is not expected; .*");
    expect_render({"--samples"}, 2, "--samples: needs a value");
    expect_render({"--samples", "1", "--samples", "2"}, 2, "--samples: can be given only once");
    for (const char* value : {"0", "-1", "1.5", "many", "", "1e3", "99999999999999999999"})
        expect_render({"--samples", value}, 2, "--samples: expects a whole number from 1 to [0-9]+, not '.*'");
    for (const char* value : {"-1", "nan", "inf", "soon"})
        expect_render({"--time", value}, 2, "--time: expects 0 or a number from .* to .*, not '.*'");
    expect_render({"--error", "0"}, 2, "--error: expects a number from .*");
    expect_render({"--error", "1", "--samples", "15"}, 2,
                  "--samples: 15 are too few to estimate an error: it takes 16");
    expect_render({"--error", "1", "--error-metric", "psnr"}, 2,
                  "--error-metric: expects one of relmse, mse, not 'psnr'");
    expect_render({"--error-metric", "mse"}, 2, "--error-metric: needs --error");
    expect_render({"--best-effort"}, 2, "--best-effort: needs --error");
    expect_render({"--adaptive", "--time", "1"}, 2, "--adaptive: cannot be given together with --time");
    expect_render({"--adaptive", "--error", "1", "--preview", "filter"}, 2,
                  "--(adaptive|error|preview): cannot be given together with --.*");
    expect_render({"--adaptive", "--samples", "15"}, 2, "--adaptive: needs at least 16 --samples");
    expect_render({"--adaptive", "--denoise", "--denoise-error", "8"}, 2,
                  "--denoise-error: needs at least 16 samples where --adaptive is given");
    expect_render({"--denoise", "--samples", "1"}, 2, "--denoise: needs at least two --samples");
    expect_render({"--aov", "noisy,denoiser"}, 2, "--aov: the layer denoiser needs --denoise");
    expect_render({"--denoise", "--preview", "cache"}, 2, "--denoise: cannot be given together with --preview");
    expect_render({"--bounces", "-1"}, 2, "--bounces: expects auto or a whole number from 0 to .*");
    expect_render({"--filter", "sinc"}, 2, "--filter: expects one of box, blackman-harris, not 'sinc'");
    for (const char* radius : {"0", "-1", "17", "nan"})
        expect_render({"--filter-radius", radius}, 2, "--filter-radius: expects a number from 0.01 to 16, not '.*'");
    for (const char* clamp : {"1e-50", "-1", "inf", "much"})
        expect_render({"--clamp", clamp}, 2, "--clamp: expects 0 or a number from .*");
    expect({"info", scene, "--time"}, 2, "--time: needs --needs");
    expect({"info", "--device", "--env", "1,1,1"}, 2, "--env: needs a SCENE");
    expect({"info", "--device", "--png"}, 2, "--png: needs a SCENE");
    expect({"info", scene, "--width", "0"}, 2, "--width: expects a whole number from 1 to .*");
    expect({"info", scene, "--camera", "nobody"}, 1, ".*no camera 'nobody'.*");
    expect({"info", scene, "--up", "0,1,0"}, 2, "--up: needs --look-from and --look-at");
    expect({"info", scene, "--shutter", "1", "--error", "1"}, 2, "--shutter: cannot be given together with --error");
    expect({"info", scene, "--needs", "--env", folder / "no.hdr"}, 1, ".*no.hdr: .*");
    expect_render({"--seed", "-1"}, 2, "--seed: expects a whole number from 0 to 4294967295, not '-1'");
    expect({"render", scene, folder / "out.exr", "--width", "0"}, 2, "--width: expects a whole number from 1 to .*");
    expect_render({"--look-from", "0,0,1"}, 2, "--look-from: needs --look-at, and --look-at needs it");
    expect_render({"--look-from", "0,0", "--look-at", "0,0,0"}, 2, "--look-from: expects X,Y,Z, not '0,0'");
    expect_render({"--look-from", "0,0,nan", "--look-at", "0,0,0"}, 2, "--look-from: expects X,Y,Z, not '0,0,nan'");
    expect_render({"--up", "0,1,0"}, 2, "--up: needs --look-from and --look-at");
    for (const char* command : {"info", "view"})
        expect({command, scene, "--look-from", "0,1,0", "--look-at", "0,1.0,0"}, 2,
               "--look-from: expects another point than --look-at");
    expect_render({"--camera", "0", "--look-from", "0,0,1", "--look-at", "0,0,0"}, 2,
                  "--camera: cannot be given together with --look-from");
    for (const char* env : {"1,2", "0.5", "1, 2, 3"})
        expect_render({"--env", env}, 2, "--env: expects the name of a file or R,G,B, not '" + std::string(env) + "'");
    expect_render(
        {"--env", "Studio"}, 2,
        "--env: expects a file, a colour, none, studio, sky, overcast, not 'Studio'; did you mean 'studio'\\?");
    expect_render({"--env", "#12345"}, 2, "--env: expects #rgb or #rrggbb, not '#12345'");
    expect_render({"--sky", "91,0"}, 2, "--sky: expects an elevation from 0 to 90, not '91,0'");
    expect_render({"--sky", "45"}, 2, "--sky: expects ELEVATION,AZIMUTH or ELEVATION,AZIMUTH,TURBIDITY, not '45'");
    for (const char* command : {"info", "view"})
        expect({command, scene, "--sky", "45,0", "--env", "white"}, 2, "--sky: cannot be given together with --env");
    expect_render({"--env-intensity", "-1"}, 2, "--env-intensity: expects a number from 0 to 1000000000, not '-1'");
    expect_render({"--env-rotation", "left"}, 2, "--env-rotation: expects a number from -1000000 to 1000000, .*");
    expect_render({"--env", "1,-1,1"}, 2, "--env: expects no negative radiance, not '1,-1,1'");
    expect_render({"--culling", "nonsense"}, 2, "--culling: expects one of auto, .*native, not 'nonsense'");
    expect_render({"--culling", "off", "--culling", "raster"}, 2, "--culling: can be given only once");
    expect_render({"--primary", "trace"}, 2, "--primary: expects one of auto, raster, traced, not 'trace'");
    expect_render({"--estimator", "light=tree"}, 2,
                  "--estimator: light=tree: 'light=tree' is no technique; there are: "
                  "auto,lights=auto.power.tree.uniform.all,sun=.*");
    expect_render({"--estimator", "lights=bush"}, 2, "--estimator: lights=bush: there is no lights=bush; .*power, .*");
    expect_render({"--estimator", "lights=tree", "--estimator", "lights=tree"}, 2,
                  "--estimator: can be given only once");
    expect_render({"--preview", "fog"}, 2, "--preview: fog: 'fog' is no preview mode; there are: .*cache.*");
    expect_render({"--preview", "cache", "--error", "0.1"}, 2, "--preview: cannot be given together with --error");
    expect_render({"--keep", "clearcoat,smell"}, 2,
                  "--keep: cannot keep 'smell'; `halflight info SCENE --needs` lists the names without a .");
    expect_render({"--keep", "light tree"}, 2, "--keep: cannot keep 'light tree'; `halflight info SCENE --needs` .*");
    expect_render({"--keep", "clearcaot"}, 2, "--keep: cannot keep 'clearcaot'; .*; did you mean 'clearcoat'\\?");
    expect_render({"--aov", "albedo,smell"}, 2, "--aov: has no layer 'smell'; known layers are: none, all, .*albedo.*");
}

TEST_F(Refusal, NamesWhatWasMeant) {
    expect_render({"--sampels", "4"}, 2, "--sampels: is not expected; did you mean '--samples'\\?; see .*");
    expect_render({"--widht=16"}, 2, "--widht=16: is not expected; did you mean '--width'\\?; see .*");
    expect_render({"-f", "4"}, 2, "-f: is not expected; the option is --frames; see .*");
    for (const char* name : {"--samples", "--spp", "-s"})
        expect_render({name, "0"}, 2, "--samples: expects a whole number from .*");
    expect_render({"--spp", "1", "-s", "2"}, 2, "--samples: can be given only once");
    expect_render({"-o", "x.jpeg2000"}, 2, "x.jpeg2000: an output is .*");
    expect_render({"-o", ""}, 2, "--output: expects the name of a file");
    expect_render({""}, 2, "OUTPUT: expects the name of a file");
    expect_render({"-o", folder / "out.exr"}, 2, ".*out.exr: is given twice as output");
    for (const char* value : {"0", "1025", "all", "1.5"})
        expect_render({"--threads", value}, 2, "--threads: expects a whole number from 1 to 1024, not '.*'");
    expect_render({"--log-level", "debug"}, 2, "--log-level: expects error, warning, note or detail, not 'debug'");
    expect_render({"--quiet", "--verbose"}, 2, "--quiet: cannot be given together with --verbose");
    expect_render({"--log", scene}, 2, ".*room.gltf: is both input and output");
    expect_render({"--log", folder / "out.exr"}, 2, ".*out.exr: is given twice as output");
    expect_render({"--log", folder.path}, 1, ".*: cannot write: Is a directory");
    expect_render({"--log", std::string(300, 'a')}, 1, "a+.*: cannot write: File name too long");
    expect_render({"--aov", "none,albedo"}, 2, "--aov: none stands alone");
    expect_render({"--stats", "/dev/stdout"}, 1, "/dev/stdout: cannot write: is a stream of a process, .*");
    for (const char* date : {"", "junk", "12x", "-1", "99999999999999999999"})
        expect_render({"--quiet"}, 1, fmt::format("SOURCE_DATE_EPOCH: expects seconds since 1970, not '{}'", date),
                      {.environment = {fmt::format("SOURCE_DATE_EPOCH={}", date)}});
    expect({"render", scene, folder / "tall.jpg", "--width", "8", "--height", "65504", "--quiet"}, 1,
           ".*tall.jpg: 8 x 65504 pixels: the sides of a JPEG end at 65500");
    expect({"render", scene, folder / "tall.#.jpg", "--frames", "1-2", "--width", "8", "--height", "65504", "--quiet"},
           1, ".*tall.#.jpg: 8 x 65504 pixels: the sides of a JPEG end at 65500");
    expect_render({"--size", "16x16"}, 2, "--size: is not expected; the options are --width and --height; see .*");
    expect_render({"--aov", "depht"}, 2, "--aov: has no layer 'depht'; .*; did you mean 'depth'\\?");
    expect_render({"--camera", "frnt"}, 1,
                  ".*: no camera 'frnt': its cameras: 0 'front', 1 'above'; did you mean 'front'\\?");
    expect({"rendr"}, 2, "rendr: is no command; .*; did you mean 'render'\\?");
}

TEST_F(Refusal, PicturesWiderThanTheDriverAllows) {
    if (test_device() != "software") GTEST_SKIP() << "the limits are those of llvmpipe";
    const auto expect_wide = [&](const char* width, std::vector<std::string> more, const char* message) {
        more.insert(more.begin(), {"render", scene, folder / "wide.exr", "--width", width, "--height", "16",
                                   "--samples", "2", "--quiet"});
        expect(more, 1, message);
    };
    expect_wide("16384", {"--projection", "panorama", "--denoise"},
                "render settings: 16512 pixels wide, as a panorama is denoised with its margins: .*");
    expect_wide("16400", {"--denoise"}, "render settings: 16400 pixels wide: the driver allows 16384");
    std::vector<std::string> groups = {"--env", "white"};
    for (int i = 0; i < 31; ++i) groups.insert(groups.end(), {"--light-group", fmt::format("g{}=environment", i)});
    expect_wide("16384", groups,
                "render settings: 16384 pixels wide with 32 light groups: the driver's storage blocks hold 134217728 "
                "bytes .*");
}

TEST_F(Refusal, MissingSceneElements) {
    expect_render({"--camera", "rear"}, 1, ".*: no camera 'rear': its cameras: 0 'front', 1 'above'");
    expect_render({"--camera", "2"}, 1, ".*: no camera '2': its cameras: 0 'front', 1 'above'");
    expect_render({"--look-from", "0,5,0", "--look-at", "0,0,0", "--up", "0,1,0"}, 2,
                  "--up: expects a direction that is neither zero nor along the line of sight");
}

TEST_F(Refusal, UnreadableFiles) {
    const std::string out = folder / "out.exr";
    expect({"render", folder / "none.glb", out}, 1, ".*none.glb: cannot read: No such file or directory");
    expect({"render", folder.path, out}, 1, ".*: cannot read: Is a directory");
    write_text(folder / "empty.glb", "");
    expect({"render", folder / "empty.glb", out}, 1, ".*empty.glb.*");
    write_text(folder / "cut.gltf", read_text(scene).substr(0, 300));
    expect({"render", folder / "cut.gltf", out}, 1, ".*cut.gltf.*");
    std::filesystem::create_directory(folder / "sub");
    std::string outside = read_text(scene);
    outside.replace(outside.find("room.bin"), 8, "../room.bin");
    write_text(folder / "sub" / "outside.gltf", outside);
    expect({"info", folder / "sub" / "outside.gltf"}, 1, ".*outside.gltf.*room.bin.*");
    EXPECT_EQ(run_program({"info", folder / "sub" / "outside.gltf", "--allow-outside"}).status, 0);
    expect_render({"--env", folder / "none.exr"}, 1, ".*none.exr: cannot read: No such file or directory");
    expect({"info", folder / "none\n.glb"}, 1, ".*none[ ?].glb: cannot read: .*");
}

TEST_F(Refusal, LineWidths) {
    for (const char* width : {"0", "-1", "nan", "1e10", "thick"})
        expect({"render", scene, folder / "out.exr", "--line-width", width}, 2, "--line-width: .*");
    expect({"render", scene, folder / "out.exr", "--line-width", "1", "--pages", folder / "none.pages"}, 1,
           ".*room.gltf: pages hold no points and lines \\(--line-width\\)");
}

TEST_F(Refusal, UnknownVariants) {
    const std::string out = folder / "out.exr";
    expect({"render", scene, out, "--variant", "red"}, 1, ".*room.gltf: has no material variants, so not 'red' either");
    expect({"info", scene, "--variant", "red"}, 1, ".*room.gltf: has no material variants, so not 'red' either");
    expect({"info", "--variant", "red", "--device"}, 2, "--variant: needs a SCENE");
    expect_render({"--variant", ""}, 2, "--variant: expects the name of a variant");
}

TEST_F(Refusal, UnknownColourNames) {
    const std::string png = folder / "out.png";
    expect_render({"--ocio", folder / "none.ocio"}, 1, ".*none.ocio.*");
    write_text(folder / "bad.ocio", "ocio_profile_version: 2\nroles: [\n");
    expect_render({"--ocio", folder / "bad.ocio"}, 1, ".*bad.ocio.*");
    expect_render({}, 1, ".*none.ocio.*", {.environment = {"OCIO=" + (folder / "none.ocio").string()}});
    expect({"render", scene, png, "--view", "Rosy"}, 1, ".*Rosy.*");
    expect({"render", scene, png, "--display", "Wall"}, 1, ".*Wall.*");
    expect({"render", scene, png, "--look", "Wistful"}, 1, ".*Wistful.*");
    expect_render(
        {"--working-space", "sideways"}, 1,
        "--working-space: expects rec709, acescg or a linear space of the config; .*no colour space .sideways.*");
}

TEST_F(Refusal, FilesThatWouldBeOverwritten) {
    const std::string exr = folder / "out.exr", link = folder / "link.png", sky = folder / "sky.exr";
    const std::string detour = folder / "." / "out.exr";
    std::filesystem::create_symlink(scene, link);
    const std::string before = read_text(scene);
    expect({"render", scene, link}, 2, ".*link.png: is both input and output");
    expect({"render", scene, exr, "--stats", scene}, 2, ".*room.gltf: is both input and output");
    expect({"render", scene, sky, "--env", sky}, 2, ".*sky.exr: is both input and output");
    expect({"render", scene, exr, detour}, 2, ".*out.exr: is given twice as output");
    expect({"render", scene, exr, "--stats", exr}, 2, ".*out.exr: is given twice as output");
    expect({"render", scene, exr, "--stats", folder / "s", "--dump-graph", folder / "s"}, 2, ".*s: is given twice.*");
    EXPECT_EQ(read_text(scene), before);
}

TEST_F(Refusal, UnwritableFiles) {
    std::filesystem::create_directory(folder / "dir.exr");
    expect({"render", scene, folder / "dir.exr"}, 1, ".*dir.exr: cannot write: Is a directory");
    write_text(folder / "file", "");
    expect_render({"--stats", folder / "file" / "stats.json"}, 1, ".*stats.json: cannot write: .*");
    expect_render({"--dump-graph", folder / "file" / "graph.dot"}, 1, ".*graph.dot: cannot write: .*");
    expect({"render", scene, folder / "file" / "out.exr"}, 1, ".*out.exr: cannot write: Not a directory");
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
    expect({"render", scene, unwritable / "out.exr"}, 1,
           ".*out.exr: cannot write: (Permission denied|Operation not permitted|Read-only file system)");
}

TEST_F(Refusal, FullStandardOutput) {
    expect({"info", scene}, 1, "standard output: cannot write", {.stdout_path = "/dev/full"});
}

TEST_F(Refusal, NoDevice) {
    expect_render({"--device", "abacus"}, 1, ".*abacus.*");
    const std::string usual = test_device();
    ASSERT_EQ(setenv("HALFLIGHT_TEST_DEVICE", "counting frame", 1), 0);
    expect_render({}, 1, ".*no OpenGL 4.5 context for device 'counting frame'.*");
    ASSERT_EQ(setenv("HALFLIGHT_TEST_DEVICE", usual.c_str(), 1), 0);
    expect_render({}, 1, ".*", {.environment = {"__EGL_VENDOR_LIBRARY_DIRS=" + folder.path.string()}});
}

/// All layers of 64 x 64 noisy pixels need more than this number of bytes, compressed or not.
constexpr int kTooFewBytes = 8192;

TEST_F(Refusal, LimitOfFileSize) {
    // The driver's shader cache and the kept sources of shaders must not reach the limit.
    expect({"render", scene, folder / "out.exr", "--width", "64", "--height", "64", "--samples", "1", "--aov", "all",
            "--quiet"},
           1, ".*out.exr: .*File too large",
           {.environment = {"MESA_SHADER_CACHE_DISABLE=true", "HALFLIGHT_SHADER_SOURCES"},
            .wrapper = {"prlimit", "--fsize=" + std::to_string(kTooFewBytes)}});
}

/// Mounts a disk of this size at a folder that it makes; returns whether it may.
bool mount_disk(const std::string& disk, int bytes) {
    std::filesystem::create_directory(disk);
    const std::string size = "size=" + std::to_string(bytes);
    return mount("tmpfs", disk.c_str(), "tmpfs", 0, size.c_str()) == 0;
}

TEST_F(Refusal, DiskIsFull) {
    const std::string disk = folder / "disk";
    if (!mount_disk(disk, kTooFewBytes)) GTEST_SKIP() << "needs the right to mount a small disk";
    const Outcome outcome = run_program({"render", scene, disk + "/out.exr", "--width", "64", "--height", "64",
                                         "--samples", "1", "--aov", "all", "--quiet"});
    const bool empty = std::filesystem::is_empty(disk);
    umount(disk.c_str());
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_match(outcome.err, std::regex("halflight: .*out.exr: .*No space left on device\n")))
        << outcome.err;
    EXPECT_TRUE(empty) << "something was left on the full disk";
}

TEST_F(Refusal, PicturesAreNamedWhereStatisticsFail) {
    const std::string disk = folder / "disk";
    if (!mount_disk(disk, 4096)) GTEST_SKIP() << "needs the right to mount a small disk";
    const Outcome outcome = run_program({"render", scene, folder / "out.exr", "--width", "16", "--height", "16",
                                         "--samples", "1", "--stats", disk + "/stats.json"});
    umount(disk.c_str());
    EXPECT_EQ(outcome.status, 1);
    EXPECT_TRUE(std::regex_search(outcome.err, std::regex("wrote .*out.exr: 1 samples per pixel.*\nhalflight: .*"
                                                          "stats.json: .*No space left on device\n$")))
        << outcome.err;
}

TEST_F(Refusal, FullDisksHoldWholeLinesOfStatistics) {
    const std::string disk = folder / "disk";
    if (!mount_disk(disk, 16384)) GTEST_SKIP() << "needs the right to mount a small disk";
    const Outcome outcome =
        run_program({"render", scene, folder / "f.#.exr", "--frames", "1-8", "--width", "16", "--height", "16",
                     "--samples", "1", "--stats", disk + "/stats.jsonl", "--quiet"});
    const std::string lines = read_text(disk + "/stats.jsonl");
    umount(disk.c_str());
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("stats.jsonl: cannot write: No space left on device"), std::string::npos) << outcome.err;
    EXPECT_GT(lines.size(), 4096u);
    EXPECT_TRUE(lines.ends_with("}\n")) << lines.substr(lines.size() - std::min<std::size_t>(lines.size(), 80));
}

TEST_F(Refusal, ALaterSignalEndsTheProgramWhereItWaits) {
    // Nothing reads the help text, so the program waits for room in the pipe.
    const std::string pipe = folder / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const int ends = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_GE(fcntl(ends, F_SETPIPE_SZ, 4096), 4096);
    const Outcome outcome = run_program(
        {"render", "--help"},
        {.wrapper = {"sh", "-c", "\"$@\" & p=$!; sleep 2; kill -TERM $p; sleep 0.7; kill -HUP $p; wait $p", "sh"},
         .stdout_path = pipe,
         .most_seconds = 30});
    close(ends);  // ends the program if it still waits
    EXPECT_EQ(outcome.status, 128 + SIGHUP);
}

}  // namespace
}  // namespace halflight::test
