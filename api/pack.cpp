#include "api/halflight/pack.h"

#include <algorithm>
#include <numeric>

#include "api/halflight/loaded_scene.h"
#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/parts.h"
#include "engine/paging/convert.h"

namespace halflight {
namespace {

/// Returns the sizes of all files together. Throws Error for a file whose animations move geometry.
SceneSize size_of_parts(const std::filesystem::path& scene, const GltfOptions& options) {
    SceneSize all;
    for (const std::filesystem::path& path : scene_parts(scene, options)) {
        GltfScene file(path, options);
        std::vector<std::size_t> playing(file.animations().size());
        std::iota(playing.begin(), playing.end(), std::size_t{0});
        if (file.surfaces_move(playing))
            throw Error(path.string(), "has animations that move more than cameras, which page files cannot hold");
        const SceneSize size = file.size();
        all.texture_bytes += size.texture_bytes;
        all.instance_bytes += size.instance_bytes;
        all.decoding_bytes = std::max(all.decoding_bytes, size.decoding_bytes);
        all.largest_mesh = std::max(all.largest_mesh, size.largest_mesh);
        all.drawn += size.drawn;
    }
    return all;
}

}  // namespace

paging::PageFileSizes pack_scene(const std::filesystem::path& scene, const std::filesystem::path& output,
                                 const PackOptions& options, const Log& log) {
    const GltfOptions gltf = gltf_options(options.allow_outside);
    const SceneSize size = size_of_parts(scene, gltf);
    MemoryLedger& ledger = MemoryLedger::process();
    // The largest mesh is held as read, as placed, and in the copies that reading makes.
    const std::size_t contents = size.texture_bytes + 2 * size.instance_bytes, mesh = 4 * size.largest_mesh;
    ledger.check(contents + std::max(size.decoding_bytes, mesh + paging::kLeastConvertBytes), scene.string(),
                 fmt::format("textures and instances {}, largest mesh {}, conversion at least {}",
                             text_of_bytes(contents), text_of_bytes(mesh), text_of_bytes(paging::kLeastConvertBytes)));
    const MemoryLedger::Entry memory(ledger, MemoryPart::scene, contents + mesh);
    const std::unique_ptr<MeshSource> source = open_parts(scene, gltf);

    constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // more makes conversions no faster
    paging::ConvertOptions convert;
    convert.memory = std::clamp(ledger.free() / 2, paging::kLeastConvertBytes, kMostBytes);
    convert.expected_triangles = size.drawn;
    convert.progress = options.progress;
    const paging::PageFileSizes sizes = paging::convert(*source, output, convert);
    for (const std::string& warning : source->scene().report.warnings) log.warn("{}", warning);
    return sizes;
}

}  // namespace halflight
