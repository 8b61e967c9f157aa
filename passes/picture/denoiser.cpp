#include "passes/picture/denoiser.h"

#include <algorithm>

namespace halflight {
namespace {

using graph::Access;
using graph::TextureHandle;

constexpr int kTile = 32;  // width and height of the tile of a work group of shaders/nl_means.comp, pixels
// Radii of triangle filters, pixels: two boxes of 2 r + 1 pixels are a triangle of radius 2 r.
constexpr int kNoiseRadius = 2, kAroundRadius = 6, kSpreadRadius = 16, kErrorRadius = 14;

void dispatch(const gpu::Program& program, const gpu::TextureDesc& picture, int tile = 8) {
    program.dispatch(static_cast<std::uint32_t>((picture.width + tile - 1) / tile),
                     static_cast<std::uint32_t>((picture.height + tile - 1) / tile));
}

/// Declares a pass that runs a kernel once per pixel. `reads` and `writes` have the kernel's names; the textures that
/// are written are new. Returns them in this order.
template <std::size_t N>
std::array<TextureHandle, N> add_kernel(graph::Graph& graph, const char* pass_name, const char* kernel,
                                        std::initializer_list<std::pair<const char*, TextureHandle>> reads,
                                        const std::array<const char*, N>& writes, int tile = 8) {
    const gpu::TextureDesc desc = graph.desc(reads.begin()->second);
    graph::Pass pass = graph.add_pass(pass_name);
    for (const auto& [name, texture] : reads) pass.read(texture, Access::texture_read, name);
    std::array<TextureHandle, N> out;
    for (std::size_t i = 0; i < N; ++i)
        out[i] = pass.write(graph.create_texture(writes[i], desc), Access::image_write, writes[i]);
    pass.execute([=](graph::Resources& r) { dispatch(r.compute(kernel), desc, tile); });
    return out;
}

/// Returns the weighted sum of a texture's neighbourhood, by triangles in both directions. Pixels outside count as 0.
TextureHandle add_triangle(graph::Graph& graph, TextureHandle texture, int radius) {
    const gpu::TextureDesc desc = graph.desc(texture);
    for (const ivec2 step : {ivec2(1, 0), ivec2(0, 1)}) {
        graph::Pass pass = graph.add_pass("denoiser sums");
        pass.read(texture, Access::texture_read, "source");
        texture = pass.write(graph.create_texture("weighted sum", desc), Access::image_write, "sum");
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.compute("shaders/triangle_sum.comp");
            program.set("stride", step);
            program.set("radius", radius);
            dispatch(program, desc);
        });
    }
    return texture;
}

/// Inputs of a component that depend on surfaces alone.
struct Surroundings {
    TextureHandle picture;  // rgb: smoothed mean
    TextureHandle albedo;   // rgb: albedo by which the light is divided
    TextureHandle reach;    // rgb: weighted sum of the albedo of the pixels over which the light of fireflies is spread
};

/// Adds the share of a component to the picture that earlier components have left.
DenoisedPicture add_component(graph::Graph& graph, const DenoiserPixels& pixels, FilteredLight component,
                              const Surroundings& surroundings, const DenoisedPicture& before) {
    const LightHalves& own = pixels.light[static_cast<std::size_t>(component)];
    const auto [mean] = add_kernel<1>(graph, "denoiser mean", "shaders/half_mean.comp",
                                      {{"first", own.first}, {"second", own.second}}, {"mean"});
    const TextureHandle around = add_triangle(graph, mean, kAroundRadius);
    const auto [outliers] =
        add_kernel<1>(graph, "denoiser outliers", "shaders/half_outliers.comp",
                      {{"first", own.first}, {"second", own.second}, {"around", around}}, {"outliers"});
    const auto [first, second, excess] = add_kernel<3>(graph, "denoiser fireflies", "shaders/half_fireflies.comp",
                                                       {{"first", own.first},
                                                        {"second", own.second},
                                                        {"outliers", outliers},
                                                        {"pooled", add_triangle(graph, outliers, kNoiseRadius)},
                                                        {"albedo", surroundings.albedo},
                                                        {"reach", surroundings.reach}},
                                                       {"calm_first", "calm_second", "excess"});
    const TextureHandle spread = add_triangle(graph, excess, kSpreadRadius);
    const auto [noise] = add_kernel<1>(graph, "denoiser noise", "shaders/half_noise.comp",
                                       {{"first", first}, {"second", second}}, {"noise"});
    const auto [light] = add_kernel<1>(
        graph, "denoiser variance", "shaders/half_variance.comp",
        {{"first", first}, {"second", second}, {"noise", add_triangle(graph, noise, kNoiseRadius)}}, {"light"});
    const auto [filtered_first, filtered_second] = add_kernel<2>(graph, "non-local means", "shaders/nl_means.comp",
                                                                 {{"light", light},
                                                                  {"first", first},
                                                                  {"second", second},
                                                                  {"guide", pixels.guide},
                                                                  {"reflectance", pixels.reflectance}},
                                                                 {"filtered_first", "filtered_second"}, kTile);
    const auto [terms] = add_kernel<1>(graph, "denoiser errors", "shaders/half_errors.comp",
                                       {{"first", first},
                                        {"second", second},
                                        {"filtered_first", filtered_first},
                                        {"filtered_second", filtered_second},
                                        {"albedo", surroundings.albedo},
                                        {"surroundings", surroundings.picture}},
                                       {"terms"});
    const TextureHandle errors = add_triangle(graph, terms, kErrorRadius);

    const gpu::TextureDesc desc = graph.desc(pixels.mean);
    graph::Pass pass = graph.add_pass("denoiser blend");
    const std::pair<const char*, TextureHandle> reads[] = {{"first", own.first},
                                                           {"second", own.second},
                                                           {"calm_first", first},
                                                           {"calm_second", second},
                                                           {"filtered_first", filtered_first},
                                                           {"filtered_second", filtered_second},
                                                           {"spread", spread},
                                                           {"errors", errors},
                                                           {"albedo", surroundings.albedo},
                                                           {"picture_before", before.picture}};
    for (const auto& [name, texture] : reads) pass.read(texture, Access::texture_read, name);
    gpu::Defines defines;
    if (before.weights) {
        pass.read(before.weights, Access::texture_read, "weights_before");
        defines.set("HALFLIGHT_WEIGHTS_BEFORE");
    }
    const DenoisedPicture out{
        pass.write(graph.create_texture("denoised picture", desc), Access::image_write, "picture"),
        pass.write(graph.create_texture("denoiser weights", desc), Access::image_write, "weights")};
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.compute("shaders/half_blend.comp", defines);
        program.set("component", static_cast<int>(component));
        dispatch(program, desc);
    });
    return out;
}

}  // namespace

DenoiserPixels add_denoiser_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                  graph::TextureHandle beauty, const SampleHalves& samples, const DenoiserPixels& to) {
    const auto run = [=](graph::Resources& r, const char* kernel, const gpu::Defines& defines) {
        const gpu::Program& program = r.compute(kernel, defines);
        program.set("samples", static_cast<std::uint32_t>(samples.all));
        program.set("first_samples", static_cast<std::uint32_t>(samples.first));
        program.set("size", ivec2(band.image.x, std::min(band.rows, band.image.y - band.y)));
        program.set("first_row", band.y);
        program.set("tiles", band.tiles());
        program.dispatch(band.paths() / 64);
    };
    graph::Pass pass = graph.add_pass("denoiser features");
    const auto write = [&](graph::Pass& by, TextureHandle handle, const char* image) {
        return by.write(handle, Access::image_write, image);
    };
    pass.read(sums.emission, Access::storage_read, "Emission");
    pass.read(sums.features, Access::storage_read, "Features");
    pass.read(sums.halves, Access::storage_read, "HalfSums");
    pass.read(beauty, Access::texture_read, "beauty");
    DenoiserPixels out{write(pass, to.mean, "mean"), write(pass, to.guide, "guide"),
                       write(pass, to.reflectance, "reflectance"), write(pass, to.diffuse_albedo, "diffuse_albedo"),
                       write(pass, to.glossy_albedo, "glossy_albedo")};
    pass.execute([=](graph::Resources& r) { run(r, "shaders/half_features.comp", {}); });

    for (const FilteredLight component : kFilteredLights) {
        const auto index = static_cast<std::size_t>(component);
        if (!to.light[index].first) continue;
        graph::Pass halves = graph.add_pass("denoiser halves");
        gpu::Defines defines;
        read_light(halves, defines, sums);
        halves.read(sums.features, Access::storage_read, "Features");
        halves.read(sums.halves, Access::storage_read, "HalfSums");
        out.light[index] = {write(halves, to.light[index].first, "first"),
                            write(halves, to.light[index].second, "second")};
        halves.execute([=](graph::Resources& r) {
            r.compute("shaders/half_input.comp", defines).set("component", static_cast<int>(component));
            run(r, "shaders/half_input.comp", defines);
        });
    }
    return out;
}

DenoisedPicture add_denoiser(graph::Graph& graph, const DenoiserPixels& pixels) {
    DenoisedPicture out{pixels.mean, {}};
    Surroundings around{add_triangle(graph, pixels.mean, kAroundRadius), {}, {}};
    for (const FilteredLight component : kFilteredLights) {
        const LightHalves& own = pixels.light[static_cast<std::size_t>(component)];
        if (!own.first) continue;
        const TextureHandle albedo = component == FilteredLight::glossy ? pixels.glossy_albedo : pixels.diffuse_albedo;
        if (around.albedo != albedo) {
            around.albedo = albedo;
            const auto [reflected] = add_kernel<1>(graph, "denoiser albedo", "shaders/half_albedo.comp",
                                                   {{"first", own.first}, {"albedo", albedo}}, {"reflected"});
            around.reach = add_triangle(graph, reflected, kSpreadRadius);
        }
        out = add_component(graph, pixels, component, around, out);
    }
    return out;
}

}  // namespace halflight
