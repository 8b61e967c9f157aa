// Joint non-local means with two half buffers (Rousselle, Manzi, Zwicker 2013, Robust Denoising using Feature and Color
// Information): for final pictures, and in a cheap form for previews.
//
// Direct diffuse, indirect diffuse and glossy light are filtered apart, each divided by its albedo. The weights of one
// half of the samples filter the other half. Fireflies are spread over their neighbourhood instead of clamped. Where
// the halves show that the filter is wrong, the picture stays the mean of the samples, to which it converges. Emission
// and directly visible environment are not filtered.
//
// In sequences, the halves of frames before and after are moved along the motion of surfaces and averaged with those of
// the frame, before they are filtered. Pixels of surfaces that a neighbour does not show take nothing from it.
//
// Glossy light has the properties, albedo and motion of the surfaces that mirrors and clear glass show (specular
// chains).
#pragma once

#include <array>
#include <span>

#include "engine/settings/denoiser_windows.h"
#include "passes/picture/native_means.h"
#include "passes/steps/halves.h"
#include "passes/steps/sums.h"

namespace halflight {

/// Component of light that is filtered apart from the others.
enum class FilteredLight { direct_diffuse, indirect_diffuse, glossy };
inline constexpr std::array kFilteredLights = {FilteredLight::direct_diffuse, FilteredLight::indirect_diffuse,
                                               FilteredLight::glossy};

/// Peak number of bytes per pixel: textures of DenoiserPixels, transients, and the picture with its weights.
inline constexpr std::size_t kDenoiserPixelBytes =
    (5 + 2 * kFilteredLights.size() + 12) * sizeof(vec4) + kNativeMeansBytes;
/// Peak number of bytes per pixel that a denoised frame with neighbours takes on top: its motion, and transients.
inline constexpr std::size_t kDenoiserNeighbourBytes = (8 + 12) * sizeof(vec4);
/// Bytes per pixel of the textures that specular chains add to DenoiserPixels.
inline constexpr std::size_t kDenoiserChainBytes = 2 * sizeof(vec4);
/// Peak number of bytes per pixel and frame that depth of field takes on top: properties and halves of add_lens_blur().
inline constexpr std::size_t kDenoiserLensBytes = (6 + 2 * kFilteredLights.size()) * sizeof(vec4);
/// Bytes per pixel of the copies that add_window() makes of a frame, at most; with motion, of a neighbour.
inline constexpr std::size_t kDenoiserWindowBytes = (7 + 2 * kFilteredLights.size()) * sizeof(vec4);
inline constexpr std::size_t kDenoiserWindowMotionBytes = 4 * sizeof(vec4);
/// Returns the bytes per pixel of a neighbour's textures: DenoiserPixels, and motion to `frames` other frames.
constexpr std::size_t denoiser_frame_bytes(int frames) {
    return (5 + 2 * kFilteredLights.size() + std::size_t(frames)) * sizeof(vec4);
}

/// RGBA32F textures of the whole picture. Means of surface properties are means over the samples that meet a surface.
struct DenoiserPixels {
    graph::TextureHandle mean;            // the picture
    graph::TextureHandle guide;           // xyz: mean of shading normals; w: mean of ln(depth)
    graph::TextureHandle reflectance;     // rgb: mean albedo of all lobes
    graph::TextureHandle diffuse_albedo;  // rgb: albedo by which diffuse light is divided
    graph::TextureHandle glossy_albedo;   // rgb: albedo by which glossy light is divided
    std::array<LightHalves, kFilteredLights.size()> light{};
    // `guide` and `reflectance` of glossy light, at the ends of specular chains. The alpha of the latter is the mean
    // number of bounces of the chains. Empty: those above serve.
    graph::TextureHandle glossy_guide{}, glossy_reflectance{};
    bool blurred = false;  // depth of field has blurred the surfaces
};

/// Circles of confusion of a camera with depth of field. The radius at a depth is |x + y / depth + z depth| pixels; 0:
/// a pinhole.
using DenoiserBlur = vec3;

/// Numbers of samples of a band.
struct SampleHalves {
    int all = 0;
    int first = 0;  // number of samples in the first half
};

/// Fills the rows of a band and returns the next versions of `to`, textures of the whole picture. `sums` has features
/// and halves. beauty: mean of the band.
DenoiserPixels add_denoiser_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                  graph::TextureHandle beauty, const SampleHalves& samples, const DenoiserPixels& to);

/// A frame near the one that is denoised.
struct DenoiserNeighbour {
    DenoiserPixels pixels;  // `mean` is not used
    // Motion of surfaces between the centres of pixels, RGBA32F. xy: pixels, x right, y down; z: change of ln(depth);
    // w: number of the object, from 1; 0: no surface.
    graph::TextureHandle motion;       // from the frame that is denoised to this one
    graph::TextureHandle motion_back;  // from this one to the frame that is denoised
    // Motion of what glossy light shows. Empty: that of the surfaces serves.
    graph::TextureHandle glossy_motion{}, glossy_motion_back{};
};

/// Returns the part of a picture that is denoised as a whole. A part that is the whole has no copy.
DenoiserPixels add_window(graph::Graph& graph, const DenoiserPixels& pixels, const DenoiserWindow& window);
DenoiserNeighbour add_window(graph::Graph& graph, const DenoiserNeighbour& neighbour, const DenoiserWindow& window);

/// Returns the pixels of a picture with depth of field as add_denoiser() needs them: properties of blurred surfaces are
/// smoothed (shaders/half_lens.comp), and `blurred` is set. Those of a pinhole are returned as they are.
DenoiserPixels add_lens_blur(graph::Graph& graph, const DenoiserPixels& pixels, const DenoiserBlur& blur);

struct DenoisedPicture {
    graph::TextureHandle picture;  // RGBA32F
    graph::TextureHandle weights;  // rgb: share of the filtered light, [0,1], by FilteredLight; the rest is the mean
};
/// Returns the denoised picture. Pixels without reflected light equal the mean, bit for bit.
DenoisedPicture add_denoiser(graph::Graph& graph, const DenoiserPixels& pixels,
                             std::span<const DenoiserNeighbour> neighbours = {});

/// Peak number of bytes per pixel of the transients of add_preview_filter().
inline constexpr std::size_t kPreviewFilterBytes = 8 * sizeof(vec4) + kNativeMeansBytes;
/// Filters light over albedo for a preview, with patches of 3x3 pixels. Three filters of 5x5 pixels follow each other,
/// 1, 2 and 4 pixels apart, which reaches 14 pixels. guide, albedo: as in DenoiserPixels, with alpha 1 on surfaces.
FilteredHalves add_preview_filter(graph::Graph& graph, const LightHalves& own, graph::TextureHandle guide,
                                  graph::TextureHandle albedo);

}  // namespace halflight
