#include "engine/tables/shading_textures.h"

#include <bit>
#include <glm/gtc/packing.hpp>

#include "engine/core/error.h"
#include "engine/tables/light_textures.h"
#include "shaders/shared/texture.h"

namespace halflight {

std::uint32_t TexturePools::first_texel(int image, bool is_color) {
    const auto [found, fresh] = first_texels_.try_emplace({image, is_color}, 0);
    if (!fresh) return found->second;
    std::size_t& used = is_color ? color_texels_ : data_texels_;
    const std::size_t first = used;
    used += scene_.images[static_cast<std::size_t>(image)].rgba.size() / 4;
    constexpr std::size_t kMost = std::size_t{shared::kMostBanks} << shared::kMostBankShift;
    if (used > kMost)
        throw Error(scene_.name, "has textures of more than {} texels of {}", kMost, is_color ? "colour" : "data");
    tables_.pooled.push_back({image, is_color});
    return found->second = static_cast<std::uint32_t>(first);
}

void TexturePools::fill() {
    std::array<std::uint16_t, 256> linear;
    std::array<std::uint16_t, 256> alpha;
    for (std::size_t i = 0; i < 256; ++i) {
        linear[i] = glm::packHalf1x16(static_cast<float>(srgb_to_linear(static_cast<std::uint8_t>(i))));
        alpha[i] = glm::packHalf1x16(static_cast<float>(i) / 255.0f);
    }
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

std::uint32_t TexturePools::add(const TextureRef& texture, bool is_color) {
    const TextureImage& image = scene_.images[static_cast<std::size_t>(texture.image)];
    const std::uint32_t flags = static_cast<std::uint32_t>(texture.wrap_u) |
                                (static_cast<std::uint32_t>(texture.wrap_v) << shared::kTextureWrapVShift) |
                                (texture.nearest ? shared::kTextureNearest : 0u) |
                                (texture.uv_set == 1 ? shared::kTextureUvSet1 : 0u);
    const glm::mat3x2& m = texture.uv_transform;
    const std::array<uvec4, shared::kTextureStride> descriptor = {
        uvec4(first_texel(texture.image, is_color), image.width, image.height, flags),
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
