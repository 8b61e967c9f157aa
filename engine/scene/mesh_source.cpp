#include "engine/scene/mesh_source.h"

#include <algorithm>
#include <utility>

#include "engine/scene/material_properties.h"

namespace halflight {

namespace {

Mesh with_materials_after(std::size_t first, Mesh mesh) {
    for (std::uint32_t& material : mesh.triangle_material) material += static_cast<std::uint32_t>(first);
    return mesh;
}

}  // namespace

void add_report(SceneReport& to, const SceneReport& more) {
    to.warnings.insert(to.warnings.end(), more.warnings.begin(), more.warnings.end());
    to.non_finite_triangles_dropped += more.non_finite_triangles_dropped;
    to.degenerate_triangles_dropped += more.degenerate_triangles_dropped;
    to.normals_generated += more.normals_generated;
    to.tangents_generated += more.tangents_generated;
    to.point_primitives_skipped += more.point_primitives_skipped;
    to.line_primitives_skipped += more.line_primitives_skipped;
    to.points_drawn += more.points_drawn;
    to.line_segments_drawn += more.line_segments_drawn;
    to.environment_texels_repaired += more.environment_texels_repaired;
}

JoinedScenes::JoinedScenes(std::string name, std::vector<std::unique_ptr<MeshSource>> parts) {
    scene_.name = std::move(name);
    for (std::unique_ptr<MeshSource>& source : parts) {
        const Scene& part = source->scene();
        const auto images = static_cast<int>(scene_.images.size()), meshes = static_cast<int>(scene_.meshes.size());
        const std::size_t materials = scene_.materials.size();
        scene_.images.insert(scene_.images.end(), part.images.begin(), part.images.end());
        for (Material material : part.materials) {
            for (const MaterialTexture& texture : material_textures())
                if (TextureRef& t = material.*texture.field) t.image += images;
            scene_.materials.push_back(std::move(material));
        }
        scene_.meshes.insert(scene_.meshes.end(), part.meshes.begin(), part.meshes.end());
        for (Instance instance : part.instances) {
            instance.mesh += meshes;
            scene_.instances.push_back(std::move(instance));
        }
        for (PunctualLight light : part.lights) {
            if (light.profile != kNone) light.profile += static_cast<int>(scene_.light_profiles.size());
            scene_.lights.push_back(std::move(light));
        }
        scene_.light_profiles.insert(scene_.light_profiles.end(), part.light_profiles.begin(),
                                     part.light_profiles.end());
        scene_.cameras.insert(scene_.cameras.end(), part.cameras.begin(), part.cameras.end());
        if (scene_.environment.black()) scene_.environment = part.environment;
        parts_.push_back({std::move(source), static_cast<std::size_t>(meshes), materials});
    }
}

const JoinedScenes::Part& JoinedScenes::part_of(std::size_t mesh) const {
    return *(std::ranges::upper_bound(parts_, mesh, {}, &Part::first_mesh) - 1);
}

Mesh JoinedScenes::read(std::size_t mesh) {
    const Part& part = part_of(mesh);
    return with_materials_after(part.first_material, part.source->read(mesh - part.first_mesh));
}

Mesh JoinedScenes::all_parts(std::size_t mesh) {
    const Part& part = part_of(mesh);
    return with_materials_after(part.first_material, part.source->all_parts(mesh - part.first_mesh));
}

std::vector<VersionedFile> JoinedScenes::files() const {
    std::vector<VersionedFile> all;
    for (const Part& part : parts_) {
        const std::vector<VersionedFile> files = part.source->files();
        all.insert(all.end(), files.begin(), files.end());
    }
    return all;
}

SceneReport JoinedScenes::report() const {
    SceneReport all;
    for (const Part& part : parts_) add_report(all, part.source->report());
    return all;
}

}  // namespace halflight
