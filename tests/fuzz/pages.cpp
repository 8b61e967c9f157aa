// Fuzzes what page files hold, without compression and checksums, which stop nearly all mutations of whole files.
#include <algorithm>
#include <cstring>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "engine/paging/page_codec.h"
#include "engine/paging/page_file_index.h"
#include "engine/rays/bvh.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"
#include "tests/support/slot_check.h"

namespace halflight::fuzz {
namespace {

constexpr std::uint32_t kMostPages = 64, kMostRows = 4096;  // limits of what is read of an input

/// Takes bytes, whose number precedes them, from the start of the input.
std::string_view take_part(std::string_view& input) {
    std::uint32_t size = 0;
    if (input.size() >= sizeof size) {
        std::memcpy(&size, input.data(), sizeof size);
        input.remove_prefix(sizeof size);
    }
    const std::string_view part = input.substr(0, size);
    input.remove_prefix(part.size());
    return part;
}

/// Pages and blocks of an input. Missing ones have no bytes.
class InputPages final : public paging::PageSource {
  public:
    InputPages(paging::PageIndex index, std::string_view input) : index_(std::move(index)), blocks_(block_count()) {
        for (std::string_view& block : blocks_) block = take_part(input);
        pages_.resize(index_.pages.size());
        for (std::string_view& page : pages_) page = take_part(input);
    }
    const paging::PageIndex& index() const override { return index_; }
    paging::Page read(std::uint32_t page) const override {
        const auto decoded = paging::decode_page(pages_[page], index_.pages[page]);
        if (!decoded) throw Error(subject(), "page {} is damaged", page);
        return *decoded;
    }
    void read_rows(std::span<const std::uint32_t> triangles, paging::TriangleRows& rows) const override {
        rows = {};
        std::optional<paging::TableBlock> block;
        std::size_t current = blocks_.size();
        for (const std::uint32_t triangle : triangles) {
            if (triangle >= index_.triangles) throw Broken("a row is out of range");
            const std::size_t wanted = triangle / paging::kTrianglesPerBlock;
            const std::size_t row = triangle % paging::kTrianglesPerBlock;
            if (std::exchange(current, wanted) != wanted) block = paging::decode_block(blocks_[wanted], index_);
            if (!block || row >= block->triangles.size()) throw Error(subject(), "block {} is damaged", wanted);
            rows.triangles.push_back(block->triangles[row]);
            for (const std::size_t corner : block->corners[row]) {
                rows.positions.push_back(block->positions.at(corner));
                for (std::size_t i = 0; i < index_.vertex_texels; ++i)
                    rows.attributes.push_back(block->attributes.at(corner * index_.vertex_texels + i));
            }
        }
    }

  private:
    std::size_t block_count() const {
        return (std::size_t{index_.triangles} + paging::kTrianglesPerBlock - 1) / paging::kTrianglesPerBlock;
    }

    paging::PageIndex index_;
    std::vector<std::string_view> blocks_, pages_;
};

constexpr const char* kSubject = "pages: ";  // subject of errors

void check_hierarchy(const paging::PageIndex& index) {
    const rays::Bvh top = paging::hierarchy_over(index);
    if (top.nodes.size() > std::max<std::size_t>(index.roots.size(), 1)) throw Broken("there are too many nodes");
    std::vector<std::uint32_t> roots = top.primitives;
    std::ranges::sort(roots);
    if (roots.size() != index.roots.size() || std::ranges::adjacent_find(roots) != roots.end() ||
        (!roots.empty() && roots.back() >= index.roots.size()))
        throw Broken("a root is not in the hierarchy once");
}

}  // namespace

void pages(std::string_view input) {
    const std::string_view index = take_part(input);
    std::optional<paging::StoredIndex> stored = paging::parse_index(index, std::uint64_t{1} << 40);
    if (!stored) return;
    const InputPages source(std::move(stored->index), input);
    check_hierarchy(source.index());
    check_errors(kSubject, [&] { paging::resident_tables(source); });
    for (std::uint32_t page = 0; page < std::min<std::size_t>(source.index().pages.size(), kMostPages); ++page) {
        check_errors(kSubject, [&] {
            const paging::LoadedPage loaded = paging::read_with_rows(source, page);
            const std::string defect = test::SlotCheck(loaded, source.index()).defect();
            if (!defect.empty()) throw Broken(defect);
        });
    }
    const std::uint32_t end = std::min(source.index().triangles, kMostRows);
    for (std::uint32_t first = 0; first < end; first += paging::kTrianglesPerBlock) {
        std::vector<std::uint32_t> triangles(std::min(paging::kTrianglesPerBlock, end - first));
        std::iota(triangles.begin(), triangles.end(), first);
        check_errors(kSubject, [&] {
            paging::TriangleRows rows;
            source.read_rows(triangles, rows);
            for (const uvec4& t : rows.triangles) {
                if (!source.index().geometry.used_materials.at(t.w & kTriangleMaterialMask))
                    throw Broken("a material is not in use");
                if (std::max({t.x, t.y, t.z}) >= source.index().vertices) throw Broken("a vertex is out of range");
            }
        });
    }
}

}  // namespace halflight::fuzz
