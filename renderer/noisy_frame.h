// A frame as the denoiser reads it. Frames of a sequence are kept for the frames near them, in memory or as files.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/image.h"
#include "engine/device/scene_view.h"
#include "engine/gpu/texture.h"
#include "engine/scene/motion.h"
#include "engine/tables/tables.h"
#include "passes/picture/denoiser.h"
#include "shaders/shared/aov_record.h"
#include "shaders/shared/chain_records.h"

namespace halflight {

/// Textures by the names that they have in files.
using NamedTextures = std::vector<std::pair<std::string, gpu::Texture*>>;

/// Textures of DenoiserPixels.
class DenoiserTextures {
  public:
    /// Components of light that a picture has.
    using Present = std::array<bool, kFilteredLights.size()>;
    /// chains: makes the textures that specular chains fill. Throws Error if the driver has no textures so large.
    DenoiserTextures(const gpu::TextureDesc& desc, const Present& present, bool chains);

    DenoiserPixels import_pixels(graph::Graph& graph);
    NamedTextures named();
    Present present() const;
    bool has_chains() const { return glossy_guide_.has_value(); }
    const gpu::TextureDesc& desc() const { return mean_.desc(); }
    std::size_t bytes() const;

  private:
    struct Halves {
        explicit Halves(const gpu::TextureDesc& desc) : first("first half", desc), second("second half", desc) {}
        gpu::Texture first, second;
    };
    gpu::Texture mean_, guide_, reflectance_, diffuse_albedo_, glossy_albedo_;
    std::optional<gpu::Texture> glossy_guide_, glossy_reflectance_;
    std::array<std::optional<Halves>, kFilteredLights.size()> light_;  // none: the picture has no such light
};

/// The noisy halves of a frame, and the places of its surfaces in other frames. The context must be current when an
/// object is used or destroyed.
class NoisyFrame {
  public:
    std::optional<DenoiserTextures> pixels;
    bool has_halves = false;                // a band has samples in both halves
    DenoiserBlur blur{0};                   // blur by the frame's camera
    ivec2 shown{0};                         // upper left pixel of the picture among those that are rendered
    std::vector<DenoiserWindow> windows{};  // parts that are denoised apart

    /// Adds the surfaces at the centres of a band's pixels. chains: the ends of their specular chains; empty: none.
    void add_places(const Band& band, std::span<const shared::AovRecord> records,
                    std::span<const shared::ChainPlace> chains, const TraceTables& tables);
    /// Makes the motion to the frame that is `offset` frames later. surfaces: those of that frame, matched with those
    /// of this frame; null: none has moved. Call it after all add_places().
    void add_motion(int offset, const Camera& own, const Camera& other, const PreviousSurfaces* surfaces);
    /// Frees what only add_motion() needs.
    void finish() { places_ = {}, mirrored_ = {}; }
    /// Makes textures of motion to other frames, for named() to fill.
    void reserve_motion(const ivec2& size, std::span<const int> offsets, std::span<const int> glossy_offsets);
    /// Returns the textures of pixels and motion.
    NamedTextures named();
    /// Returns the offsets of the frames to which there is motion. glossy: motion of what glossy light shows.
    std::vector<int> offsets(bool glossy) const;

    /// Returns the motion to the frame that is `offset` frames later; null: none was made.
    gpu::Texture* motion(int offset);
    /// Returns the motion of what glossy light shows; null: there are no specular chains.
    gpu::Texture* glossy_motion(int offset);
    std::size_t bytes() const;

    /// Bytes per pixel that add_places() and add_motion() take until finish().
    static constexpr std::size_t kPlaceBytes = sizeof(dvec3) + 2 * sizeof(std::uint32_t) + sizeof(vec4);
    /// Bytes per pixel that the ends of specular chains add to kPlaceBytes.
    static constexpr std::size_t kMirroredBytes =
        2 * sizeof(dvec3) + sizeof(mat3) + sizeof(vec3) + 4 * sizeof(std::uint32_t);

  private:
    struct Place {
        dvec3 position{0};           // world units
        std::uint32_t object = 0;    // index of the instance in the scene, from 1; 0: no surface
        std::uint32_t triangle = 0;  // index in the mesh
    };
    /// The end of a specular chain.
    struct Mirrored {
        Place place;
        dvec3 seen{0};         // place at which the surface appears, world units
        mat3 turned{1};        // motion of `seen` for a motion of the place
        vec3 facet{0};         // normal of the mirror if there is just one, else 0
        bool follows = false;  // false: there is no chain
    };
    static_assert(sizeof(Mirrored) <= kMirroredBytes);
    /// Returns the curvature of the surface at a pixel with a facet, from the pixels beside it, per world unit. It is
    /// positive where the surface is convex.
    double curvature(int x, int y) const;
    Image motion_image(const Camera& own, const Camera& other, const PreviousSurfaces* surfaces, bool mirrored) const;

    ivec2 size_{0};
    std::vector<Place> places_;                           // by pixel, row by row
    std::vector<Mirrored> mirrored_;                      // by pixel; empty without specular chains
    std::map<int, gpu::Texture> motion_, glossy_motion_;  // by offset
};

/// A frame near the one that is denoised.
struct NearFrame {
    int offset = 0;  // frames after the frame that is denoised
    NoisyFrame* frame = nullptr;
};

}  // namespace halflight
