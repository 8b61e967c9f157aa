#include "engine/io/ktx2.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <random>

#include "engine/core/hash.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "engine/io/uastc.h"
#include "tests/support/error_message.h"
#include "tests/support/ktx2.h"

namespace halflight {
namespace {

using namespace test;

using Bytes = std::vector<std::uint8_t>;
namespace fs = std::filesystem;

std::string refusal(std::string_view bytes, int max_side = 16384) {
    TextureImage image;
    return error_message([&] { read_ktx2("a.ktx2", bytes, max_side, image); });
}

TextureImage decoded(std::string_view bytes) {
    TextureImage image;
    read_ktx2("a.ktx2", bytes, 16384, image);
    return image;
}

std::string deflated(const std::string& bytes) {
    std::string packed(ZSTD_compressBound(bytes.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 3));
    return packed;
}

/// A block of each mode, and the hashes of its texels as basis_universal's decoder gives them, linear and sRGB.
const struct {
    const char* block;
    std::uint64_t hashes[2];
} kBlocks[] = {
    {"a1c419f643d397675cb98e1748596e2a", {0x51572a3e2e231a0f, 0xbe53bf7543f6f87f}},
    {"f588a7e644b07f87ac004b37fa0613bc", {0x625e6d475c7a4cfc, 0xb343e764a3cceaaf}},
    {"3dbf453898b7b570fbbdc02238c9ce26", {0xbb1342b9c0da55ca, 0x953205b066e2c192}},
    {"03ee8957e3c34853b001c090769f5dac", {0xd2f8ae34df721054, 0x6f4312c6cc958115}},
    {"53fc47170ae923c03d87975cf7e09564", {0x1504f501a26b9989, 0x79ac37af9a8f43b5}},
    {"abe1437bdbe1139b0413217b1eb9e549", {0x465511cbd4ee78b9, 0x76eeb4822ace875f}},
    {"dbd17f9f8253b292157743cbba2f100c", {0x74baae707e0bdf3d, 0x133470e083b52659}},
    {"072bc8dafa362befd7cdb227839d8ccc", {0x01e83faf7ba07d5f, 0xf8d76ff67f3613af}},
    {"571d8836a675c6952cdb87d1eaefc564", {0x2c59a349da333f85, 0x2c59a349da333f85}},
    {"afe9a91d1a40fcbed6e20c86e8a2bb6a", {0xc57daa0bdbc526b7, 0xd39796af8f5e5bf9}},
    {"6a74f15de6ea11054f31b64c69e8dcb6", {0x641f0a332fc84464, 0x0e89c2051e850a15}},
    {"aca5c9579504db4ce94b0678e1d5559e", {0x4b1806381874fcb9, 0x5d93735974082041}},
    {"6edc3833f7b7798c4c6da4c755ba29e6", {0x0bca39fb392bb211, 0x43e87d63899cac16}},
    {"9f2b3b523f9c9085234d2075d7dfa12d", {0x8776f63f1cffa555, 0x8776f63f1cffa555}},
    {"ad74db8e2d692a60225f70b7e69209c9", {0x66c15ce65b107efd, 0x9257b795ac27ebad}},
    {"0555ab011f8ed03099f1eea1d5d3ff52", {0x438cc3274d222f0c, 0x35bf7aecd623bd53}},
    {"55cd3a0afeb4fa1b9c08f7e164d9acfe", {0x5720a75b042ad66d, 0x12d379af0ace756d}},
    {"a5362a5c07f18f80d2e7ecb0c02c092e", {0x9aa2afa8d35a5d58, 0x04d971b05c86d65b}},
    {"b9e2b07fab059590e90b6aa02824459c", {0x963576ac80bfb1a8, 0xd4599c1c8134e254}},
};

std::string bytes_of(const std::string& hex) {
    std::string bytes;
    for (std::size_t i = 0; i < hex.size(); i += 2)
        bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    return bytes;
}

TEST(Uastc, EveryModeDecodesLikeTheReference) {
    for (const auto& [hex, hashes] : kBlocks) {
        const std::string block = bytes_of(hex);
        for (const bool srgb : {false, true}) {
            TexelBlock texels;
            ASSERT_TRUE(decode_uastc(reinterpret_cast<const std::uint8_t*>(block.data()), srgb, texels));
            Hash hash;
            hash.add_bytes(texels.data(), texels.size());
            EXPECT_EQ(hash.value(), hashes[srgb]) << hex;
        }
    }
    TexelBlock texels;
    // The reserved mode, and modes 2, 3 and 7 with a pattern that does not exist; mode 14 has no patterns.
    for (const unsigned char first : {0x45, 0x1d, 0x03, 0x07, 0x0d}) {
        std::array<std::uint8_t, kUastcBlockBytes> block;
        block.fill(0xff);
        block[0] = first;
        EXPECT_EQ(decode_uastc(block.data(), false, texels), first == 0x0d) << int{first};
    }
}

Ktx2 uastc(std::uint32_t width = 20, std::uint32_t height = 16) {
    Ktx2 file;
    file.width = width, file.height = height;
    file.channels = {3};
    for (std::uint32_t i = 0; i < (width + 3) / 4 * ((height + 3) / 4); ++i)
        file.pixels += bytes_of(kBlocks[i % 19].block);
    return file;
}

Ktx2 zstandard(Ktx2 file) {
    file.inflated = file.pixels.size();
    file.pixels = deflated(file.pixels);
    file.supercompression = 2;
    return file;
}

TEST(Ktx2File, UastcBlocksLieInRows) {
    const TextureImage image = decoded(encode(uastc(18, 14)));
    ASSERT_EQ(image.width, 18);
    ASSERT_EQ(image.height, 14);
    for (int y = 0; y < 14; ++y) {
        for (int x = 0; x < 18; ++x) {
            const std::string block = bytes_of(kBlocks[(x / 4 + 5 * (y / 4)) % 19].block);
            TexelBlock texels;
            decode_uastc(reinterpret_cast<const std::uint8_t*>(block.data()), true, texels);
            for (int c = 0; c < 4; ++c)
                ASSERT_EQ(image.rgba[4 * (18 * y + x) + c], texels[4 * (4 * (y % 4) + x % 4) + c]) << x << " " << y;
        }
    }
    EXPECT_EQ(decoded(encode(zstandard(uastc(18, 14)))).rgba, image.rgba);
    Ktx2 two = uastc(18, 14);
    two.channels = {5};
    const TextureImage red_green = decoded(encode(two));
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
        ASSERT_EQ(red_green.rgba[i], image.rgba[i]);
        ASSERT_EQ(red_green.rgba[i + 1], image.rgba[i + 3]);
        ASSERT_EQ(red_green.rgba[i + 2], 0);
        ASSERT_EQ(red_green.rgba[i + 3], 255);
    }
}

TEST(Ktx2File, UncompressedTexels) {
    const std::string texels = "\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0a\x0b\x0c";
    const struct {
        std::uint32_t format, width;
        Bytes rgba;
    } cases[] = {{37, 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}},
                 {29, 4, {1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255}},
                 {16, 6, {1, 2, 0, 255, 3, 4, 0, 255, 5, 6, 0, 255, 7, 8, 0, 255, 9, 10, 0, 255, 11, 12, 0, 255}}};
    for (const auto& [format, width, rgba] : cases) {
        Ktx2 file;
        file.model = 1, file.format = format, file.width = width, file.height = 1, file.pixels = texels;
        EXPECT_EQ(decoded(encode(file)).rgba, rgba) << format;
        EXPECT_EQ(decoded(encode(zstandard(file))).rgba, rgba) << format;
        EXPECT_EQ(read_ktx2_header("", encode(file), 1000, 99).srgb, true);
    }
    Ktx2 grey;
    grey.model = 1, grey.format = 9, grey.width = 2, grey.height = 1, grey.pixels = "\x05\x09", grey.transfer = 1;
    EXPECT_EQ(decoded(encode(grey)).rgba, (Bytes{5, 5, 5, 255, 9, 9, 9, 255}));
    EXPECT_EQ(read_ktx2_header("", encode(grey), 1000, 99).srgb, false);
}

TEST(Ktx2File, ColourSpacesThatGltfDoesNotAllowHaveNames) {
    const struct {
        unsigned primaries, transfer;
        const char *name_of_primaries, *name_of_transfer;
        std::optional<bool> srgb;
    } cases[] = {{0, 2, "", "", true},
                 {1, 1, "", "", false},
                 {1, 0, "", "", {}},
                 {4, 2, "BT.2020", "", true},
                 {10, 2, "Display P3", "", true},
                 {255, 2, "of an unknown kind", "", true},
                 {1, 10, "", "PQ EOTF", {}},
                 {1, 20, "", "of an unknown kind", {}}};
    for (const auto& [primaries, transfer, name_of_primaries, name_of_transfer, srgb] : cases) {
        Ktx2 file = uastc();
        file.primaries = primaries, file.transfer = transfer;
        const auto header = read_ktx2_header("", encode(file), 10000, 99);
        EXPECT_EQ(header.primaries, name_of_primaries);
        EXPECT_EQ(header.transfer, name_of_transfer);
        EXPECT_EQ(header.srgb, srgb) << transfer;
    }
}

/// Makes a picture with runs of equal blocks and with all kinds of predictions.
Etc1s random_etc1s(std::uint32_t columns, std::uint32_t rows, std::size_t slices) {
    std::mt19937 random(columns + rows);
    const auto below = [&](std::uint32_t limit) { return static_cast<std::uint32_t>(random() % limit); };
    Etc1s picture{columns, rows, {}, {}, {}};
    for (int i = 0; i < 11; ++i) picture.endpoints.push_back({below(8), below(32), below(32), below(32)});
    picture.selectors.resize(7);
    for (Etc1s::Selector& selector : picture.selectors)
        for (std::uint8_t& texel : selector) texel = static_cast<std::uint8_t>(below(4));
    picture.slices.resize(slices);
    for (std::vector<Etc1s::Block>& blocks : picture.slices) {
        for (std::uint32_t i = 0; i < columns * rows; ++i) {
            const bool calm = i > columns * rows / 2;  // half of the picture has long runs
            blocks.push_back({calm ? 3 : below(3), calm || below(3) == 0 ? 0 : below(7)});
            if (below(5) == 0) blocks.back().endpoint = below(11);
        }
    }
    return picture;
}

TEST(Ktx2File, Etc1sFollowsItsCodebooks) {
    constexpr int kSmall[] = {2, 5, 9, 13, 18, 24, 33, 47}, kLarge[] = {8, 17, 29, 42, 60, 80, 106, 183};
    for (const auto& [columns, rows] : {std::pair(1u, 1u), {5u, 7u}, {40u, 33u}}) {
        for (const std::size_t slices : {1u, 2u}) {
            const Etc1s picture = random_etc1s(columns, rows, slices);
            const TextureImage image = decoded(encode(encode_basis_lz(picture)));
            const int width = image.width;
            ASSERT_EQ(image.rgba.size(), 64u * columns * rows);
            for (int i = 0; i < width * image.height; ++i) {
                const int x = i % width, y = i / width;
                for (std::size_t c = 0; c < 4; ++c) {
                    int expected = 255;
                    if (c < 3 || slices == 2) {
                        const Etc1s::Block block = picture.slices[c / 3].at((y / 4) * columns + x / 4);
                        const Etc1s::Endpoint& endpoint = picture.endpoints[block.endpoint];
                        const int texel = picture.selectors[block.selector][4 * (y % 4) + x % 4];
                        const int modifier = (texel % 3 == 0 ? kLarge : kSmall)[endpoint[0]];
                        const int base = static_cast<int>(endpoint[c % 3 + 1]);
                        expected = std::clamp((base << 3 | base >> 2) + (texel < 2 ? -modifier : modifier), 0, 255);
                    }
                    ASSERT_EQ(image.rgba[4 * i + c], expected) << x << " " << y << " channel " << c;
                }
            }
        }
    }
}

TEST(Ktx2File, OtherKindsAreRefusedByName) {
    const struct {
        void (*change)(Ktx2&);
        const char* reason;
    } cases[] = {
        {[](Ktx2& f) { f.model = 134; }, "has texels in BC7"},
        {[](Ktx2& f) {
             f.model = 1, f.format = 97, f.bits = 16, f.channels = {0, 1, 2, 15};
         },
         "has texels of 16 + 16 + 16 + 16 bits (VkFormat 97)"},
        {[](Ktx2& f) { f.faces = 6; }, "is a cube map"},
        {[](Ktx2& f) { f.layers = 2; }, "is an array texture"},
        {[](Ktx2& f) { f.depth = 2; }, "is a volume texture"},
        {[](Ktx2& f) { f.flags = 1; }, "has premultiplied alpha"},
        {[](Ktx2& f) { f.supercompression = 3; }, "has the supercompression 3"},
        {[](Ktx2& f) { f.supercompression = 1; }, "has a supercompression that does not fit its texels"},
        {[](Ktx2& f) { f.channels = {9}; }, "has an unknown format or combination of channels"},
        {[](Ktx2& f) { f.values = std::string("\x12\0\0\0KTXorientation\0ru\0\0\0", 24); },
         "has another KTXorientation"},
        {[](Ktx2& f) { f.values = std::string("\x12\0\0\0KTXorientation\0rd\0\0\0\x10\0\0\0KTXswizzle\0bgra\0", 44); },
         "has another KTXswizzle"},
        {[](Ktx2& f) { f.pixels[0] = 0x45; }, "cannot be decoded: the block at texel (0, 0)"},
        {[](Ktx2& f) { f.width = 16385, f.height = 1; }, "16385 x 1 texels"},
    };
    for (const auto& [change, reason] : cases) {
        Ktx2 file = uastc();
        change(file);
        EXPECT_TRUE(refusal(encode(file)).starts_with(std::string("a.ktx2: ") + reason)) << refusal(encode(file));
    }
    Ktx2 upright = uastc();
    upright.values = std::string("\x12\0\0\0KTXorientation\0rd\0\0\0", 24);
    EXPECT_EQ(refusal(encode(upright)), "");
}

TEST(Ktx2File, FewBytesCannotClaimManyTexels) {
    Ktx2 file = encode_basis_lz(random_etc1s(5, 7, 1));
    file.width = file.height = 16384;
    EXPECT_TRUE(refusal(encode(file)).starts_with("a.ktx2: is refused: "));
    Ktx2 bomb = uastc();
    bomb.pixels.assign(std::size_t{4096} * 4096, '\0');
    bomb = zstandard(bomb);
    bomb.width = bomb.height = 16;
    EXPECT_TRUE(refusal(encode(bomb)).starts_with("a.ktx2: is damaged: "));
    bomb.inflated = 256;
    EXPECT_TRUE(refusal(encode(bomb)).starts_with("a.ktx2: cannot be decoded: Zstandard: ")) << refusal(encode(bomb));
}

TEST(Ktx2File, EveryTruncationIsAnError) {
    for (const Ktx2& file : {uastc(), zstandard(uastc()), encode_basis_lz(random_etc1s(5, 7, 2))}) {
        const std::string bytes = encode(file);
        for (std::size_t length = 0; length < bytes.size(); ++length)
            EXPECT_TRUE(refusal(bytes.substr(0, length)).starts_with("a.ktx2: ")) << length << " of " << bytes.size();
    }
}

double psnr(const TextureImage& a, const TextureImage& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.rgba.size(); ++i) sum += i % 4 == 3 ? 0 : std::pow(double(a.rgba[i]) - b.rgba[i], 2);
    return 10 * std::log10(255 * 255 / (sum / (0.75 * static_cast<double>(a.rgba.size()))));
}

TEST(Ktx2File, FilesOfOthersResembleTheirPng) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "extensions/compressed";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is absent";
    TextureImage png;
    read_png("kodim23.png", read_file(folder / "kodim23.png", 1 << 24), 16384, png);
    const TextureImage etc1s = decoded(read_file(folder / "kodim23_etc1s.ktx2", 1 << 24));
    const TextureImage uastc = decoded(read_file(folder / "kodim23_uastc_zstd.ktx2", 1 << 24));
    EXPECT_NEAR(psnr(etc1s, png), 35.311, 0.001);  // basis_universal's decoder gives the same texels
    EXPECT_NEAR(psnr(uastc, png), 45.323, 0.001);
    for (const char* name : {"2d_rgb8", "2d_rgba8", "2d_uastc", "2d_etc1s"})
        EXPECT_EQ(decoded(read_file(folder / (std::string(name) + ".ktx2"), 1 << 24)).width, 40) << name;
    for (const char* name : {"2d_bc1", "2d_bc7", "2d_astc4x4", "2d_rgba16_linear", "2d_rgba32_linear"})
        EXPECT_TRUE(
            refusal(read_file(folder / (std::string(name) + ".ktx2"), 1 << 24)).starts_with("a.ktx2: has texel"))
            << name;
}

}  // namespace
}  // namespace halflight
