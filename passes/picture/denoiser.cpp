#include "passes/picture/denoiser.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <vector>

#include "engine/core/interruption.h"
#include "engine/gpu/mapping.h"

namespace halflight {
namespace {

using graph::Access;
using graph::TextureHandle;

constexpr int kTile = 32;  // width and height of the tile of a work group of shaders/nl_means.comp, pixels
// Radii of triangle filters, pixels: two boxes of 2 r + 1 pixels are a triangle of radius 2 r.
constexpr int kNoiseRadius = 2, kAroundRadius = 6, kSpreadRadius = 11, kErrorRadius = 14, kPoolRadius = 4;
// Radii of the neighbourhoods that keep their light. Discs of blurred highlights are small.
constexpr int kKeptRadius = 6, kBlurredKeptRadius = 4;
const gpu::Defines kOfPreview = {{"HALFLIGHT_PREVIEW", "1"}};
constexpr std::array kPreviewStrides = {1, 2, 4};  // distances of the pixels that the preview's filters read, pixels
// Small filters with gaps follow the first one, against noise of indirect diffuse light that is wider than its patches.
// Other light has details that they would blur. Each costs a fiftieth of the first one.
constexpr int kSecondStride = 2;             // distance of the pixels that they read, pixels
constexpr std::array kWideStrides = {4, 8};  // of those that leave what is hardly seen
/// Returns the radius of the neighbourhood that tells the noise of filtered light, pixels: noise that was filtered is
/// alike in pixels that are close.
constexpr int noise_radius(int stride) {
    return kNoiseRadius + stride / 2;
}

void dispatch(const gpu::Program& program, const gpu::TextureDesc& picture, int tile = 8) {
    interruption_point();  // a driver on the processor has finished the kernels before
    program.dispatch(static_cast<std::uint32_t>((picture.width + tile - 1) / tile),
                     static_cast<std::uint32_t>((picture.height + tile - 1) / tile));
}

/// Declares a pass that runs a kernel once per pixel. `reads` and `writes` have the kernel's names; the textures that
/// are written are new. Returns them in this order. set: sets uniforms. defines: of the kernel.
template <std::size_t N>
std::array<TextureHandle, N> add_kernel(graph::Graph& graph, const char* pass_name, const char* kernel,
                                        std::initializer_list<std::pair<const char*, TextureHandle>> reads,
                                        const std::array<const char*, N>& writes, int tile = 8,
                                        std::function<void(const gpu::Program&)> set = {},
                                        const gpu::Defines& defines = {}) {
    const gpu::TextureDesc desc = graph.desc(reads.begin()->second);
    graph::Pass pass = graph.add_pass(pass_name);
    for (const auto& [name, texture] : reads) pass.read(texture, Access::texture_read, name);
    std::array<TextureHandle, N> out;
    for (std::size_t i = 0; i < N; ++i)
        out[i] = pass.write(graph.create_texture(writes[i], desc), Access::image_write, writes[i]);
    pass.kernel({kernel, defines});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        if (set) set(program);
        dispatch(program, desc, tile);
    });
    return out;
}

/// Returns the weighted sum of a texture's neighbourhood, by triangles in both directions. Pixels outside count as 0.
TextureHandle add_triangle(graph::Graph& graph, TextureHandle texture, int radius) {
    const gpu::TextureDesc desc = graph.desc(texture);
    for (const ivec2 step : {ivec2(1, 0), ivec2(0, 1)}) {
        graph::Pass pass = graph.add_pass("denoiser: sums");
        pass.read(texture, Access::texture_read, "source");
        texture = pass.write(graph.create_texture("weighted sum", desc), Access::image_write, "sum");
        pass.kernel({"shaders/triangle_sum.comp"});
        pass.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("stride", step);
            program.set("radius", radius);
            dispatch(program, desc);
        });
    }
    return texture;
}

/// Returns the weighted sum by triangles of triangles: blobs without edges, and nearly round.
TextureHandle add_spread(graph::Graph& graph, TextureHandle texture) {
    return add_triangle(graph, add_triangle(graph, texture, kSpreadRadius), kSpreadRadius);
}

/// Returns the sum of the squares of the weights of add_triangle().
float squares_of_triangle(int radius) {
    float row = 0;
    for (int i = -radius; i <= radius; ++i)
        row += static_cast<float>((radius + 1 - std::abs(i)) * (radius + 1 - std::abs(i)));
    row /= static_cast<float>((radius + 1) * (radius + 1)) * static_cast<float>((radius + 1) * (radius + 1));
    return row * row;
}

/// Light of a component without fireflies.
struct CalmLight {
    TextureHandle first, second;  // the members of LightHalves
    TextureHandle spread;         // rgb: light of fireflies over albedo, spread
    bool over_frames = false;     // means over frames; a of `spread` is the share of these means
};

TextureHandle albedo_of(const DenoiserPixels& pixels, FilteredLight component) {
    return component == FilteredLight::glossy ? pixels.glossy_albedo : pixels.diffuse_albedo;
}

/// Returns whether light of fireflies is spread in proportion to the light around. Surfaces beside each other receive
/// alike, but they reflect different things.
bool in_proportion(FilteredLight component) {
    return component == FilteredLight::glossy;
}

/// Properties of the surfaces that a component of light comes from.
struct Guides {
    TextureHandle guide, reflectance;
};
Guides guides_of(const DenoiserPixels& pixels, FilteredLight component) {
    if (component != FilteredLight::glossy || !pixels.glossy_guide) return {pixels.guide, pixels.reflectance};
    return {pixels.glossy_guide, pixels.glossy_reflectance};
}

/// Returns halves without fireflies. in_proportion: their light is spread in proportion to the light around.
CalmLight add_calm(graph::Graph& graph, const LightHalves& own, TextureHandle albedo, bool in_proportion,
                   const gpu::Defines& defines = {}) {
    const auto [mean] = add_kernel<1>(graph, "denoiser: mean", "shaders/half_mean.comp",
                                      {{"first", own.first}, {"second", own.second}}, {"mean"});
    const TextureHandle around = add_triangle(graph, mean, kAroundRadius);
    const auto [outliers] =
        add_kernel<1>(graph, "denoiser: outliers", "shaders/half_outliers.comp",
                      {{"first", own.first}, {"second", own.second}, {"around", around}}, {"outliers"}, 8, {}, defines);
    const auto [first, second, removed, levels] =
        add_kernel<4>(graph, "denoiser: fireflies", "shaders/half_fireflies.comp",
                      {{"first", own.first},
                       {"second", own.second},
                       {"outliers", outliers},
                       {"pooled", add_triangle(graph, outliers, kNoiseRadius)}},
                      {"calm_first", "calm_second", "removed", "levels"});
    using Reads = std::initializer_list<std::pair<const char*, TextureHandle>>;
    const auto run = [&graph](const gpu::Defines& variant, Reads reads) {
        return add_kernel<1>(graph, "denoiser: spread", "shaders/half_spread.comp", reads, {"made"}, 8, {}, variant)[0];
    };
    const TextureHandle receivers =
        in_proportion ? run({{"HALFLIGHT_RECEIVERS", "1"}, {"HALFLIGHT_LEVEL", "1"}},
                            {{"removed", removed},
                             {"albedo", albedo},
                             {"levels", levels},
                             {"few_levels", add_triangle(graph, levels, kNoiseRadius)},
                             {"more_levels", add_triangle(graph, levels, kAroundRadius)},
                             {"around", around}})
                      : run({{"HALFLIGHT_RECEIVERS", "1"}}, {{"removed", removed}, {"albedo", albedo}});
    const TextureHandle quotients =
        run({{"HALFLIGHT_EXCESS", "1"}},
            {{"removed", removed}, {"albedo", albedo}, {"reach", add_spread(graph, receivers)}});
    const TextureHandle spread = add_spread(graph, quotients);
    return {first, second, in_proportion ? run({}, {{"receivers", receivers}, {"quotients", spread}}) : spread};
}

/// Picture whose light tells which noise is seen.
struct Seen {
    TextureHandle surroundings;  // rgb: smoothed picture
    TextureHandle albedo;        // by which the filtered light was divided
};

/// Returns the halves, filtered. small_stride: distance of the pixels of a small window; 0: the large window of final
/// pictures. seen: noise below what is seen there stays; empty: all noise is filtered.
CalmLight add_non_local_means(graph::Graph& graph, const CalmLight& calm, const Guides& guides, int small_stride = 0,
                              const Seen& seen = {}) {
    const auto [noise] = add_kernel<1>(graph, "denoiser: noise", "shaders/half_noise.comp",
                                       {{"first", calm.first}, {"second", calm.second}}, {"noise"});
    const bool limited = bool(seen.surroundings);
    const TextureHandle pooled = add_triangle(graph, noise, limited ? noise_radius(small_stride) : kNoiseRadius);
    const auto variance = [&](std::initializer_list<std::pair<const char*, TextureHandle>> reads) {
        return add_kernel<1>(graph, "denoiser: variance", "shaders/half_variance.comp", reads, {"light"}, 8, {},
                             limited ? gpu::Defines{{"HALFLIGHT_UNSEEN", "1"}} : gpu::Defines())[0];
    };
    const TextureHandle light = limited ? variance({{"first", calm.first},
                                                    {"second", calm.second},
                                                    {"noise", pooled},
                                                    {"surroundings", seen.surroundings},
                                                    {"albedo", seen.albedo}})
                                        : variance({{"first", calm.first}, {"second", calm.second}, {"noise", pooled}});
    const std::pair<const char*, TextureHandle> reads[] = {{"light", light},
                                                           {"first", calm.first},
                                                           {"second", calm.second},
                                                           {"guide", guides.guide},
                                                           {"reflectance", guides.reflectance}};
    const gpu::TextureDesc desc = graph.desc(light);
    graph::Pass pass = graph.add_pass("denoiser: non-local means");
    for (const auto& [name, texture] : reads) pass.read(texture, Access::texture_read, name);
    const TextureHandle first =
        pass.write(graph.create_texture("filtered_first", desc), Access::image_write, "filtered_first");
    const TextureHandle second =
        pass.write(graph.create_texture("filtered_second", desc), Access::image_write, "filtered_second");
    const bool small = small_stride > 0;
    const bool natively = gpu::renders_on_processor();
    if (!natively) pass.kernel({"shaders/nl_means.comp", small ? kOfPreview : gpu::Defines()});
    pass.execute([=, inputs = std::to_array(reads)](graph::Resources& r) {
        if (natively) {
            interruption_point();
            std::array<std::vector<float>, 5> pictures;
            for (std::size_t i = 0; i < pictures.size(); ++i) pictures[i] = r.texture(inputs[i].second).read_float();
            std::vector<float> one(pictures[0].size()), two(pictures[0].size());
            filter_natively(small ? small_means(small_stride) : kFinalMeans, {desc.width, desc.height},
                            {pictures[0], pictures[1], pictures[2], pictures[3], pictures[4]}, {one, two});
            r.texture(first).upload(one);
            r.texture(second).upload(two);
            return;
        }
        const gpu::Program& program = r.kernel();
        if (small) program.set("stride", small_stride);
        dispatch(program, desc, kTile);
    });
    return {first, second, calm.spread, calm.over_frames};
}

/// Returns the terms of the best share of new halves (change_terms() of shaders/lib/halves.glsl), averaged.
TextureHandle add_errors(graph::Graph& graph, const CalmLight& calm, TextureHandle new_first, TextureHandle new_second,
                         TextureHandle albedo, TextureHandle surroundings) {
    const auto [terms] = add_kernel<1>(graph, "denoiser: errors", "shaders/half_errors.comp",
                                       {{"first", calm.first},
                                        {"second", calm.second},
                                        {"filtered_first", new_first},
                                        {"filtered_second", new_second},
                                        {"albedo", albedo},
                                        {"surroundings", surroundings}},
                                       {"terms"});
    return add_triangle(graph, terms, kErrorRadius);
}

/// Returns filtered light with the light that the filter has lost, in each neighbourhood (shaders/half_kept.comp).
/// radius: of the neighbourhoods, pixels.
CalmLight add_kept_light(graph::Graph& graph, const CalmLight& calm, const CalmLight& filtered, TextureHandle albedo,
                         int radius) {
    const auto [light] = add_kernel<1>(graph, "denoiser: kept light", "shaders/half_kept.comp",
                                       {{"first", filtered.first}, {"second", filtered.second}, {"albedo", albedo}},
                                       {"made"}, 8, {}, {{"HALFLIGHT_LIGHT", "1"}});
    const auto [lost] = add_kernel<1>(graph, "denoiser: kept light", "shaders/half_kept.comp",
                                      {{"first", calm.first},
                                       {"second", calm.second},
                                       {"albedo", albedo},
                                       {"light", light},
                                       {"around", add_triangle(graph, light, radius)}},
                                      {"made"}, 8, {}, {{"HALFLIGHT_LOST", "1"}});
    const auto [first, second] = add_kernel<2>(
        graph, "denoiser: kept light", "shaders/half_kept.comp",
        {{"first", filtered.first}, {"second", filtered.second}, {"gains", add_triangle(graph, lost, radius)}},
        {"made", "made_second"});
    return {first, second, filtered.spread, filtered.over_frames};
}

/// Returns light whose halves are means over this frame and its neighbours. surroundings: rgb: smoothed picture.
CalmLight add_neighbours(graph::Graph& graph, const DenoiserPixels& pixels, FilteredLight component,
                         std::span<const DenoiserNeighbour> neighbours, TextureHandle surroundings,
                         const CalmLight& own) {
    CalmLight mean = own;
    int frames = 1;
    for (const DenoiserNeighbour& neighbour : neighbours) {
        const LightHalves& halves = neighbour.pixels.light[static_cast<std::size_t>(component)];
        if (!halves.first) continue;
        const CalmLight other =
            add_calm(graph, halves, albedo_of(neighbour.pixels, component), in_proportion(component));
        const bool mirrored = component == FilteredLight::glossy && neighbour.glossy_motion;
        const auto [place] =
            add_kernel<1>(graph, "denoiser: neighbours", "shaders/neighbour_places.comp",
                          {{"guide", guides_of(pixels, component).guide},
                           {"motion", mirrored ? neighbour.glossy_motion : neighbour.motion},
                           {"motion_back", mirrored ? neighbour.glossy_motion_back : neighbour.motion_back},
                           {"other_guide", guides_of(neighbour.pixels, component).guide}},
                          {"place"});
        ++frames;
        const auto [first, second, spread, differences] =
            add_kernel<4>(graph, "denoiser: neighbours", "shaders/neighbour_light.comp",
                          {{"place", place},
                           {"first", own.first},
                           {"second", own.second},
                           {"other_first", other.first},
                           {"other_second", other.second},
                           {"other_spread", other.spread}},
                          {"near_first", "near_second", "near_spread", "differences"});
        const auto [mean_first, mean_second, mean_spread] =
            add_kernel<3>(graph, "denoiser: neighbours", "shaders/neighbour_add.comp",
                          {{"near_first", first},
                           {"near_second", second},
                           {"near_spread", spread},
                           {"pooled", add_triangle(graph, differences, kPoolRadius)},
                           {"before_first", mean.first},
                           {"before_second", mean.second},
                           {"before_spread", mean.spread}},
                          {"mean_first", "mean_second", "mean_spread"}, 8, [frames](const gpu::Program& program) {
                              program.set("begins", frames == 2);
                              program.set("pooled_squares", squares_of_triangle(kPoolRadius));
                          });
        mean = {mean_first, mean_second, mean_spread};
    }
    if (frames == 1) return own;
    const TextureHandle errors =
        add_errors(graph, own, mean.first, mean.second, albedo_of(pixels, component), surroundings);
    const auto [first, second, spread] = add_kernel<3>(graph, "denoiser: neighbours", "shaders/neighbour_mean.comp",
                                                       {{"first", own.first},
                                                        {"second", own.second},
                                                        {"spread", own.spread},
                                                        {"mean_first", mean.first},
                                                        {"mean_second", mean.second},
                                                        {"mean_spread", mean.spread},
                                                        {"errors", errors}},
                                                       {"steady_first", "steady_second", "steady_spread"});
    return {first, second, spread, true};
}

/// Adds the share of a component to the picture that earlier components have left. surroundings: rgb: smoothed mean.
DenoisedPicture add_component(graph::Graph& graph, const DenoiserPixels& pixels, FilteredLight component,
                              TextureHandle surroundings, std::span<const DenoiserNeighbour> neighbours,
                              const DenoisedPicture& before) {
    const auto index = static_cast<std::size_t>(component);
    const LightHalves& own = pixels.light[index];
    const TextureHandle albedo = albedo_of(pixels, component);
    const CalmLight calm = add_neighbours(graph, pixels, component, neighbours, surroundings,
                                          add_calm(graph, own, albedo, in_proportion(component)));
    const Guides guides = guides_of(pixels, component);
    const bool wide = component == FilteredLight::indirect_diffuse;
    CalmLight means = add_non_local_means(graph, calm, guides);
    if (wide) means = add_non_local_means(graph, means, guides, kSecondStride);
    CalmLight filtered = add_kept_light(graph, calm, means, albedo, pixels.blurred ? kBlurredKeptRadius : kKeptRadius);
    if (wide)
        for (const int stride : kWideStrides)
            filtered = add_non_local_means(graph, filtered, guides, stride, {surroundings, albedo});
    const TextureHandle errors = add_errors(graph, calm, filtered.first, filtered.second, albedo, surroundings);

    const gpu::TextureDesc desc = graph.desc(pixels.mean);
    graph::Pass pass = graph.add_pass("denoiser: blend");
    const std::pair<const char*, TextureHandle> reads[] = {{"first", own.first},
                                                           {"second", own.second},
                                                           {"calm_first", calm.first},
                                                           {"calm_second", calm.second},
                                                           {"filtered_first", filtered.first},
                                                           {"filtered_second", filtered.second},
                                                           {"spread", calm.spread},
                                                           {"errors", errors},
                                                           {"albedo", albedo},
                                                           {"picture_before", before.picture}};
    for (const auto& [name, texture] : reads) pass.read(texture, Access::texture_read, name);
    gpu::Defines defines;
    if (before.weights) {
        pass.read(before.weights, Access::texture_read, "weights_before");
        defines.set("HALFLIGHT_WEIGHTS_BEFORE");
    }
    if (calm.over_frames) defines.set("HALFLIGHT_OVER_FRAMES");
    const DenoisedPicture out{
        pass.write(graph.create_texture("denoised picture", desc), Access::image_write, "picture"),
        pass.write(graph.create_texture("denoiser weights", desc), Access::image_write, "weights")};
    pass.kernel({"shaders/half_blend.comp", defines});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("component", static_cast<int>(component));
        program.set("squares", wide ? squares_of_triangle(kErrorRadius) : 0.0f);
        dispatch(program, desc);
    });
    return out;
}

}  // namespace

DenoiserPixels add_denoiser_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                  graph::TextureHandle beauty, const SampleHalves& samples, const DenoiserPixels& to) {
    const auto run = [=](const gpu::Program& program) {
        program.set("samples", static_cast<std::uint32_t>(samples.all));
        program.set("first_samples", static_cast<std::uint32_t>(samples.first));
        program.set("size", ivec2(band.image.x, std::min(band.rows, band.image.y - band.y)));
        program.set("first_row", band.y);
        program.set("tiles", band.tiles());
        program.dispatch(band.paths() / 64);
    };
    graph::Pass pass = graph.add_pass("denoiser: features");
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
    gpu::Defines chains;
    if (to.glossy_guide) {
        out.glossy_guide = write(pass, to.glossy_guide, "glossy_guide");
        out.glossy_reflectance = write(pass, to.glossy_reflectance, "glossy_reflectance");
        chains.set("HALFLIGHT_SPECULAR_CHAINS");
    }
    pass.kernel({"shaders/half_features.comp", chains});
    pass.execute([=](graph::Resources& r) { run(r.kernel()); });

    for (const FilteredLight component : kFilteredLights) {
        const auto index = static_cast<std::size_t>(component);
        if (!to.light[index].first) continue;
        graph::Pass halves = graph.add_pass("denoiser: halves");
        gpu::Defines defines = chains;
        read_light(halves, defines, sums);
        halves.read(sums.features, Access::storage_read, "Features");
        halves.read(sums.halves, Access::storage_read, "HalfSums");
        out.light[index] = {write(halves, to.light[index].first, "first"),
                            write(halves, to.light[index].second, "second")};
        halves.kernel({"shaders/half_input.comp", defines});
        halves.execute([=](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("component", static_cast<int>(component));
            run(program);
        });
    }
    return out;
}

namespace {

/// Replaces a texture by its part; an empty handle stays.
void take_part(graph::Graph& graph, TextureHandle& texture, const DenoiserWindow& window) {
    if (!texture) return;
    gpu::TextureDesc desc = graph.desc(texture);
    if (window.margin == 0 && window.size == ivec2(desc.width, desc.height)) return;
    desc.width = window.size.x + 2 * window.margin, desc.height = window.size.y;
    graph::Pass pass = graph.add_pass("denoiser: window");
    pass.read(texture, Access::texture_read, "source");
    texture = pass.write(graph.create_texture("part", desc), Access::image_write, "part");
    pass.kernel({"shaders/denoiser_window.comp"});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("corner", window.first);
        program.set("columns", window.size.x);
        program.set("margin", window.margin);
        dispatch(program, desc);
    });
}

}  // namespace

DenoiserPixels add_window(graph::Graph& graph, const DenoiserPixels& pixels, const DenoiserWindow& window) {
    DenoiserPixels part = pixels;
    for (TextureHandle* of : {&part.mean, &part.guide, &part.reflectance, &part.diffuse_albedo, &part.glossy_albedo,
                              &part.glossy_guide, &part.glossy_reflectance})
        take_part(graph, *of, window);
    for (LightHalves& light : part.light) take_part(graph, light.first, window), take_part(graph, light.second, window);
    return part;
}

DenoiserNeighbour add_window(graph::Graph& graph, const DenoiserNeighbour& neighbour, const DenoiserWindow& window) {
    DenoiserNeighbour part = neighbour;
    part.pixels = add_window(graph, neighbour.pixels, window);
    for (TextureHandle* of : {&part.motion, &part.motion_back, &part.glossy_motion, &part.glossy_motion_back})
        take_part(graph, *of, window);
    return part;
}

DenoiserPixels add_lens_blur(graph::Graph& graph, const DenoiserPixels& pixels, const DenoiserBlur& blur) {
    if (blur == DenoiserBlur(0)) return pixels;
    const auto smoothed = [&](TextureHandle before, TextureHandle guide) {
        if (!before) return before;
        return add_kernel<1>(graph, "denoiser: lens", "shaders/half_lens.comp", {{"before", before}, {"guide", guide}},
                             {"after"}, 8, [blur](const gpu::Program& program) { program.set("blur", blur); })[0];
    };
    DenoiserPixels out = pixels;
    out.blurred = true;
    for (TextureHandle* of : {&out.guide, &out.reflectance, &out.diffuse_albedo, &out.glossy_albedo, &out.glossy_guide,
                              &out.glossy_reflectance})
        *of = smoothed(*of, pixels.guide);
    for (const FilteredLight component : kFilteredLights) {
        LightHalves& light = out.light[static_cast<std::size_t>(component)];
        if (!light.first) continue;
        gpu::Defines defines;
        defines.set("HALFLIGHT_LIGHT");
        for (TextureHandle* half : {&light.first, &light.second})
            *half = add_kernel<1>(graph, "denoiser: lens", "shaders/half_lens.comp",
                                  {{"half_before", *half},
                                   {"albedo_before", albedo_of(pixels, component)},
                                   {"albedo_after", albedo_of(out, component)}},
                                  {"after"}, 8, {}, defines)[0];
    }
    return out;
}

FilteredHalves add_preview_filter(graph::Graph& graph, const LightHalves& own, TextureHandle guide,
                                  TextureHandle albedo) {
    CalmLight light = add_calm(graph, own, albedo, false, kOfPreview);
    for (const int stride : kPreviewStrides) light = add_non_local_means(graph, light, {guide, albedo}, stride);
    return {light.first, light.second, light.spread};
}

DenoisedPicture add_denoiser(graph::Graph& graph, const DenoiserPixels& pixels,
                             std::span<const DenoiserNeighbour> neighbours) {
    DenoisedPicture out{pixels.mean, {}};
    const TextureHandle surroundings = add_triangle(graph, pixels.mean, kAroundRadius);
    for (const FilteredLight component : kFilteredLights) {
        if (!pixels.light[static_cast<std::size_t>(component)].first) continue;
        out = add_component(graph, pixels, component, surroundings, neighbours, out);
    }
    return out;
}

}  // namespace halflight
