// Scenes in memory as sources of meshes, for tests of page files.
#pragma once

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <utility>
#include <vector>

#include "engine/paging/page_file.h"
#include "engine/scene/mesh_source.h"
#include "engine/tables/shading_tables.h"

namespace halflight::test {

/// Reads the meshes of a scene in memory.
class SceneMeshes final : public MeshSource {
  public:
    explicit SceneMeshes(Scene scene) : meshes_(std::move(scene.meshes)), scene_(std::move(scene)) {
        for (const Mesh& mesh : meshes_) scene_.meshes.emplace_back().name = mesh.name;
    }
    const Scene& scene() const override { return scene_; }
    SceneReport report() const override { return scene_.report; }
    std::vector<VersionedFile> files() const override { return {}; }
    Mesh read(std::size_t mesh) override { return meshes_[mesh]; }

  private:
    std::vector<Mesh> meshes_;
    Scene scene_;
};

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Returns the rows of triangles that tables in memory have.
inline paging::TriangleRows rows_of(const TraceTables& trace, const ShadingTables& shading,
                                    const std::vector<std::uint32_t>& triangles) {
    const auto texels = static_cast<std::size_t>(shading.needs.vertex_stride());
    paging::TriangleRows rows;
    for (const std::uint32_t t : triangles) {
        rows.triangles.push_back(trace.triangles[t]);
        for (int k = 0; k < 3; ++k) {
            const std::size_t vertex = trace.triangles[t][k];
            rows.positions.push_back(trace.positions[vertex]);
            for (std::size_t i = 0; i < texels; ++i) rows.attributes.push_back(shading.vertices[vertex * texels + i]);
        }
    }
    return rows;
}

inline std::vector<std::uint32_t> all_triangles(std::size_t count) {
    std::vector<std::uint32_t> triangles(count);
    std::iota(triangles.begin(), triangles.end(), 0u);
    return triangles;
}

}  // namespace halflight::test
