#include "passes/preview/temporal.h"

namespace halflight {

using graph::Access;

PreviewTexels add_temporal(graph::Graph& graph, const PreviewTexels& now, const std::optional<EarlierPicture>& earlier,
                           const PreviewTexels& to, gpu::Buffer& refused) {
    graph::Pass pass = graph.add_pass("temporal accumulation");
    gpu::Defines defines;
    const auto read = [&](const PreviewTexels& t) {
        for (const graph::TextureHandle handle : {t.light, t.guide, t.place}) pass.read(handle, Access::texture_read);
    };
    read(now);
    graph::BufferHandle counts;
    if (earlier) {
        read(earlier->texels);
        counts = pass.write(graph.import_buffer("refused texels", refused), Access::storage_read_write);
        defines.set("HALFLIGHT_HISTORY");
        if (earlier->before) {
            pass.read(earlier->before, Access::texture_read);
            defines.set("HALFLIGHT_MOVED");
        }
    }
    const auto write = [&](graph::TextureHandle handle) { return pass.write(handle, Access::image_write); };
    const PreviewTexels out{write(to.light), write(to.guide), write(to.place)};
    const gpu::TextureDesc desc = graph.desc(now.light);
    pass.execute([=](graph::Resources& r) {
        GLuint unit = 0;
        const auto bind = [&](const PreviewTexels& t) {
            for (const graph::TextureHandle handle : {t.light, t.guide, t.place}) r.texture(handle).bind(unit++);
        };
        bind(now);
        GLuint image = 0;
        for (const graph::TextureHandle handle : {out.light, out.guide, out.place})
            r.texture(handle).bind_image(image++, GL_WRITE_ONLY);
        const gpu::Program& program = r.programs().compute("shaders/temporal.comp", defines);
        if (earlier) {
            bind(earlier->texels);
            if (earlier->before) r.texture(earlier->before).bind(unit);
            r.buffer(counts).bind_storage(0);
            program.set("to_earlier", earlier->to_clip);
            program.set("origin_shift", earlier->origin_shift);
            program.set("earlier_pixel", earlier->pixel);
            program.set("earlier_share", earlier->share);
        }
        program.dispatch(static_cast<std::uint32_t>((desc.width + 7) / 8),
                         static_cast<std::uint32_t>((desc.height + 7) / 8));
    });
    return out;
}

}  // namespace halflight
