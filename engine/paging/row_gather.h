// The table rows of hit triangles, for scenes that are loaded in pages: kernels cannot look them up by the triangle.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/paging/pages.h"

namespace halflight::paging {

/// Reads the rows of a batch's hits to the device, in the order of the batch. Row i belongs to path i, or to path
/// list[i]. shaders/resolve.comp looks them up with HALFLIGHT_GATHERED_ROWS.
class RowGather {
  public:
    /// The source outlives the object.
    explicit RowGather(const PageSource& source);

    /// Returns the bytes that a batch takes per path, on the CPU and on the device.
    static std::size_t bytes_per_path(std::uint32_t vertex_texels);

    /// Reads the rows of `count` paths. `hits` has one Hit per path. Rows of misses are zeros.
    void gather(const gpu::Buffer& hits, std::size_t count);
    /// Reads the rows of the paths of a list (ListHeader of shaders/shared/ray_structs.h).
    void gather(const gpu::Buffer& hits, const gpu::Buffer& list, const gpu::Buffer& header);
    /// Binds the rows in place of the scene's tables: kUnitTriangles, kUnitPositions and kUnitVertices.
    void bind() const;

    std::uint64_t rows() const { return rows_; }  ///< Returns the number of rows of all batches so far.
    double seconds() const { return seconds_; }   ///< Returns the seconds that gathering took so far.
    void reset_statistics() { rows_ = 0, seconds_ = 0; }

  private:
    void read(const std::vector<std::uint32_t>& triangles);

    const PageSource& source_;
    gpu::Buffer triangles_, positions_, attributes_;
    std::uint64_t rows_ = 0;
    double seconds_ = 0;
};

}  // namespace halflight::paging
