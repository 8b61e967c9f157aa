#include "engine/tables/shading_textures.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <glm/gtc/packing.hpp>
#include <iterator>
#include <type_traits>

#include "engine/core/error.h"
#include "engine/tables/light_textures.h"
#include "shaders/shared/texture_rows.h"

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

/// Returns level 0 and the further ones, which have other texels in lookups as colour and as data.
std::vector<const TextureImage*> TexturePools::levels_of(int image, bool is_color) const {
    const TextureImage& whole = scene_.images[static_cast<std::size_t>(image)];
    std::vector<const TextureImage*> levels = {&whole};
    for (const TextureImage& level : is_color ? whole.color_levels : whole.data_levels) levels.push_back(&level);
    return levels;
}

TiledTexture TexturePools::tiled(const TextureImage& level, bool is_color, bool pinned) const {
    assert(level.tiles);
    return {level.tiles, {is_color ? level.width : level.pitch(), level.height}, is_color, level.deep, pinned, 0};
}

/// Returns the texels of a level in its pool, or its tiles.
std::uint32_t TexturePools::count_of(const TextureImage& level, bool is_color) const {
    if (!tiles_) return static_cast<std::uint32_t>(level.rgba.size() / (is_color ? level.texel_bytes() : 4));
    const ivec2 count = tiled(level, is_color, false).tile_count();
    return static_cast<std::uint32_t>(count.x) * static_cast<std::uint32_t>(count.y);
}

std::uint32_t TexturePools::first_texel(int image, bool is_color, bool pinned) {
    const auto [found, fresh] = places_.try_emplace({image, is_color}, Place{0, tables_.pooled.size()});
    if (fresh) tables_.pooled.push_back({image, is_color, false});
    tables_.pooled[found->second.pooled].pinned |= pinned;
    if (!fresh) return found->second.first;
    std::uint64_t count = 0;
    for (const TextureImage* level : levels_of(image, is_color)) count += count_of(*level, is_color);
    if (tiles_) {
        found->second.first = static_cast<std::uint32_t>(tile_count_);
        tile_count_ += count;
        constexpr std::uint64_t kMost = std::uint64_t{1} << 31;
        if (tile_count_ > kMost) throw Error(scene_.name, "has textures of more than {} tiles", kMost);
        return found->second.first;
    }
    std::size_t& used = is_color ? color_texels_ : data_texels_;
    const std::size_t first = used;
    used += count;
    constexpr std::size_t kMost = std::size_t{shared::kMostBanks} << shared::kMostBankShift;
    if (used > kMost)
        throw Error(scene_.name, "has textures of more than {} texels of {}", kMost, is_color ? "colour" : "data");
    return found->second.first = static_cast<std::uint32_t>(first);
}

void TexturePools::fill() {
    if (tiles_) {
        std::uint32_t first = 0;
        for (const PooledImage& pooled : tables_.pooled) {
            for (const TextureImage* level : levels_of(pooled.image, pooled.is_color)) {
                tables_.tiled.push_back(tiled(*level, pooled.is_color, pooled.pinned));
                tables_.tiled.back().first_tile = first;
                first += count_of(*level, pooled.is_color);
            }
        }
        return;
    }
    for (const PooledImage& pooled : tables_.pooled) {
        for (const TextureImage* level : levels_of(pooled.image, pooled.is_color)) {
            if (pooled.is_color)
                tables_.color_texels.add(*level);
            else
                tables_.data_texels.add(*level);
        }
    }
}

template <class Channel>
void TexelPool<Channel>::add(const TextureImage& image) {
    if (image.rgba.empty()) return;
    images_[size_] = &image;
    size_ += image.rgba.size() / bytes_of_place(image);
}

template <class Channel>
std::size_t TexelPool<Channel>::bytes_of_place(const TextureImage& image) {
    return std::is_same_v<Channel, std::uint16_t> ? image.texel_bytes() : 4;
}

template <class Channel>
void TexelPool<Channel>::read(std::size_t first, std::span<Texel> texels) const {
    assert(first + texels.size() <= size_);
    auto image = texels.empty() ? images_.end() : std::prev(images_.upper_bound(first));
    std::size_t at = texels.empty() ? 0 : bytes_of_place(*image->second) * (first - image->first);
    for (Texel& texel : texels) {
        if (at == image->second->rgba.size()) ++image, at = 0;
        const std::uint8_t* from = &image->second->rgba[at];
        if constexpr (std::is_same_v<Channel, std::uint16_t>)
            texel = color_halves(image->second->deep).of(*image->second, from);
        else
            texel = {from[0], from[1], from[2], from[3]};
        at += bytes_of_place(*image->second);
    }
}

template class TexelPool<std::uint8_t>;
template class TexelPool<std::uint16_t>;

const ColorHalves& color_halves(bool deep) {
    const auto halves = [](int largest) {
        ColorHalves h;
        for (int i = 0; i <= largest; ++i) {
            h.linear.push_back(glm::packHalf1x16(static_cast<float>(srgb_to_linear(double(i) / largest))));
            h.alpha.push_back(glm::packHalf1x16(static_cast<float>(i) / static_cast<float>(largest)));
        }
        return h;
    };
    static const ColorHalves shallow = halves(255);
    if (!deep) return shallow;
    static const ColorHalves fine = halves(65535);
    return fine;
}

std::uint32_t TexturePools::add(const TextureRef& texture, bool is_color, bool pinned) {
    const std::vector<const TextureImage*> levels = levels_of(texture.image, is_color);
    const bool deep = !is_color && levels[0]->deep;
    const std::uint32_t flags = static_cast<std::uint32_t>(texture.wrap_u) |
                                (static_cast<std::uint32_t>(texture.wrap_v) << shared::kTextureWrapVShift) |
                                (texture.nearest ? shared::kTextureNearest : 0u) |
                                (texture.uv_set == 1 ? shared::kTextureUvSet1 : 0u) |
                                (deep ? shared::kTextureDeep : 0u) |
                                (static_cast<std::uint32_t>(levels.size() - 1) << shared::kTextureLastLevelShift);
    const glm::mat3x2& m = texture.uv_transform;
    std::array<uvec4, shared::kTextureStride> descriptor = {
        uvec4(first_texel(texture.image, is_color, pinned), levels[0]->width, levels[0]->height, flags),
        uvec4(std::bit_cast<std::uint32_t>(m[0].x), std::bit_cast<std::uint32_t>(m[1].x),
              std::bit_cast<std::uint32_t>(m[2].x), 0),
        uvec4(std::bit_cast<std::uint32_t>(m[0].y), std::bit_cast<std::uint32_t>(m[1].y),
              std::bit_cast<std::uint32_t>(m[2].y), 0)};
    SceneNeeds& needs = tables_.needs;
    needs.texture_transforms |= m != TextureRef{}.uv_transform;
    needs.texture_uv_set_1 |= texture.uv_set == 1;
    needs.texture_nearest |= texture.nearest;
    needs.texture_levels |= levels.size() > 1;
    needs.texture_deep |= deep;
    for (const Wrap wrap : {texture.wrap_u, texture.wrap_v}) {
        needs.texture_mirrored |= wrap == Wrap::mirrored_repeat;
        needs.texture_clamped |= wrap == Wrap::clamp_to_edge;
    }

    const std::string key(reinterpret_cast<const char*>(descriptor.data()), sizeof descriptor);
    const auto next = static_cast<std::uint32_t>(tables_.textures.size() / shared::kTextureStride);
    const auto [found, fresh] = descriptors_.try_emplace({key, is_color}, next);
    for (std::size_t l = 0; fresh && l < levels.size(); ++l) {
        descriptor[0].y = static_cast<std::uint32_t>(levels[l]->width);
        descriptor[0].z = static_cast<std::uint32_t>(levels[l]->height);
        tables_.textures.insert(tables_.textures.end(), descriptor.begin(), descriptor.end());
        descriptor[0].x += count_of(*levels[l], is_color);
    }
    return found->second;
}

}  // namespace halflight
