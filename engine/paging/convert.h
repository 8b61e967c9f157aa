// Conversion of scenes to page files, within a memory budget. No OpenGL is used.
//
// 1. All meshes are read. Their extents give the origin, and a sample of centroids gives the buckets.
// 2. Meshes are read again in the order of the instances. Table rows are written, and triangles go to their buckets in
//    a temporary file.
// 3. Pages are built and written bucket by bucket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "engine/paging/page_file.h"
#include "engine/scene/mesh_source.h"

namespace halflight::paging {

/// Largest number of emissive triangles and panes that a page file lists. Of scenes with more, it lists none: these
/// lights are then found by chance, and panes are opaque to shadow rays.
inline constexpr std::size_t kMostResident = std::size_t{1} << 24;

struct ConvertOptions {
    std::size_t memory = std::size_t{1} << 30;  // bytes that the conversion may take besides the largest mesh
    std::vector<FileContent> files{};           // PageIndex::files
    bool straight_glass = false;                // PageIndex::straight_glass
    std::size_t expected_triangles = 0;         // estimate for the progress; 0: unknown
    std::uint32_t bucket_triangles = 1u << 18;  // upper limit for an average bucket; the double is never exceeded
    PageLimits limits{};                        // largest content of a page
    // Per material, whether an animation drives a property of it. Triangles of such materials are listed as emissive,
    // and as alpha-tested unless the material is opaque; this changes no picture. Empty: none.
    std::vector<bool> driven_materials{};
    std::function<void(double share)> progress{};  // called with the share of the work done; may throw to stop
};

/// Least memory of a conversion, bytes: ConvertOptions::memory below it is refused.
inline constexpr std::size_t kLeastConvertBytes = std::size_t{256} << 20;

/// Converts a scene: all instances are merged, as build_trace_tables() merges with an unlimited flatten_limit. Table
/// rows equal those of build_trace_tables() and build_shading_tables(). Moving and deforming instances are left out
/// (engine/paging/moving_pages.h); PageIndex::geometry and PageIndex::alpha count them, too. The file is a function of
/// the scene and of bucket_triangles, limits and driven_materials. The path gets a complete file or stays unchanged.
/// Throws Error that names the file:
///   - what reading the meshes and build_trace_tables() throw,
///   - a full disk, or too little memory.
PageFileSizes convert(MeshSource& source, const std::filesystem::path& path, const ConvertOptions& options = {});

}  // namespace halflight::paging
