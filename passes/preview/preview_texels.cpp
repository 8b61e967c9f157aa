#include "passes/preview/preview_texels.h"

#include <algorithm>

namespace halflight {

using graph::Access;

namespace {

void dispatch(const gpu::Program& program, const gpu::TextureDesc& picture) {
    program.dispatch(static_cast<std::uint32_t>((picture.width + 7) / 8),
                     static_cast<std::uint32_t>((picture.height + 7) / 8));
}

}  // namespace

PreviewPixels add_preview_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                graph::BufferHandle records, graph::TextureHandle beauty, const PreviewSamples& samples,
                                const PreviewPixels& to) {
    graph::Pass pass = graph.add_pass("preview: input");
    gpu::Defines defines;
    read_light(pass, defines, sums);
    pass.read(sums.features, Access::storage_read, "Features");
    pass.read(sums.halves, Access::storage_read, "HalfSums");
    pass.read(beauty, Access::texture_read, "mean");
    const auto write = [&](graph::TextureHandle handle, const char* image) {
        return pass.write(handle, Access::image_write, image);
    };
    PreviewPixels out{
        {write(to.texels.first, "first"), write(to.texels.second, "second"), write(to.texels.guide, "guide")},
        write(to.albedo, "albedo"),
        write(to.beauty, "beauty")};
    if (to.texels.place) {
        pass.read(records, Access::storage_read, "Records");
        out.texels.place = write(to.texels.place, "place");
        defines.set("HALFLIGHT_PLACES");
    }
    const auto stride = static_cast<std::uint32_t>(graph.desc(sums.halves).bytes / (sizeof(double) * band.paths()));
    pass.kernel({"shaders/preview_input.comp", defines});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("samples", static_cast<float>(samples.all));
        program.set("first_samples", static_cast<float>(samples.first));
        program.set("stride", stride);
        program.set("size", ivec2(band.image.x, std::min(band.rows, band.image.y - band.y)));
        program.set("first_row", band.y);
        program.set("tiles", band.tiles());
        program.dispatch(band.paths() / 64);
    });
    return out;
}

LightHalves add_preview_halves(graph::Graph& graph, const PreviewTexels& texels, graph::TextureHandle albedo) {
    const gpu::TextureDesc desc = graph.desc(texels.first);
    graph::Pass pass = graph.add_pass("preview: halves");
    pass.read(texels.first, Access::texture_read, "first");
    pass.read(texels.second, Access::texture_read, "second");
    pass.read(texels.guide, Access::texture_read, "guide");
    pass.read(albedo, Access::texture_read, "albedo");
    const LightHalves out{pass.write(graph.create_texture("first half", desc), Access::image_write, "half_first"),
                          pass.write(graph.create_texture("second half", desc), Access::image_write, "half_second")};
    pass.kernel({"shaders/preview_halves.comp"});
    pass.execute([=](graph::Resources& r) { dispatch(r.kernel(), desc); });
    return out;
}

graph::TextureHandle add_preview_output(graph::Graph& graph, const PreviewPixels& from,
                                        const PreviewTexels& accumulated,
                                        const std::optional<FilteredHalves>& filtered) {
    graph::Pass pass = graph.add_pass("preview: output");
    gpu::Defines defines;
    pass.read(from.beauty, Access::texture_read, "beauty");
    pass.read(from.albedo, Access::texture_read, "albedo");
    pass.read(from.texels.first, Access::texture_read, "first");
    pass.read(from.texels.second, Access::texture_read, "second");
    pass.read(accumulated.first, Access::texture_read, "accumulated_first");
    pass.read(accumulated.second, Access::texture_read, "accumulated_second");
    if (filtered) {
        pass.read(filtered->first, Access::texture_read, "filtered_first");
        pass.read(filtered->second, Access::texture_read, "filtered_second");
        pass.read(filtered->spread, Access::texture_read, "spread");
        defines.set("HALFLIGHT_FILTERED");
    }
    const gpu::TextureDesc desc = graph.desc(from.beauty);
    const graph::TextureHandle picture =
        pass.write(graph.create_texture("preview picture", desc), Access::image_write, "picture");
    pass.kernel({"shaders/preview_output.comp", defines});
    pass.execute([=](graph::Resources& r) { dispatch(r.kernel(), desc); });
    return picture;
}

}  // namespace halflight
