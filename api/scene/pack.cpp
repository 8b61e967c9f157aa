#include "api/halflight/pack.h"

#include <algorithm>

#include "api/halflight/loaded_scene.h"
#include "engine/core/error.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/parts.h"
#include "engine/paging/convert.h"
#include "engine/paging/page_file.h"

namespace halflight {
paging::PageFileSizes pack_scene(const std::filesystem::path& scene, const std::filesystem::path& output,
                                 const PackOptions& options, const Log& log) {
    std::error_code none;
    if (std::filesystem::is_regular_file(output, none) && std::filesystem::file_size(output, none) > 0 &&
        !paging::is_page_file(output))
        throw Error(output.string(), "exists and is no page file, so it is kept");
    SceneChoice choice;
    choice.allow_outside = options.allow_outside;
    choice.strict_scene = options.strict;
    GltfOptions gltf = gltf_options(choice);
    gltf.straight_glass = options.straight_glass;
    std::vector<GltfScene> parts = open_files(scene, gltf);
    paging::ConvertOptions convert;
    if (!is_part_list(scene)) convert.driven_materials = parts[0].driven_materials();
    SceneSize size = size_of_parts(parts);
    MemoryLedger& ledger = MemoryLedger::process();
    // Conversions read textures for their alpha alone.
    if (size.texture_bytes + 4 * size.largest_mesh + paging::kLeastConvertBytes > ledger.free())
        gltf.textures = tile_textures(parts, size, 0, true);
    // The largest mesh is held as read, as placed, and in the copies that reading makes.
    const std::size_t contents = size.texture_bytes + size.tile_bytes + 2 * size.instance_bytes,
                      mesh = 4 * size.largest_mesh;
    ledger.check(contents + std::max(size.decoding_bytes, mesh + paging::kLeastConvertBytes), scene.string(),
                 fmt::format("textures and instances {}, largest mesh {}, conversion at least {}",
                             text_of_bytes(contents), text_of_bytes(mesh), text_of_bytes(paging::kLeastConvertBytes)));
    const MemoryLedger::Entry memory(ledger, MemoryPart::scene, contents + mesh);
    const std::unique_ptr<MeshSource> source = open_parts(scene, gltf);

    constexpr std::size_t kMostBytes = std::size_t{1} << 30;  // more makes conversions no faster
    convert.memory = std::clamp(ledger.free() / 2, paging::kLeastConvertBytes, kMostBytes);
    convert.expected_triangles = size.drawn;
    convert.files = contents_of(parts);
    convert.straight_glass = options.straight_glass;
    parts.clear();
    convert.progress = options.progress;
    const paging::PageFileSizes sizes = paging::convert(*source, output, convert);
    for (const std::string& warning : source->report().warnings) log.warn("{}", warning);
    return sizes;
}

}  // namespace halflight
