// Tests textures that are loaded in tiles: pictures are those of textures in memory, whatever the size of the pool.
#include <gtest/gtest.h>

#include <random>

#include "engine/core/error.h"
#include "engine/io/texture_store.h"
#include "engine/scene/texture_levels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

/// Replaces the images of a scene by noise of other sizes: single texels, single rows and columns, sizes that are no
/// multiple of a tile's, and sizes of several tiles. Alpha stays above 0.
Scene with_noise(Scene scene) {
    constexpr ivec2 kSizes[] = {{300, 200}, {1, 1}, {16384, 1}, {1, 129}, {64, 64}, {65, 127}, {128, 128}, {517, 131}};
    std::mt19937 random(1);
    for (std::size_t i = 0; i < scene.images.size(); ++i) {
        TextureImage& image = scene.images[i];
        const ivec2 size = kSizes[i % std::size(kSizes)];
        image.width = size.x, image.height = size.y;
        image.rgba.edit().resize(4 * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
        for (std::uint8_t& value : image.rgba.edit()) value = static_cast<std::uint8_t>(random() | 1u);
    }
    return scene;
}

class TiledTextures : public GpuTest {
  protected:
    Scene tiled(Scene scene) const {
        const auto store = std::make_shared<TextureStore>(folder_.path);
        for (TextureImage& image : scene.images) store->take(image);
        return scene;
    }
    RenderResult render(const Scene& scene, const RenderSettings& settings, const PrepareOptions& options = {}) {
        PreparedScene prepared(context, scene, options);
        return Renderer(prepared, ColorConfig::load(), settings).render();
    }
    /// Compares pools of several sizes with textures in memory.
    void expect_same_pictures(const Scene& scene, const RenderSettings& settings) {
        const RenderResult expected = render(scene, settings);
        EXPECT_FALSE(expected.stats.textures);
        const Scene in_tiles = tiled(scene);
        const RenderResult all = render(in_tiles, settings);
        expect_same(all, expected);
        ASSERT_TRUE(all.stats.textures);
        EXPECT_EQ(all.stats.textures->evicted, 0u);
        const std::size_t tiles = all.stats.textures->tiles;
        for (const std::size_t slots : {tiles / 2, std::size_t{1}}) {
            SCOPED_TRACE(slots);
            const RenderResult paged = render(in_tiles, settings, {.tile_bytes = slots * paging::TilePool::kSlotBytes});
            expect_same(paged, expected);
            EXPECT_LE(paged.stats.textures->slots, tiles);
        }
    }
    const TemporaryFolder folder_;
};

TEST_F(TiledTextures, ChangeNoPicture) {
    const Scene scene = with_noise(textured_scene());
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        RenderSettings settings = all_settings(scene, 48, 32, 2);
        settings.primary = primary;
        expect_same_pictures(scene, settings);
    }
}

TEST_F(TiledTextures, OfAlphaAndLightsAreAlwaysThere) {
    Scene scene = with_noise(curtain_scene());
    // Opaque surfaces get a texture of many tiles, which rays look up in vain.
    std::mt19937 random(3);
    TextureImage image{.name = "opaque", .width = 700, .height = 600, .rgba = {}};
    for (int i = 0; i < 4 * image.width * image.height; ++i)
        image.rgba.edit().push_back(static_cast<std::uint8_t>(random()));
    for (Material& m : scene.materials)
        if (m.alpha_mode == AlphaMode::opaque) m.base_color_texture.image = static_cast<int>(scene.images.size());
    scene.images.push_back(image);
    for (Mesh& mesh : scene.meshes) {
        if (!mesh.uvs[0].empty()) continue;
        for (const vec3& p : mesh.positions) mesh.uvs[0].emplace_back(p.x, p.y + p.z);
    }
    expect_same_pictures(scene, all_settings(scene, 48, 32, 2));
}

TEST_F(TiledTextures, SplitBatchesThatDoNotFit) {
    Scene scene = textured_scene();
    std::mt19937 random(2);
    for (TextureImage& image : scene.images) {
        image.width = 1000, image.height = 700;
        image.rgba.edit().resize(4 * 1000 * 700);
        for (std::uint8_t& value : image.rgba.edit()) value = static_cast<std::uint8_t>(random() | 1u);
    }
    RenderSettings settings = all_settings(scene, 64, 48, 2);
    const RenderResult expected = render(scene, settings);
    const RenderResult paged = render(tiled(scene), settings, {.tile_bytes = 1});
    expect_same(paged, expected);
    EXPECT_GT(paged.stats.textures->splits, 0u);
    EXPECT_GT(paged.stats.textures->evicted, 0u);
    EXPECT_GT(paged.stats.textures->again, paged.stats.textures->splits);
    settings.band_pixels = 1024;
    expect_same(render(tiled(scene), settings, {.tile_bytes = std::size_t{2} << 20}), expected);
}

TEST_F(TiledTextures, MayLieInSeveralBanks) {
    const Scene scene = with_noise(textured_scene()), in_tiles = tiled(scene);
    const RenderSettings settings = all_settings(scene, 48, 32, 2);
    const RenderResult expected = render(scene, settings);
    for (const unsigned shift : {20u, 21u}) {  // 512 and 1024 slots in a bank
        SCOPED_TRACE(shift);
        expect_same(render(in_tiles, settings, {.bank_shift = shift}), expected);
    }
    const std::string message = error_message([&] { render(in_tiles, settings, {.bank_shift = 11u}); });
    EXPECT_NE(message.find("4 texture buffers of the driver end at 3"), std::string::npos) << message;
}

TEST_F(TiledTextures, HaveTheSameMipLevels) {
    Scene scene = with_noise(textured_scene());
    for (TextureImage& image : scene.images) add_levels(image, {.color = true, .data = true});
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        RenderSettings settings = all_settings(scene, 48, 32, 2);
        settings.primary = primary;
        expect_same_pictures(scene, settings);
    }
}

TEST_F(TiledTextures, FollowPosesOfTheScene) {
    Scene scene = with_noise(textured_scene());
    const RenderSettings settings = all_settings(scene, 48, 32, 2);
    Scene in_tiles = tiled(scene);
    for (Scene* s : {&scene, &in_tiles}) s->instances[0].moves = true;
    PreparedScene memory(context, scene), tiles(context, in_tiles, {.tile_bytes = std::size_t{2} << 20});
    const ColorConfig colors = ColorConfig::load();
    expect_same(Renderer(tiles, colors, settings).render(), Renderer(memory, colors, settings).render());
    for (Scene* s : {&scene, &in_tiles}) s->instances[0].object_to_world[3].x += 0.1;
    memory.update(scene), tiles.update(in_tiles);
    expect_same(Renderer(tiles, colors, settings).render(), Renderer(memory, colors, settings).render());
}

}  // namespace
}  // namespace halflight::test
