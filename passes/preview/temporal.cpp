#include "passes/preview/temporal.h"

#include "engine/graph/execute.h"

#include <tuple>

namespace halflight {

using graph::Access;

PreviewTexels add_temporal(graph::Graph& graph, const PreviewTexels& now, const std::optional<EarlierPicture>& earlier,
                           const PreviewTexels& to, gpu::Buffer& refused) {
    graph::Pass pass = graph.add_pass("preview: temporal accumulation");
    gpu::Defines defines;
    pass.read(now.first, Access::texture_read, "first");
    pass.read(now.second, Access::texture_read, "second");
    pass.read(now.guide, Access::texture_read, "guide");
    pass.read(now.place, Access::texture_read, "place");
    if (earlier) {
        pass.read(earlier->texels.first, Access::texture_read, "earlier_first");
        pass.read(earlier->texels.second, Access::texture_read, "earlier_second");
        pass.read(earlier->texels.guide, Access::texture_read, "earlier_guide");
        pass.read(earlier->texels.place, Access::texture_read, "earlier_place");
        std::ignore = pass.write(graph.import_buffer("refused texels", refused), Access::storage_read_write, "Refused");
        defines.set("HALFLIGHT_HISTORY");
        if (earlier->before) {
            pass.read(earlier->before, Access::texture_read, "before");
            defines.set("HALFLIGHT_MOVED");
        }
    }
    const PreviewTexels out{
        pass.write(to.first, Access::image_write, "to_first"), pass.write(to.second, Access::image_write, "to_second"),
        pass.write(to.guide, Access::image_write, "to_guide"), pass.write(to.place, Access::image_write, "to_place")};
    const gpu::TextureDesc desc = graph.desc(now.first);
    pass.kernel({"shaders/temporal.comp", defines});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        if (earlier) {
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
