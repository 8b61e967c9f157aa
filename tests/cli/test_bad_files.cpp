// Tests bad files that scenes, --env and --ocio name: truncated, oversized, not regular, or out of bounds.
#include <fmt/format.h>
#include <sys/stat.h>
#include <zlib.h>

#include "engine/core/one_line.h"
#include "engine/io/png.h"
#include "tests/cli/bad_input.h"
#include "tests/support/jpeg.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kPointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 36\n";
const fs::path kSeeds = fs::path(HALFLIGHT_SOURCE_DIR) / "tests/fuzz/seeds";

std::string big_endian(std::uint32_t v) {
    return {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8), static_cast<char>(v)};
}

std::string png_chunk(const std::string& type, const std::string& data) {
    std::uint32_t checksum = ~0u;  // CRC-32 (PNG specification, annex D)
    for (const char c : type + data) {
        checksum ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) checksum = checksum >> 1 ^ (checksum & 1 ? 0xedb88320u : 0u);
    }
    return big_endian(static_cast<std::uint32_t>(data.size())) + type + data + big_endian(~checksum);
}

/// Returns the header of a PNG of 8-bit RGBA, followed by `rest`.
std::string png_claiming(std::uint32_t width, std::uint32_t height, const std::string& rest = "") {
    return "\x89PNG\r\n\x1a\n" +
           png_chunk("IHDR", big_endian(width) + big_endian(height) + std::string("\x8\x6\0\0\0", 5)) + rest;
}

class BadFiles : public CommandTest {
  protected:
    void write(const std::string& name, const std::string& bytes) const { write_text(file(name), bytes); }

    /// Returns the glTF text of a triangle with a texture from `image` and positions from `buffer`.
    std::string scene(const std::string& image, const std::string& buffer = "good.bin") const {
        write("good.bin", std::string(36, '\0'));
        const Json texture = {{"index", 0}};
        const Json json = {
            {"asset", {{"version", "2.0"}}},
            {"buffers", {{{"uri", buffer}, {"byteLength", 36}}}},
            {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}}},
            {"accessors", {{{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}}}},
            {"images", {{{"uri", image}}}},
            {"textures", {{{"source", 0}}}},
            {"materials", {{{"pbrMetallicRoughness", {{"baseColorTexture", texture}}}}}},
            {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"material", 0}}}}}}},
            {"nodes", {{{"mesh", 0}}}}};
        write("scene.gltf", json.dump());
        return file("scene.gltf");
    }
    void image_refused(const std::string& name, const std::string& bytes, const Strings& parts = {}) {
        write("image", bytes);
        expect_refused("image: " + name, with_scene(scene("image")),
                       words(Strings{"/scene.gltf: ", "images[0] (image)"}, parts));
    }
    void map_refused(const std::string& name, const std::string& bytes) {
        write("map", bytes);
        expect_refused("environment: " + name, with_environment(file("map")), {file("map") + ": "});
    }
    void config_refused(const std::string& name, const std::string& bytes, const Strings& parts = {}) {
        write("config", bytes);
        expect_refused("config: " + name, with_config(file("config")), words(file("config") + ": ", parts));
    }
};

std::string small_png() {
    const TemporaryFolder folder;
    write_png(folder / "a.png", 8, 8, 4, std::vector<std::uint8_t>(256, 77));
    return read_text(folder / "a.png");
}

std::string small_jpeg() {
    return encode_jpeg(32, {128, 128, 128});
}

/// Returns a JPEG whose frame header claims `side` x `side` pixels.
std::string jpeg_claiming(std::uint16_t side) {
    std::string bytes = small_jpeg();
    const auto frame = bytes.find("\xff\xc0");
    for (const std::size_t at : {frame + 5, frame + 7}) {
        bytes[at] = static_cast<char>(side >> 8);
        bytes[at + 1] = static_cast<char>(side);
    }
    return bytes;
}

TEST_F(BadFiles, TruncatedImages) {
    const std::pair<const char*, std::string> images[] = {{"PNG", small_png()},
                                                          {"JPEG", small_jpeg()},
                                                          {"ETC1S", read_text(kSeeds / "ktx2/etc1s")},
                                                          {"UASTC", read_text(kSeeds / "ktx2/zstd")},
                                                          {"WebP", read_text(kSeeds / "webp/lossless-alpha")}};
    for (const auto& [kind, whole] : images) {
        write("image", whole);
        expect_loaded("image: whole", with_scene(scene("image")));
        for (const std::size_t length : prefix_lengths(whole.size()))
            image_refused(fmt::format("{}, {} of {} bytes", kind, length, whole.size()), whole.substr(0, length));
    }
}

TEST_F(BadFiles, OversizedImages) {
    for (const std::uint32_t side : {0u, 16384u, 16385u, 1u << 24, (1u << 31) - 1, ~0u})
        image_refused(fmt::format("PNG of {0} x {0}", side), png_claiming(side, side));
    const std::string deflated("\x78\x9c\x63\0\0\0\x1\0\x1", 9);  // one byte
    image_refused("PNG of 16384 x 16384 with a few texels",
                  png_claiming(16384, 16384, png_chunk("IDAT", deflated) + png_chunk("IEND", "")));
    std::string wrong_checksum = small_png();
    wrong_checksum[30] ^= 1;
    image_refused("PNG whose checksum is wrong", wrong_checksum);
    image_refused("PNG with a chunk of 2 GiB", png_claiming(8, 8, big_endian(0x7fffffff) + "IDAT"));
    for (const std::uint16_t side : {std::uint16_t{0}, std::uint16_t{16384}, std::uint16_t{65535}})
        image_refused(fmt::format("JPEG of {0} x {0}", side), jpeg_claiming(side));
    for (const char* seed : {"ktx2/etc1s", "ktx2/zstd", "webp/noise"}) {
        std::string bytes = read_text(kSeeds / seed);
        const bool ktx2 = std::string_view(seed).starts_with("ktx2");
        ktx2 ? bytes.replace(20, 8, std::string("\0\x40\0\0\0\x40\0\0", 8)) : bytes.replace(21, 3, "\xff\xff\xff");
        if (!ktx2) bytes[24] = static_cast<char>(bytes[24] | 0xf);
        image_refused(std::string(seed) + " of 16384 x 16384", bytes, {"16384 x 16384 texels"});
    }
    image_refused("none, a GIF", "GIF89a\x1\0\x1\0", {"GIF"});
    image_refused("Git LFS pointer", kPointer, {"Git LFS pointer"});
}

TEST_F(BadFiles, TruncatedEnvironments) {
    for (const auto& entry : fs::directory_iterator(kSeeds / "environment")) {
        const std::string name = entry.path().filename();
        EXPECT_EQ(judge("environment: " + name, reading(with_environment(entry.path()))).fate, Fate::loaded) << name;
    }
    for (const std::string name : {"none.exr", "tiled.exr", "runs.hdr"}) {
        const std::string whole = read_text(kSeeds / "environment" / name);
        expect_loaded("environment: " + name, with_environment(kSeeds / "environment" / name));
        for (const std::size_t length : prefix_lengths(whole.size()))
            map_refused(fmt::format("{}, {} of {} bytes", name, length, whole.size()), whole.substr(0, length));
    }
}

TEST_F(BadFiles, OversizedEnvironments) {
    const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    for (const char* size : {"-Y 8192 +X 16384", "-Y 16384 +X 16384", "-Y 16385 +X 4", "-Y 2147483647 +X 2147483647",
                             "-Y 4294967297 +X 4", "-Y 0 +X 0", "-Y -4 +X 4", "", "-Y 4"})
        map_refused(fmt::format("size \"{}\"", size), head + size + "\n\2\2\x40");
    map_refused("without a header's end", "#?RADIANCE\n" + std::string(100000, '\n') + "x");
    map_refused("Git LFS pointer", kPointer);
    map_refused("PNG", small_png());

    const std::string exr = read_text(kSeeds / "environment/none.exr");
    const std::size_t window = exr.find(std::string("dataWindow\0box2i\0", 17)) + 21;
    const auto with_window = [&](std::int32_t x, std::int32_t y) {
        std::string bytes = exr;
        bytes.replace(window + 8, 4, reinterpret_cast<const char*>(&x), 4);
        bytes.replace(window + 12, 4, reinterpret_cast<const char*>(&y), 4);
        return bytes;
    };
    for (const std::int32_t last :
         {-2, 16383, 16384, std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::min()})
        map_refused(fmt::format("OpenEXR up to {}", last), with_window(last, last));
}

/// Small valid files that become large in memory are refused from their headers, under a budget of 512 MiB.
TEST_F(BadFiles, BombsAreRefusedByTheMemoryBudget) {
    const auto limited = [](const Strings& arguments) { return words(arguments, "--memory 512MiB"); };
    const auto refused = [&](const std::string& name, const Strings& arguments, const Strings& parts) {
        expect_refused("bomb: " + name, limited(arguments), words("--memory budget", parts));
    };
    write("image", small_png());
    expect_loaded("no bomb", limited(with_scene(scene("image"))));
    expect_refused(
        "bomb: picture of 4096 x 4096",
        words("render", scene("image"), file("picture.exr"), "--width 4096 --height 4096 --aov all --memory 1GiB"),
        {"/scene.gltf: ", "picture at least", "--memory"});

    constexpr std::uint32_t kSide = 16384;
    std::string rows((kSide / 8 + 1) * kSide, '\0'), deflated(compressBound(rows.size()), '\0');
    uLongf length = deflated.size();
    ASSERT_EQ(compress(reinterpret_cast<Bytef*>(deflated.data()), &length, reinterpret_cast<const Bytef*>(rows.data()),
                       rows.size()),
              Z_OK);
    deflated.resize(length);
    write("image", "\x89PNG\r\n\x1a\n" +
                       png_chunk("IHDR", big_endian(kSide) + big_endian(kSide) + std::string("\1\0\0\0\0", 5)) +
                       png_chunk("IDAT", deflated) + png_chunk("IEND", ""));
    refused("PNG of 16384 x 16384", with_scene(scene("image")), {"/scene.gltf: ", "decoding them 1.0 GiB"});
    // The header tells the size. The rest of the file only makes it long enough to hold so many texels.
    write("image", jpeg_claiming(kSide) + std::string(std::size_t{1} << 20, 'x'));
    refused("JPEG of 16384 x 16384", with_scene(scene("image")), {"/scene.gltf: ", "decoding them 1.0 GiB"});

    std::string row{2, 2, kSide >> 8, 0};
    for (std::uint32_t left = 4 * kSide, run = 0; left > 0; left -= run) {
        run = std::min({left, 127u, (left - 1) % kSide + 1});
        row += {static_cast<char>(128 + run), '\x80'};
    }
    std::string map = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n";
    for (int y = 0; y < 8192; ++y) map += row;
    write("map", map);
    refused("Radiance of 16384 x 8192", with_environment(file("map")), {"/map: ", "1610612736 bytes"});

    write("image", small_png());
    Json points = Json::parse(read_text(scene("image", "points.bin")));
    constexpr std::size_t kPoints = 10000000;
    write("points.bin", std::string(36 + kPoints, '\0'));
    points["buffers"][0]["byteLength"] = 36 + kPoints;
    points["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 36}, {"byteLength", kPoints}});
    points["accessors"].push_back({{"bufferView", points["bufferViews"].size() - 1},
                                   {"componentType", 5121},
                                   {"count", kPoints},
                                   {"type", "SCALAR"}});
    Json& primitive = points["meshes"][0]["primitives"][0];
    primitive["mode"] = 0;
    primitive["indices"] = points["accessors"].size() - 1;
    write("scene.gltf", points.dump());
    refused("10^7 points", words(with_scene(file("scene.gltf")), "--line-width 0.1"), {"/scene.gltf: ", "geometry"});
    expect_loaded("10^7 points that are left out", limited(with_scene(file("scene.gltf"))));

    Json many = Json::parse(read_text(scene("image")));
    many["nodes"] = Json::array();
    for (int i = 0; i < 1000000; ++i) many["nodes"].push_back({{"mesh", 0}, {"translation", {i, 0, 0}}});
    write("scene.gltf", many.dump());
    refused("10^6 nodes", with_scene(file("scene.gltf")), {"/scene.gltf: ", "objects and arrays of JSON"});
}

/// A file of which the scene uses a few bytes takes memory for those only.
TEST_F(BadFiles, HugeBuffersOfWhichLittleIsUsed) {
    write("huge.bin", std::string(36, '\0'));
    std::error_code none;
    fs::resize_file(file("huge.bin"), std::uint64_t{7} << 30, none);
    if (none) GTEST_SKIP() << "the file system has no files of 7 GiB";
    write("image", small_png());
    Json json = Json::parse(read_text(scene("image", "huge.bin")));
    json["buffers"][0]["byteLength"] = std::uint64_t{7} << 30;
    write("scene.gltf", json.dump());
    expect_loaded("7 GiB of which 36 bytes are used", words(with_scene(file("scene.gltf")), "--memory 512MiB"));
}

TEST_F(BadFiles, NoRegularFiles) {
    fs::create_directory(folder / "folder");
    ASSERT_EQ(mkfifo(file("pipe").c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", folder / "zero");
    fs::create_symlink("circle", folder / "circle");
    const std::string long_name(100000, 'n');
    for (const std::string& name :
         {file("none"), file("folder"), file("pipe"), file("circle"), std::string("/dev/zero"),
          std::string("/dev/null"), std::string("/dev/stdin"), file("scene.gltf/x"), long_name}) {
        const std::string shown = name.substr(0, kMostMessage / 4);  // messages lose their middle
        expect_refused("scene: " + shown, with_scene(name), {shown});
        expect_refused("environment: " + shown, with_environment(name), {shown});
        expect_refused("config: " + shown, with_config(name), {shown});
    }
    write("image", small_png());
    Strings uris = words("folder pipe zero none circle . .. ../none %2e%2e/x /dev/zero /dev/stdin http://host/a a%00b",
                         "file:///etc/passwd data: data:;base64,A \xc3\xbc");
    uris.insert(uris.end(), {"", "a\nb", long_name});
    for (const std::string& uri : uris) {
        const std::string shown = uri.substr(0, 40);
        expect_refused("buffer: URI " + shown, with_scene(scene("image", uri)), {"/scene.gltf: buffers[0]"});
        if (!uri.empty())  // an empty one counts as absent
            expect_refused("image: URI " + shown, with_scene(scene(uri)), {"/scene.gltf: images[0]"});
    }
    for (const char* uri : {"..", "../none", "/dev/zero", "/dev/stdin"})
        expect_refused(fmt::format("buffer: URI {}, --allow-outside", uri),
                       words(with_scene(scene("image", uri)), "--allow-outside"), {"/scene.gltf: buffers[0]"});
    write("pointer.bin", kPointer);
    expect_refused("buffer: Git LFS pointer", with_scene(scene("image", "pointer.bin")),
                   {"buffers[0]", "Git LFS pointer"});
    for (const std::size_t length : prefix_lengths(36)) {
        write("cut.bin", std::string(length, '\0'));
        expect_refused(fmt::format("buffer: {} of 36 bytes", length), with_scene(scene("image", "cut.bin")),
                       {"buffers[0]"});
    }
}

TEST_F(BadFiles, Configs) {
    const std::string good = read_text(kSeeds / "color/small");
    std::string whole = good;
    for (int i = 0; i < 4; ++i) whole.erase(0, whole.find('\n') + 1);
    write("config", whole);
    expect_loaded("config: whole", with_config(file("config")));
    config_refused("empty", "");
    config_refused("not YAML", "ocio_profile_version: [");
    config_refused("zeros", std::string(4096, '\0'));
    config_refused("bytes that are not UTF-8", "ocio_profile_version: 2\n\xff\xfe\xfd");
    config_refused("Git LFS pointer", kPointer, {"Git LFS pointer"});
    config_refused("version 99", "ocio_profile_version: 99\n");
    config_refused("nothing in it", "ocio_profile_version: 2\n");
    config_refused("nested 100000 deep", "ocio_profile_version: 2\nroles: " + std::string(100000, '['));
    config_refused("braces 100000 deep", "ocio_profile_version: 2\nroles: " + std::string(100000, '{'));
    std::string laughs = "ocio_profile_version: 2\na0: &a0 [x,x,x,x,x,x,x,x,x,x]\n";
    for (int i = 1; i < 12; ++i) {
        laughs += fmt::format("a{0}: &a{0} [", i);
        for (int k = 0; k < 10; ++k) laughs += fmt::format("*a{},", i - 1);
        laughs += "]\n";
    }
    config_refused("a billion laughs", laughs + "displays: *a11\n");

    ASSERT_EQ(mkfifo(file("pipe.spi1d").c_str(), 0600), 0);
    fs::create_directory(folder / "folder.spi1d");
    fs::create_symlink("/dev/zero", folder / "zero.spi1d");
    write("pointer.spi1d", kPointer);
    write("claim.spi1d", "Version 1\nFrom 0.0 1.0\nLength 1073741824\nComponents 3\n{\n0 0 0\n}\n");
    write("claim.spi3d", "SPILUT 1.0\n3 3\n2000 2000 2000\n0 0 0 0 0 0\n");
    write("claim.cube", "LUT_3D_SIZE 100000\n0 0 0\n");
    const std::string film = "name: film\n";
    const auto at = whole.find(film);
    ASSERT_NE(at, std::string::npos);
    for (const std::string lut : {"none.spi1d", "pipe.spi1d", "folder.spi1d", "zero.spi1d", "pointer.spi1d",
                                  "claim.spi1d", "claim.spi3d", "claim.cube", "/dev/zero"})
        config_refused("LUT " + lut, whole.substr(0, at) + film + "    from_scene_reference: !<FileTransform> {src: " +
                                         (lut[0] == '/' ? "" : file("")) + lut + ", interpolation: best}\n");
}

/// OpenColorIO follows references without a limit, which ends in a stack overflow or an endless run.
TEST_F(BadFiles, ConfigsWhoseReferencesNeverEnd) {
    std::string whole = read_text(kSeeds / "color/small");
    for (int i = 0; i < 4; ++i) whole.erase(0, whole.find('\n') + 1);
    const auto film = whole.find("    from_scene_reference: !<GroupTransform>");
    ASSERT_NE(film, std::string::npos);
    const std::string start = whole.substr(0, film);
    const auto space = [](const std::string& name, const std::string& transform) {
        return fmt::format("  - !<ColorSpace> {{name: {}, from_scene_reference: {}}}\n", name, transform);
    };
    const auto to = [](const std::string& name) {
        return fmt::format("!<ColorSpaceTransform> {{src: lin_rec709, dst: {}}}", name);
    };
    const auto with_film = [&](const std::string& transform, const std::string& rest = "") {
        return start + "    from_scene_reference: " + transform + "\n" + rest;
    };
    std::string many = space("a0", "&a0 !<CDLTransform> {slope: [1, 1, 1]}"), deep = many;
    for (int i = 1; i < 100; ++i) {
        std::string ten;
        for (int k = 0; k < 10; ++k) ten += fmt::format("*a{}, ", i - 1);
        if (i < 10)
            many += space(fmt::format("a{}", i), fmt::format("&a{} !<GroupTransform> {{children: [{}]}}", i, ten));
        deep += space(fmt::format("a{}", i), fmt::format("&a{} !<GroupTransform> {{children: [*a{}]}}", i, i - 1));
    }
    config_refused("aliases of 10^9 transforms", with_film(to("lin_rec709"), many), {"aliases"});
    config_refused("aliases of 100 levels", with_film(to("lin_rec709"), deep), {"aliases"});
    config_refused("alias of itself", with_film("&film !<GroupTransform> {children: [*film]}"), {"alias"});
    config_refused("space of itself", with_film(to("film")), {"\"film\""});
    config_refused("space of itself, in a group", with_film("!<GroupTransform> {children: [" + to("film") + "]}"),
                   {"\"film\""});
    config_refused("two spaces", with_film(to("b"), space("b", to("film"))), {"\"film\"", "\"b\""});
    config_refused("look of itself",
                   with_film("!<LookTransform> {src: lin_rec709, dst: lin_rec709, looks: warm}")
                       .replace(whole.find("!<CDLTransform>"),
                                whole.find("}}", whole.find("!<CDLTransform>")) + 1 - whole.find("!<CDLTransform>"),
                                "!<LookTransform> {src: lin_rec709, dst: lin_rec709, looks: warm}"),
                   {"\"warm\""});
    config_refused("space of its own view",
                   with_film("!<DisplayViewTransform> {src: lin_rec709, display: sRGB, view: Film}"), {"\"film\""});
    config_refused("named transform of itself",
                   with_film(to("turn")) +
                       "named_transforms: [!<NamedTransform> {name: turn, transform: !<ColorSpaceTransform> {src: "
                       "lin_rec709, dst: film}}]\n",
                   {"\"turn\""});
    std::string chain, doubled;
    for (int i = 0; i < 200; ++i) chain += space(fmt::format("s{}", i), to(fmt::format("s{}", i + 1)));
    config_refused("chain of 200", with_film(to("s0"), chain + "  - !<ColorSpace> {name: s200}\n"), {"levels deep"});
    for (int i = 0; i < 30; ++i)
        doubled += space(fmt::format("s{}", i),
                         fmt::format("!<GroupTransform> {{children: [{0}, {0}]}}", to(fmt::format("s{}", i + 1))));
    config_refused("2^30 transforms", with_film(to("s0"), doubled + "  - !<ColorSpace> {name: s30}\n"),
                   {"100000 transforms"});
    write("config", with_film(to("b"), space("b", to("lin_rec709"))));
    expect_loaded("config: three spaces in a row", with_config(file("config")));
    // Two spaces that refer to each other. A conversion would end, but OpenColorIO looks at both directions of each.
    const std::string log = "!<LogTransform> {base: 10}";
    config_refused("two spaces in one direction each",
                   with_film(to("b"), "  - !<ColorSpace> {name: b, from_scene_reference: " + log +
                                          ", to_scene_reference: !<ColorSpaceTransform> {src: c, dst: lin_rec709}}\n"
                                          "  - !<ColorSpace> {name: c, from_scene_reference: " +
                                          to("b") + ", to_scene_reference: " + log + "}\n"),
                   {"\"b\"", "\"c\""});
}

}  // namespace
}  // namespace halflight::test
