// Pages of a scene in memory, for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/paging/pages.h"
#include "engine/tables/tables.h"

namespace halflight::test {

/// Pages of tables with a single space. `attributes` are ShadingTables::vertices; rows have none if it is empty.
class MemoryPages final : public paging::PageSource {
  public:
    explicit MemoryPages(const TraceTables& tables, std::size_t bucket = 1000, const paging::PageLimits& limits = {},
                         std::span<const vec4> attributes = {});
    /// Pages of a scene, which can be prepared with them (PrepareOptions::pages).
    explicit MemoryPages(const Scene& scene, std::size_t bucket = 1000, const paging::PageLimits& limits = {});

    const paging::PageIndex& index() const override { return index_; }
    paging::Page read(std::uint32_t page) const override { return pages_[page]; }
    void read_rows(std::span<const std::uint32_t> triangles, paging::TriangleRows& rows) const override;

  private:
    MemoryPages(const Scene& scene, const TraceTables& tables, std::size_t bucket, const paging::PageLimits& limits);

    paging::PageIndex index_;
    std::vector<paging::Page> pages_;
    std::vector<uvec4> triangles_;
    std::vector<vec3> positions_;
    std::vector<vec4> attributes_;
};

}  // namespace halflight::test
