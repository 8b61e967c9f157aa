#include "engine/tables/shading_textures.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <glm/gtc/packing.hpp>

#include "engine/core/error.h"
#include "engine/tables/light_textures.h"
#include "shaders/shared/texture.h"

namespace halflight {

ivec2 TiledTexture::tile_size() const {
    return {1 << (is_color ? shared::kColorTileShift : shared::kDataTileShift), 1 << shared::kTileRowShift};
}

ivec2 TiledTexture::tile_count() const {
    return (size + tile_size() - 1) / tile_size();
}

TexturePools::TexturePools(const Scene& scene, ShadingTables& tables)
    : scene_(scene),
      tables_(tables),
      tiles_(std::ranges::any_of(scene.images, [](const TextureImage& image) { return image.tiles != nullptr; })) {}

TiledTexture TexturePools::tiled(const PooledImage& pooled) const {
    const TextureImage& image = scene_.images[static_cast<std::size_t>(pooled.image)];
    assert(image.tiles);
    return {image.tiles, {image.width, image.height}, pooled.is_color, pooled.pinned, 0};
}

std::uint32_t TexturePools::first_texel(int image, bool is_color, bool pinned) {
    const auto [found, fresh] = places_.try_emplace({image, is_color}, Place{0, tables_.pooled.size()});
    if (fresh) tables_.pooled.push_back({image, is_color, false});
    tables_.pooled[found->second.pooled].pinned |= pinned;
    if (!fresh) return found->second.first;
    if (tiles_) {
        const ivec2 count = tiled(tables_.pooled.back()).tile_count();
        found->second.first = static_cast<std::uint32_t>(tile_count_);
        tile_count_ += static_cast<std::uint64_t>(count.x) * static_cast<std::uint64_t>(count.y);
        constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
        if (tile_count_ > kMost) throw Error(scene_.name, "has textures of more than {} tiles", kMost);
        return found->second.first;
    }
    std::size_t& used = is_color ? color_texels_ : data_texels_;
    const std::size_t first = used;
    used += scene_.images[static_cast<std::size_t>(image)].rgba.size() / 4;
    constexpr std::size_t kMost = std::size_t{shared::kMostBanks} << shared::kMostBankShift;
    if (used > kMost)
        throw Error(scene_.name, "has textures of more than {} texels of {}", kMost, is_color ? "colour" : "data");
    return found->second.first = static_cast<std::uint32_t>(first);
}

void TexturePools::fill() {
    if (tiles_) {
        std::uint32_t first = 0;
        for (const PooledImage& pooled : tables_.pooled) {
            TiledTexture& texture = tables_.tiled.emplace_back(tiled(pooled));
            texture.first_tile = first;
            first += static_cast<std::uint32_t>(texture.tile_count().x * texture.tile_count().y);
        }
        return;
    }
    const auto& [linear, alpha] = color_halves();
    tables_.color_texels.reserve(color_texels_);
    tables_.data_texels.reserve(data_texels_);
    for (const PooledImage& pooled : tables_.pooled) {
        const std::vector<std::uint8_t>& rgba = scene_.images[static_cast<std::size_t>(pooled.image)].rgba;
        for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) {
            if (pooled.is_color)
                tables_.color_texels.push_back(
                    {linear[rgba[i]], linear[rgba[i + 1]], linear[rgba[i + 2]], alpha[rgba[i + 3]]});
            else
                tables_.data_texels.push_back({rgba[i], rgba[i + 1], rgba[i + 2], rgba[i + 3]});
        }
    }
}

const ColorHalves& color_halves() {
    static const ColorHalves halves = [] {
        ColorHalves h;
        for (std::size_t i = 0; i < 256; ++i) {
            h.linear[i] = glm::packHalf1x16(static_cast<float>(srgb_to_linear(static_cast<std::uint8_t>(i))));
            h.alpha[i] = glm::packHalf1x16(static_cast<float>(i) / 255.0f);
        }
        return h;
    }();
    return halves;
}

std::uint32_t TexturePools::add(const TextureRef& texture, bool is_color, bool pinned) {
    const TextureImage& image = scene_.images[static_cast<std::size_t>(texture.image)];
    const std::uint32_t flags = static_cast<std::uint32_t>(texture.wrap_u) |
                                (static_cast<std::uint32_t>(texture.wrap_v) << shared::kTextureWrapVShift) |
                                (texture.nearest ? shared::kTextureNearest : 0u) |
                                (texture.uv_set == 1 ? shared::kTextureUvSet1 : 0u);
    const glm::mat3x2& m = texture.uv_transform;
    const std::array<uvec4, shared::kTextureStride> descriptor = {
        uvec4(first_texel(texture.image, is_color, pinned), image.width, image.height, flags),
        uvec4(std::bit_cast<std::uint32_t>(m[0].x), std::bit_cast<std::uint32_t>(m[1].x),
              std::bit_cast<std::uint32_t>(m[2].x), 0),
        uvec4(std::bit_cast<std::uint32_t>(m[0].y), std::bit_cast<std::uint32_t>(m[1].y),
              std::bit_cast<std::uint32_t>(m[2].y), 0)};
    SceneNeeds& needs = tables_.needs;
    needs.texture_transforms |= m != TextureRef{}.uv_transform;
    needs.texture_uv_set_1 |= texture.uv_set == 1;
    needs.texture_nearest |= texture.nearest;
    for (const Wrap wrap : {texture.wrap_u, texture.wrap_v}) {
        needs.texture_mirrored |= wrap == Wrap::mirrored_repeat;
        needs.texture_clamped |= wrap == Wrap::clamp_to_edge;
    }

    const std::string key(reinterpret_cast<const char*>(descriptor.data()), sizeof descriptor);
    const auto next = static_cast<std::uint32_t>(tables_.textures.size() / shared::kTextureStride);
    const auto [found, fresh] = descriptors_.try_emplace({key, is_color}, next);
    if (fresh) tables_.textures.insert(tables_.textures.end(), descriptor.begin(), descriptor.end());
    return found->second;
}

}  // namespace halflight
