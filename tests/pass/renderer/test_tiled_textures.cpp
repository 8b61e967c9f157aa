// Tests textures that are loaded in tiles, and texel pools of several banks: pictures are those of textures in memory
// in one bank, whatever the size of the pool. Tests the choice of mip levels by surfaces whose levels differ in colour.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "engine/core/error.h"
#include "engine/io/texture_store.h"
#include "engine/scene/srgb.h"
#include "engine/scene/texture_levels.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tools/common/temporary_folder.h"

namespace halflight::test {
namespace {

/// Replaces the images of a scene by noise of other sizes: single texels, single rows and columns, sizes that are no
/// multiple of a tile's, and sizes of several tiles. All but the third have 16 bits. Alpha stays above 0.
Scene with_noise(Scene scene) {
    constexpr ivec2 kSizes[] = {{300, 200}, {1, 1}, {16384, 1}, {1, 129}, {64, 64}, {65, 127}, {128, 128}, {517, 131}};
    std::mt19937 random(1);
    for (std::size_t i = 0; i < scene.images.size(); ++i) {
        TextureImage& image = scene.images[i];
        const ivec2 size = kSizes[i % std::size(kSizes)];
        image.width = size.x, image.height = size.y;
        image.deep = i != 2;
        image.rgba.edit().resize(4 * static_cast<std::size_t>(image.pitch()) * static_cast<std::size_t>(size.y));
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
    // Opaque surfaces get a texture of many tiles, none of which tests of alpha or light samples need.
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
    EXPECT_THROW(render(in_tiles, settings, {.bank_shift = 11u}), Error) << "the driver's buffers end before";
}

/// Each step halves the banks, so that the same texels are in other banks.
TEST_F(TiledTextures, TexelsInMemoryMayLieInSeveralBanks) {
    const Scene scene = textured_scene();
    const RenderSettings settings = all_settings(scene, 48, 32, 2);
    const ShadingTables tables = build_shading_tables(scene, build_trace_tables(scene, kFlattenLimit));
    const std::size_t most = std::max(tables.color_texels.size(), tables.data_texels.size());
    const auto one = static_cast<unsigned>(std::bit_width(most - 1));  // one bank holds 2^one texels
    const RenderResult expected = render(scene, settings, {.bank_shift = shared::kMostBankShift});
    for (const unsigned shift : {one, one - 1, one - 2}) {
        SCOPED_TRACE(shift);
        expect_same(render(scene, settings, {.bank_shift = shift}), expected);
    }
    EXPECT_THROW(render(scene, settings, {.bank_shift = one - 3}), Error) << "the driver has 4 texture buffers";
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

std::uint8_t code_of_level(std::size_t level) {
    return static_cast<std::uint8_t>(60 + 20 * level);
}

/// Returns an image of `size` x `size` texels. Level n is grey, of code_of_level(n).
TextureImage numbered_levels(int size) {
    const auto fill = [](TextureImage& image, std::size_t level) {
        image.rgba.edit().assign(4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                                 code_of_level(level));
    };
    TextureImage image{.name = "levels", .width = size, .height = size, .rgba = {}};
    fill(image, 0);
    add_levels(image, {.color = true});
    for (std::size_t l = 0; l < image.color_levels.size(); ++l) fill(image.color_levels[l], l + 1);
    return image;
}

Material unlit_texture() {
    Material m;
    m.unlit = true;
    m.base_color_texture = {.image = 0};
    return m;
}

class TextureLevelChoice : public GpuTest {
  protected:
    /// Returns the level that the picture shows; it must show a single one.
    std::size_t level_seen(const Scene& scene, const Camera& camera, int bounces = 0) {
        std::size_t seen = 99;
        for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
            RenderSettings settings = small_settings(camera, 16, 16, 2, bounces);
            settings.primary = primary;
            const RenderResult result = render(context, scene, settings);
            EXPECT_EQ(result.stats.biases, std::vector<std::string>{"textures: mip levels by ray footprint"});
            const float value = result.beauty.at(7, 8)[0];
            for (std::size_t l = 0; l < 9; ++l)
                if (std::abs(value / srgb_to_linear(code_of_level(l)) - 1) < 0.02) seen = l;
            for (int i = 0; i < 256; ++i) EXPECT_NEAR(result.beauty.at(i % 16, i / 16)[0], value, 1e-3f * value);
        }
        return seen;
    }
    /// Returns a square of 16 units at z = 0 with 512 texels along its edges.
    Scene wall() const {
        Scene scene;
        scene.images = {numbered_levels(512)};
        add_quad(scene, add_material(scene, unlit_texture()), {-8, -8, 0}, {16, 0, 0}, {0, 16, 0});
        return scene;
    }
};

TEST_F(TextureLevelChoice, FollowsTheSizeOfPixels) {
    const Scene scene = wall();
    // Half a pixel of an orthographic camera is `size` texels wide.
    for (const auto& [size, level] :
         {std::pair(0.3, 0u), {1.4, 0u}, {1.9, 0u}, {2.2, 1u}, {3.8, 1u}, {6.0, 2u}, {12.0, 3u}})
        EXPECT_EQ(level_seen(scene, spot_camera({0, 0, 0}, {0, 0, 1}, size)), level) << size;
}

TEST_F(TextureLevelChoice, FollowsAnglesTransformsAndInstances) {
    Scene scene = wall();
    const Camera camera = spot_camera({0, 0, 0}, {0, 0, 1}, 3);  // 3 texels wide
    Camera tilted = spot_camera({0, 0, 0}, {0, 1, 0.4}, 3);
    tilted.camera_to_world[3] += 20.0 * tilted.camera_to_world[2];
    EXPECT_EQ(level_seen(scene, tilted), 2u) << "an area 2.7 times as large";
    scene.materials[0].base_color_texture.uv_transform = glm::mat3x2(vec2(0, 2), vec2(-2, 0), vec2(0));
    EXPECT_EQ(level_seen(scene, camera), 2u) << "texels half as large";
    scene.materials[0].base_color_texture.uv_transform = glm::mat3x2(vec2(0.5f, 0), vec2(0, 0.5f), vec2(0));
    EXPECT_EQ(level_seen(scene, camera), 0u) << "texels twice as large";
    scene = wall();
    scene.instances[0].object_to_world =
        dmat4(dvec4(0.5, 0, 0, 0), dvec4(0, 0.5, 0, 0), dvec4(0, 0, 1, 0), dvec4(0, 0, 0, 1));
    EXPECT_EQ(level_seen(scene, camera), 2u) << "a wall half as large";
    for (const double scale : {1e-9, 1e9}) {
        scene.instances[0].object_to_world = dmat4(dmat3(scale));
        EXPECT_EQ(level_seen(scene, spot_camera({0, 0, 0}, {0, 0, 1}, 3 * scale)), 1u) << scale;
    }
}

TEST_F(TextureLevelChoice, SurfacesWithoutTextureCoordinatesUseLevel0) {
    Scene scene = wall();
    for (vec2& uv : scene.meshes[0].uvs[0]) uv = vec2(0.5f);
    EXPECT_EQ(level_seen(scene, spot_camera({0, 0, 0}, {0, 0, 1}, 6)), 0u);
}

TEST_F(TextureLevelChoice, MirrorsKeepTheCone) {
    // A perspective camera sees, by a mirror one unit away, a wall four units behind the mirror.
    Scene scene;
    scene.images = {numbered_levels(512)};
    add_quad(scene, add_material(scene, metal_material(vec3(1), 0)), {-1, -1, -1}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, add_material(scene, unlit_texture()), {4, -4, 3}, {-8, 0, 0}, {0, 8, 0});
    const Camera camera = look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 2 * std::atan(0.114 * 16 / 10));
    // Half a pixel is 0.0114 of its distance, so 0.057 units on the wall, 3.6 texels; counted from the mirror, it would
    // be 2.9.
    EXPECT_EQ(level_seen(scene, camera, 2), 1u);
    scene.materials[1].base_color_texture.uv_transform = glm::mat3x2(vec2(1.25f, 0), vec2(0, 1.25f), vec2(0));
    EXPECT_EQ(level_seen(scene, camera, 2), 2u) << "4.6 texels; 3.6 from the mirror";
}

TEST_F(TextureLevelChoice, DiffuseRaysUseHigherLevels) {
    Scene scene;
    scene.images = {numbered_levels(512)};
    add_quad(scene, add_material(scene, diffuse_material(vec3(1))), {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
    add_quad(scene, add_material(scene, unlit_texture()), {50, -50, 8}, {-100, 0, 0}, {0, 100, 0});
    for (TextureImage& level : scene.images[0].color_levels)
        if (level.width >= 128) level.rgba.edit().assign(level.rgba.size(), 0);
    scene.images[0].rgba.edit().assign(scene.images[0].rgba.size(), 0);
    RenderSettings settings = small_settings(spot_camera({0, 0, 0}, {0, 0, 1}, 0.1), 16, 16, 16, 2);
    const double textured = mean_radiance(render(context, scene, settings), 0).value;
    EXPECT_GT(textured, 0.9 * srgb_to_linear(code_of_level(3))) << "levels 0 to 2 are black";
}

}  // namespace
}  // namespace halflight::test
