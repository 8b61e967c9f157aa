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
    pass.read(sums.squares, Access::storage_read);
    pass.read(sums.features, Access::storage_read);
    pass.read(records, Access::storage_read);
    pass.read(beauty, Access::texture_read);
    const auto write = [&](graph::TextureHandle handle) { return pass.write(handle, Access::image_write); };
    const PreviewPixels out{
        {write(to.texels.light), write(to.texels.guide), write(to.texels.place)}, write(to.albedo), write(to.beauty)};
    pass.execute([=](graph::Resources& r) {
        bind_light(r, sums);
        r.buffer(sums.squares).bind_storage(3);
        r.buffer(sums.features).bind_storage(4);
        r.buffer(records).bind_storage(5);
        r.texture(beauty).bind(0);
        GLuint image = 0;
        for (const graph::TextureHandle handle :
             {out.texels.light, out.texels.guide, out.texels.place, out.albedo, out.beauty})
            r.texture(handle).bind_image(image++, GL_WRITE_ONLY);
        const gpu::Program& program = r.programs().compute("shaders/preview_input.comp", defines);
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
    for (const graph::TextureHandle handle :
         {from.beauty, from.albedo, from.texels.light, from.texels.place, accumulated})
        pass.read(handle, Access::texture_read);
    if (filtered) {
        pass.read(filtered, Access::texture_read);
        defines.set("HALFLIGHT_FILTERED");
    }
    const gpu::TextureDesc desc = graph.desc(from.beauty);
    const graph::TextureHandle picture = pass.write(graph.create_texture("preview picture", desc), Access::image_write);
    pass.execute([=](graph::Resources& r) {
        GLuint unit = 0;
        for (const graph::TextureHandle handle :
             {from.beauty, from.albedo, from.texels.light, from.texels.place, accumulated})
            r.texture(handle).bind(unit++);
        if (filtered) r.texture(filtered).bind(unit);
        r.texture(picture).bind_image(0, GL_WRITE_ONLY);
        r.programs()
            .compute("shaders/preview_output.comp", defines)
            .dispatch(static_cast<std::uint32_t>((desc.width + 7) / 8),
                      static_cast<std::uint32_t>((desc.height + 7) / 8));
    });
    return picture;
}

}  // namespace halflight
