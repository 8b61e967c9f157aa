#include "engine/paging/row_gather.h"

#include <epoxy/gl.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <span>
#include <vector>

#include "engine/core/stopwatch.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/texture_units.h"

namespace halflight::paging {
namespace {

constexpr std::size_t kPortion = 8192;  // rows that a thread reads at a time

/// Writes values to the start of a buffer, which grows if it is too small.
template <class T>
void bring(gpu::Buffer& buffer, const std::vector<T>& values) {
    const std::size_t bytes = values.size() * sizeof(T);
    if (buffer.bytes() < bytes) buffer = gpu::Buffer(buffer.name(), bytes + bytes / 4);
    buffer.write(std::span<const T>(values));
}

}  // namespace

RowGather::RowGather(const PageSource& source)
    : source_(source),
      triangles_("rows of hit triangles", 0),
      positions_("positions of hit triangles", 0),
      attributes_("attributes of hit triangles", 0) {}

std::size_t RowGather::bytes_per_path(std::uint32_t vertex_texels) {
    const std::size_t row = sizeof(uvec4) + 3 * (sizeof(vec3) + vertex_texels * sizeof(vec4));
    // Rows are collected before they are uploaded to buffers with a quarter to spare, beside hits and their order.
    return 2 * row + row / 4 + sizeof(shared::Hit) + 2 * sizeof(std::uint32_t);
}

void RowGather::gather(const gpu::Buffer& hits, std::size_t count) {
    const Stopwatch watch;
    const std::vector<shared::Hit> all = hits.read<shared::Hit>(0, count);
    std::vector<std::uint32_t> triangles(count);
    std::ranges::transform(all, triangles.begin(), &shared::Hit::triangle);
    read(triangles);
    seconds_ += watch.seconds();
}

void RowGather::gather(const gpu::Buffer& hits, const gpu::Buffer& list, const gpu::Buffer& header) {
    const Stopwatch watch;
    const std::uint32_t count = header.read<shared::ListHeader>(0, 1).front().count;
    const std::vector<std::uint32_t> paths = list.read<std::uint32_t>(0, count);
    const std::vector<shared::Hit> all = count > 0 ? hits.read<shared::Hit>() : std::vector<shared::Hit>();
    std::vector<std::uint32_t> triangles(count);
    std::ranges::transform(paths, triangles.begin(), [&](std::uint32_t path) { return all[path].triangle; });
    read(triangles);
    seconds_ += watch.seconds();
}

void RowGather::read(const std::vector<std::uint32_t>& triangles) {
    // Neighbouring triangles share blocks of the source, so they are read together.
    std::vector<std::uint32_t> order;
    order.reserve(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
        if (triangles[i] < source_.index().triangles) order.push_back(i);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return triangles[i]; });

    const std::size_t texels = 3 * std::size_t{source_.index().vertex_texels};
    std::vector<uvec4> rows(triangles.size(), uvec4(0));
    std::vector<vec3> positions(3 * triangles.size(), vec3(0));
    std::vector<vec4> attributes(texels * triangles.size(), vec4(0));
    const std::size_t portions = (order.size() + kPortion - 1) / kPortion;
    tbb::parallel_for(std::size_t{0}, portions, [&](std::size_t portion) {
        const std::size_t first = portion * kPortion, count = std::min(kPortion, order.size() - first);
        const auto places = std::span<const std::uint32_t>(order).subspan(first, count);
        std::vector<std::uint32_t> asked;  // each triangle once
        for (const std::uint32_t i : places)
            if (asked.empty() || asked.back() != triangles[i]) asked.push_back(triangles[i]);
        TriangleRows found;
        source_.read_rows(asked, found);
        std::size_t k = 0;
        for (const std::uint32_t i : places) {
            while (asked[k] != triangles[i]) ++k;
            rows[i] = uvec4(3 * i, 3 * i + 1, 3 * i + 2, found.triangles[k].w);
            std::copy_n(&found.positions[3 * k], 3, &positions[3 * std::size_t{i}]);
            std::copy_n(&found.attributes[texels * k], texels, &attributes[texels * i]);
        }
    });
    bring(triangles_, rows);
    bring(positions_, positions);
    bring(attributes_, attributes);
    rows_ += order.size();
}

void RowGather::bind() const {
    triangles_.bind_texture(shared::kUnitTriangles, GL_RGBA32UI);
    positions_.bind_texture(shared::kUnitPositions, GL_RGB32F);
    attributes_.bind_texture(shared::kUnitVertices, GL_RGBA32F);
}

}  // namespace halflight::paging
