// Pages: parts of a scene's hierarchy that can be loaded one by one, for scenes larger than memory. No OpenGL is used.
//
// The triangles of a scene are divided into buckets that fit in memory. Each bucket has a hierarchy, which is cut into
// subtrees. Consecutive subtrees are the content of a page. The nodes above them stay in memory, with a hierarchy over
// all buckets.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "engine/io/files.h"
#include "engine/rays/bvh.h"
#include "engine/rays/page_node.h"
#include "engine/rays/pairs.h"
#include "engine/tables/needs.h"
#include "engine/tables/tables.h"

namespace halflight::paging {

/// Largest content of a page, at least that of a leaf. A slot of the device's pool has room for it.
struct PageLimits {
    std::uint32_t bytes = 192 << 10;    // bytes of a slot without table rows: kLeastPageBytes to kMostPageBytes
    std::uint32_t alpha_tested = 2048;  // triangles with alpha tests; their slots also have room for table rows
};
inline constexpr std::uint32_t kLeastPageBytes = 768, kMostPageBytes = 192 << 10;
inline constexpr std::uint32_t kPageByteSteps = 48;  // sizes of slots are multiples: they hold whole texels

/// A page. Nodes and pairs are as kernels read them (shaders/shared/bvh_nodes.h), with two differences: distances of
/// nodes are 0, and corners are indices of vertices. Ids of triangles are indices into TraceTables::triangles.
///
/// The nodes of a subtree come breadth first: the root, its children, their children. The pairs of leaves come in the
/// order of the nodes above them. The next node that is below no earlier one is the root of another subtree.
struct Page {
    std::uint32_t roots = 0;     // subtrees
    std::vector<uvec4> nodes;    // kBvhPageTexels texels per node
    std::vector<uvec4> pairs;    // a texel per pair
    std::vector<vec3> vertices;  // different positions, in the order of their first use
};

/// A subtree that is reached from outside its page.
struct PageRoot {
    static constexpr std::uint32_t kNoParent = ~0u;
    Bounds bounds;                     // exact bounds of its triangles
    std::uint32_t page = 0;            // index of the page
    std::uint32_t parent = kNoParent;  // index of the node above it among those above subtrees
};

/// The hierarchy of a bucket.
struct PageSet {
    std::vector<Page> pages;
    std::vector<PageRoot> roots;       // `page` counts from the first page of the bucket, ascending
    std::vector<std::uint32_t> above;  // nodes above the subtrees: each one's parent, a lower index, or kNoParent
    std::uint32_t stack_entries = 0;   // maximum stack of a traversal that starts at a root, entries
};

/// Builds the pages of a bucket. `ids` has the index of each triangle in TraceTables::triangles, in ascending order.
/// `words` are the triangles' words of flags (engine/tables/tables.h); it is empty if none has any. Pairs are not split
/// between leaves. The result is a function of the input. Throws Error if Embree fails.
PageSet build_pages(std::span<const rays::Corners> triangles, std::span<const std::uint32_t> ids,
                    std::span<const std::uint32_t> words = {}, const PageLimits& limits = {});

/// The part of a paged scene that stays in memory. Everything is relative to TraceTables::origin.
struct PageIndex {
    struct Size {
        std::uint32_t nodes = 0;  // number of nodes, roots included
        std::uint32_t roots = 0;
        std::uint32_t pairs = 0;
        std::uint32_t vertices = 0;
    };
    PageLimits limits;
    std::vector<FileContent> files;    // contents of the scene's files (contents_of() in engine/io/gltf/parts.h)
    std::uint64_t alpha_tests = 0;     // TriangleWords::alpha_tests() of the scene
    dvec3 origin{0};                   // TraceTables::origin
    Bounds bounds;                     // bounds of all triangles
    std::uint32_t triangles = 0;       // number of triangles
    std::uint64_t vertices = 0;        // number of vertices
    std::uint32_t vertex_texels = 1;   // texels of a vertex attribute row (shaders/shared/vertex.h)
    std::uint32_t stack_entries = 0;   // maximum of PageSet::stack_entries
    bool slivers = false;              // TraceTables::slivers
    std::vector<Size> pages;           // sizes of the pages
    std::vector<PageRoot> roots;       // roots of all pages, ascending by page
    std::vector<std::uint32_t> above;  // nodes above them, like PageSet::above; at most 4 children each
    std::vector<MeshRange> ranges;     // TraceTables::ranges
    // Numbers of the instances without triangles among those that do not move, ascending. A scene in memory has none.
    std::vector<std::uint32_t> empty;
    AbsentGeometry geometry;      // facts about triangles and vertices; AbsentGeometry::attributes is empty
    bool alpha = false;           // TraceTables::alpha_tested
    bool one_sided = false;       // TraceTables::one_sided
    bool panes = false;           // TraceTables::panes
    bool straight_glass = false;  // clear solids are panes, too: the materials had straight_shadows
};

/// Returns the needs on which the rows of vertex attributes depend. Materials as edited may need less, but not more.
SceneNeeds vertex_layout(const PageIndex& index);

/// Returns whether a position, relative to TraceTables::origin, can be one of a scene. It is finite, then.
bool within_reach(const vec3& position);

PageIndex::Size size_of(const Page& page);
/// Returns the bytes that a page takes in its slot. Roots are elsewhere, with the hierarchy over them.
std::size_t bytes_in_slot(const PageIndex::Size& size);

/// A page with its roots, whose PageRoot::page is not used.
struct RootedPage {
    Page page;
    std::vector<PageRoot> roots;
};
/// Appends a page to another one if both fit into a slot. Returns whether they do.
bool append(RootedPage& to, const RootedPage& page, const PageLimits& limits);

/// Appends the nodes above a set's subtrees. Its roots get the new indices of their parents.
void append_above(std::vector<std::uint32_t>& above, PageSet& set);

/// Builds the hierarchy over the roots of all pages: the nodes above them, and a hierarchy over what has no parent. Its
/// primitives are the roots. It has a root without children if there are no pages.
rays::Bvh hierarchy_over(const PageIndex& index);

/// Table rows of triangles, as kernels look them up.
struct TriangleRows {
    std::vector<uvec4> triangles;  // TraceTables::triangles
    std::vector<vec3> positions;   // 3 per triangle, TraceTables::positions
    std::vector<vec4> attributes;  // 3 * PageIndex::vertex_texels per triangle, ShadingTables::vertices
};

/// The part of a scene that is equal in all poses: its first pages and its first triangles.
struct StillPart {
    std::uint32_t pages = 0;
    std::uint32_t triangles = 0;
};

/// Pages and tables of a scene, in a file or in memory. Reading is thread-safe.
class PageSource {
  public:
    virtual ~PageSource() = default;
    /// Returns what errors name: the file.
    virtual std::string subject() const { return "pages"; }
    virtual const PageIndex& index() const = 0;
    virtual StillPart still() const { return {static_cast<std::uint32_t>(index().pages.size()), index().triangles}; }
    /// Reads a page. Throws Error that names the source if its data is damaged.
    virtual Page read(std::uint32_t page) const = 0;
    /// Reads the rows of triangles, which need not be sorted or different. Throws Error like read().
    virtual void read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const = 0;
};

/// A page as the pool takes it.
struct LoadedPage {
    std::vector<uvec4> texels;          // content of the slot (shaders/shared/bvh_nodes.h)
    std::vector<rays::PageNode> roots;  // roots of its subtrees; distances count from the start of the slot
    TriangleRows rows;                  // rows of the alpha-tested triangles, in the order of the pairs
    // Per texel of nodes and pairs: place of the pair's first row. Empty without rows.
    std::vector<std::uint16_t> first_rows;
};
/// Reads a page with its rows. Thread-safe. Throws Error like PageSource::read(), and for pages that
///   - are larger than the limits or need a larger stack than the index states,
///   - have nodes that lead out of them, or positions that no scene has,
///   - have triangles that the scene lacks. Pages of the still part have triangles of that part.
LoadedPage read_with_rows(const PageSource& source, std::uint32_t page);

/// Returns the tables of a paged scene, without what is in its pages. `last` are the tables of another pose, from which
/// rows of still triangles are taken, or null. Throws Error like PageSource::read_rows().
TraceTables resident_tables(const PageSource& source, const TraceTables* last = nullptr);
/// Memory of an emissive triangle in tables on CPU and device, and for building them (an upper estimate).
inline constexpr std::size_t kEmitterBytes = 1024;

}  // namespace halflight::paging
