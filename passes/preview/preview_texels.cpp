#include "passes/preview/preview_texels.h"

#include <algorithm>

namespace halflight {

using graph::Access;

PreviewPixels add_preview_input(graph::Graph& graph, const Band& band, const Accumulated& sums,
                                graph::BufferHandle records, graph::TextureHandle beauty, int samples,
                                const PreviewPixels& to) {
    graph::Pass pass = graph.add_pass("preview input");
    gpu::Defines defines;
    read_light(pass, defines, sums);
    pass.read(sums.squares, Access::storage_read, "Squares");
    pass.read(sums.features, Access::storage_read, "Features");
    pass.read(records, Access::storage_read, "Records");
    pass.read(beauty, Access::texture_read, "mean");
    const auto write = [&](graph::TextureHandle handle, const char* image) {
        return pass.write(handle, Access::image_write, image);
    };
    const PreviewPixels out{
        {write(to.texels.light, "light"), write(to.texels.guide, "guide"), write(to.texels.place, "place")},
        write(to.albedo, "albedo"),
        write(to.beauty, "beauty")};
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.compute("shaders/preview_input.comp", defines);
        program.set("samples", static_cast<std::uint32_t>(samples));
        program.set("size", ivec2(band.image.x, std::min(band.rows, band.image.y - band.y)));
        program.set("first_row", band.y);
        program.set("tiles", band.tiles());
        program.dispatch(band.paths() / 64);
    });
    return out;
}

graph::TextureHandle add_preview_output(graph::Graph& graph, const PreviewPixels& from,
                                        graph::TextureHandle accumulated, graph::TextureHandle filtered) {
    graph::Pass pass = graph.add_pass("preview output");
    gpu::Defines defines;
    pass.read(from.beauty, Access::texture_read, "beauty");
    pass.read(from.albedo, Access::texture_read, "albedo");
    pass.read(from.texels.light, Access::texture_read, "light");
    pass.read(from.texels.place, Access::texture_read, "place");
    pass.read(accumulated, Access::texture_read, "accumulated");
    if (filtered) {
        pass.read(filtered, Access::texture_read, "filtered");
        defines.set("HALFLIGHT_FILTERED");
    }
    const gpu::TextureDesc desc = graph.desc(from.beauty);
    const graph::TextureHandle picture =
        pass.write(graph.create_texture("preview picture", desc), Access::image_write, "picture");
    pass.execute([=](graph::Resources& r) {
        r.compute("shaders/preview_output.comp", defines)
            .dispatch(static_cast<std::uint32_t>((desc.width + 7) / 8),
                      static_cast<std::uint32_t>((desc.height + 7) / 8));
    });
    return picture;
}

}  // namespace halflight
