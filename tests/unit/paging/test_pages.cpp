// Tests pages on the CPU: their nodes, and how hierarchies are cut.
#include "engine/paging/pages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>
#include <set>

#include "engine/rays/page_node.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/support/error_message.h"
#include "tests/support/slot_check.h"

namespace halflight::paging {
namespace {

using rays::BvhNode;
using rays::Corners;
using rays::PageNode;
using shared::kBvhPageTexels;

bool inside(const Bounds& inner, const Bounds& outer) {
    return glm::all(glm::greaterThanEqual(inner.lower, outer.lower)) &&
           glm::all(glm::lessThanEqual(inner.upper, outer.upper));
}

TEST(PageNode, DecodedBoxesContainTheBoxesAndAreTight) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int run = 0; run < 10000; ++run) {
        // Extents of 10^-12 to 10^12, at distances of up to 10^7 extents; some are flat.
        const float scale = std::pow(10.0f, 24 * unit(random) - 12), distance = std::pow(10.0f, 9 * unit(random) - 2);
        const vec3 centre = scale * distance * (vec3(unit(random), unit(random), unit(random)) - 0.5f);
        const int flat = run % 4;
        BvhNode node;
        Bounds all;
        const int count = 1 + run % 4;
        for (int k = 0; k < count; ++k) {
            for (int corner = 0; corner < 2; ++corner) {
                vec3 p = vec3(unit(random), unit(random), unit(random));
                if (flat < 3) p[flat] = 0.25f;
                node.children[static_cast<std::size_t>(k)].bounds.add(centre + scale * p);
            }
            all.add(node.children[static_cast<std::size_t>(k)].bounds);
        }
        const PageNode encoded = rays::encode_page_node(node);
        for (int k = 0; k < 4; ++k) {
            const Bounds box = rays::decode_page_box(encoded, k);
            if (k >= count) {
                EXPECT_TRUE(box.empty());
                continue;
            }
            const Bounds& exact = node.children[static_cast<std::size_t>(k)].bounds;
            ASSERT_TRUE(inside(exact, box)) << run;
            // A side of a cell is at most 2/255 of the node's extent, or twice the step of float.
            for (int a = 0; a < 3; ++a) {
                const float most = std::max(std::abs(all.lower[a]), std::abs(all.upper[a]));
                const double cell = std::max({2.0 / 254 * all.extent()[a], double{most} * 0x1p-21, 0x1p-125});
                EXPECT_LE(double{exact.lower[a]} - box.lower[a], 2 * cell) << run;
                EXPECT_LE(double{box.upper[a]} - exact.upper[a], 2 * cell) << run;
            }
        }
    }
}

std::vector<std::uint32_t> numbers(std::size_t count, std::uint32_t first = 0) {
    std::vector<std::uint32_t> ids(count);
    std::iota(ids.begin(), ids.end(), first);
    return ids;
}

std::vector<Corners> soup(std::size_t count, float size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<Corners> triangles(count);
    for (Corners& t : triangles) {
        const vec3 at(unit(random), unit(random), unit(random));
        for (vec3& p : t) p = at + size * vec3(unit(random), unit(random), unit(random));
    }
    return triangles;
}

/// A page that is in memory as a source of its own.
class OnePage final : public PageSource {
  public:
    OnePage(Page page, const PageLimits& limits) : page_(std::move(page)) {
        index_.limits = limits;
        index_.triangles = shared::kBvhTriangleLimit;
        index_.stack_entries = 64;
    }
    const PageIndex& index() const override { return index_; }
    Page read(std::uint32_t) const override { return page_; }
    void read_rows(std::span<const std::uint32_t> triangles, TriangleRows& rows) const override {
        for (const std::uint32_t t : triangles) rows.triangles.emplace_back(0, 0, 0, t);
    }
    PageIndex& index() { return index_; }
    StillPart still() const override { return still_part; }

    StillPart still_part;

  private:
    Page page_;
    PageIndex index_;
};

/// Reads a slot as kernels do. Checks that no texel is read as two things.
class SlotReader {
  public:
    explicit SlotReader(const LoadedPage& page) : page_(page) {}

    /// Checks what is below a node at a texel, and returns the bounds of its triangles.
    Bounds check_below(const PageNode& node, std::uint32_t texel, const std::vector<Corners>& triangles) {
        Bounds all;
        for (int k = 0; k < 4; ++k) {
            const rays::PageChild child = rays::page_child(node, k);
            if (!child.exists) continue;
            const std::uint32_t at = texel + node[2].z + child.offset;
            Bounds below;
            if (child.pairs == 0) {
                EXPECT_LE(at + kBvhPageTexels, page_.texels.size());
                PageNode next;
                std::copy_n(page_.texels.begin() + at, kBvhPageTexels, next.begin());
                for (std::uint32_t i = 0; i < kBvhPageTexels; ++i) EXPECT_TRUE(read.insert(at + i).second);
                below = check_below(next, at, triangles);
            }
            for (std::uint32_t i = 0; i < child.pairs; ++i) below.add(check_pair(at + i, triangles));
            EXPECT_TRUE(inside(below, rays::decode_page_box(node, k)));
            all.add(below);
        }
        return all;
    }

    std::multiset<std::uint32_t> met;  // triangles
    std::set<std::uint32_t> read;      // texels

  private:
    Bounds check_pair(std::uint32_t texel, const std::vector<Corners>& triangles) {
        EXPECT_LT(texel, page_.texels.size());
        EXPECT_TRUE(read.insert(texel).second);
        const uvec4 pair = page_.texels[texel];
        std::array<vec3, 4> ring;
        for (std::uint32_t c = 0; c < 4; ++c) {
            const std::uint32_t corner = (pair[static_cast<int>(2 + c / 2)] >> (c % 2 * shared::kBvhPageCornerBits)) &
                                         shared::kBvhPageCornerMask;
            EXPECT_LE(sizeof(vec3) * (corner + 1), page_.texels.size() * sizeof(uvec4));
            std::memcpy(&ring[c], reinterpret_cast<const char*>(page_.texels.data()) + corner * sizeof(vec3),
                        sizeof(vec3));
        }
        Bounds bounds;
        for (const bool second : {false, true}) {
            const std::uint32_t id = pair[second ? 1 : 0] & shared::kBvhTriangleMask;
            if (second && id == (pair.x & shared::kBvhTriangleMask)) continue;
            met.insert(id);
            const std::array<vec3, 3> corners = {ring[0], ring[2], ring[second ? 3 : 1]};
            const std::uint32_t order = pair[second ? 3 : 2] >> shared::kBvhPageOrderShift;
            const std::uint32_t places[3] = {3 - (order & 3u) - (order >> 2), order & 3u, order >> 2};
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_EQ(corners[places[k]], triangles[id][k]) << id;
                bounds.add(triangles[id][k]);
            }
        }
        return bounds;
    }

    const LoadedPage& page_;
};

void check_pages(const std::vector<Corners>& triangles, const PageLimits& limits) {
    const std::vector<std::uint32_t> ids = numbers(triangles.size());
    const PageSet set = build_pages(triangles, ids, {}, limits);
    std::multiset<std::uint32_t> met;
    std::size_t next_root = 0, filled = 0;
    for (std::uint32_t p = 0; p < set.pages.size(); ++p) {
        const Page& page = set.pages[p];
        filled += bytes_in_slot(size_of(page));
        EXPECT_LE(bytes_in_slot(size_of(page)), limits.bytes);
        const LoadedPage loaded = read_with_rows(OnePage(page, limits), p);
        EXPECT_LE(loaded.texels.size() * sizeof(uvec4), limits.bytes);
        ASSERT_EQ(loaded.roots.size(), page.roots);
        SlotReader slot(loaded);
        for (const PageNode& node : loaded.roots) {
            ASSERT_LT(next_root, set.roots.size());
            const PageRoot& root = set.roots[next_root++];
            EXPECT_EQ(root.page, p);
            const Bounds below = slot.check_below(node, 0, triangles);
            EXPECT_EQ(below.lower, root.bounds.lower);
            EXPECT_EQ(below.upper, root.bounds.upper);
        }
        const PageIndex::Size size = size_of(page);
        EXPECT_EQ(slot.read.size(), (size.nodes - size.roots) * kBvhPageTexels + size.pairs)
            << "nothing refers to some";
        met.merge(slot.met);
    }
    EXPECT_EQ(next_root, set.roots.size());
    EXPECT_EQ(met, std::multiset<std::uint32_t>(ids.begin(), ids.end())) << "each triangle must occur once";
    if (set.pages.size() > 20 && limits.bytes > 10000) {
        EXPECT_GT(filled, set.pages.size() * limits.bytes * 0.95);
    }
}

TEST(Pages, EveryTriangleIsInOnePage) {
    for (const std::size_t count : {1u, 2u, 5u, 100u, 3000u, 20000u}) check_pages(soup(count, 0.05f, 2), {2400});
    check_pages(soup(20000, 0.05f, 3), {});
    check_pages(soup(20000, 0.05f, 3), {kMostPageBytes});
    check_pages(soup(20000, 0.05f, 3), {19200});
    check_pages(soup(5000, 0.05f, 3), {kLeastPageBytes});
}

TEST(Pages, CoincidentAndFlatTriangles) {
    check_pages(std::vector<Corners>(3000, soup(1, 0.5f, 4).front()), {2400});
    check_pages(std::vector<Corners>(500, Corners{vec3(1), vec3(1), vec3(1)}), {2400});
}

TEST(Pages, EqualPositionsAreStoredOnce) {
    std::vector<Corners> grid;
    for (int i = 0; i < 400; ++i) {
        const vec3 p(static_cast<float>(i % 20), static_cast<float>(i / 20), 0);
        grid.push_back({p, p + vec3(1, 0, 0), p + vec3(1, 1, 0)});
        grid.push_back({p, p + vec3(1, 1, 0), p + vec3(0, 1, 0)});
    }
    const PageSet set = build_pages(grid, numbers(grid.size()));
    ASSERT_EQ(set.pages.size(), 1u);
    EXPECT_EQ(set.pages[0].vertices.size(), 21u * 21);
}

/// Checks the subtree of a node; counts how often it meets each root. Returns the exact bounds below.
Bounds check_over(const rays::Bvh& bvh, std::size_t node, const PageIndex& index, std::vector<int>& met) {
    Bounds all;
    for (const rays::BvhChild& child : bvh.nodes[node].children) {
        if (child.bounds.empty()) continue;
        Bounds below;
        if (child.leaf()) {
            EXPECT_EQ(child.count, 1u);
            const std::uint32_t root = bvh.primitives[child.first];
            ++met[root];
            below = index.roots[root].bounds;
        } else {
            EXPECT_GT(child.first, node);
            below = check_over(bvh, child.first, index, met);
        }
        EXPECT_EQ(child.bounds.lower, below.lower);
        EXPECT_EQ(child.bounds.upper, below.upper);
        all.add(below);
    }
    return all;
}

std::uint32_t stack_below(const rays::Bvh& bvh, std::size_t node) {
    std::uint32_t deepest = 0;
    for (const rays::BvhChild& child : bvh.nodes[node].children)
        if (!child.bounds.empty() && !child.leaf()) deepest = std::max(deepest, stack_below(bvh, child.first));
    return deepest + static_cast<std::uint32_t>(std::max(bvh.nodes[node].child_count(), 1)) - 1;
}

TEST(Pages, TheHierarchyOverTheRootsKeepsTheNodesOfBuckets) {
    PageIndex index;
    for (const unsigned seed : {8u, 9u, 10u}) {
        const std::vector<Corners> triangles = soup(seed == 9 ? 10 : 20000, 0.05f, seed);
        PageSet set = build_pages(triangles, numbers(triangles.size()), {}, {19200});
        EXPECT_EQ(set.above.empty(), seed == 9) << "a single subtree has no node above it";
        append_above(index.above, set);
        index.roots.insert(index.roots.end(), set.roots.begin(), set.roots.end());
    }
    const rays::Bvh bvh = hierarchy_over(index);
    std::vector<int> met(index.roots.size(), 0);
    check_over(bvh, 0, index, met);
    EXPECT_EQ(std::ranges::count(met, 1), std::ssize(met)) << "each root must occur once";
    EXPECT_EQ(bvh.nodes.size(), index.above.size() + 1) << "one node joins three buckets";
    EXPECT_EQ(bvh.stack_entries, stack_below(bvh, 0));
}

TEST(Pages, AppendedPagesHaveTheSubtreesOfBoth) {
    const std::vector<Corners> triangles = soup(3000, 0.05f, 7);
    const std::vector<std::uint32_t> ids = numbers(triangles.size());
    const std::size_t half = triangles.size() / 2;
    const auto page_of = [&](std::size_t first) {
        PageSet set = build_pages(std::span(triangles).subspan(first, half), std::span(ids).subspan(first, half));
        EXPECT_EQ(set.pages.size(), 1u);
        return RootedPage{set.pages.front(), set.roots};
    };
    RootedPage all = page_of(0);
    const PageIndex::Size one = size_of(all.page);
    PageLimits limits;
    limits.bytes = static_cast<std::uint32_t>(bytes_in_slot(one)) + 48;
    EXPECT_FALSE(append(all, page_of(half), limits));
    EXPECT_EQ(size_of(all.page).nodes, one.nodes);
    ASSERT_TRUE(append(all, page_of(half), PageLimits{kMostPageBytes}));
    EXPECT_EQ(all.page.roots, 2u);
    ASSERT_EQ(all.roots.size(), 2u);
    const LoadedPage loaded = read_with_rows(OnePage(all.page, PageLimits{kMostPageBytes}), 0);
    SlotReader slot(loaded);
    for (const PageNode& root : loaded.roots) slot.check_below(root, 0, triangles);
    EXPECT_EQ(slot.met, std::multiset<std::uint32_t>(ids.begin(), ids.end()));
}

TEST(Pages, DamagedPagesAreRefused) {
    const std::vector<Corners> triangles = soup(300, 0.1f, 8);
    const PageSet set = build_pages(triangles, numbers(300));
    const Page& good = set.pages.at(0);
    const auto source_of = [&](Page page, const PageLimits& limits = {}) {
        OnePage source(std::move(page), limits);
        source.index().triangles = 300;
        source.index().stack_entries = set.stack_entries;
        return source;
    };
    const auto message = [&](const std::function<void(Page&)>& change, const PageLimits& limits = {}) {
        Page page = good;
        change(page);
        return error_message([&] { read_with_rows(source_of(page, limits), 3); });
    };
    EXPECT_EQ(message([](Page&) {}), "");
    const std::string element = "pages: page 3 ", out = element + "has a node that leads out of it";
    EXPECT_TRUE(message([](Page&) {}, {kLeastPageBytes}).starts_with(element));
    void (*const leading_out[])(Page&) = {
        [](Page& p) { p.pairs.pop_back(); },    [](Page& p) { p.pairs.push_back(p.pairs.back()); },
        [](Page& p) { p.vertices.pop_back(); }, [](Page& p) { p.nodes.resize(p.nodes.size() - kBvhPageTexels); },
        [](Page& p) { p.roots = 2; },           [](Page& p) { p.nodes[2].w ^= 1; },
    };
    for (const auto& change : leading_out) EXPECT_EQ(message(change), out);
    for (const float wrong : {kInfinity, -2e12f, std::nanf("")})
        EXPECT_TRUE(message([&](Page& p) { p.vertices[7].y = wrong; }).starts_with(element)) << wrong;
    for (const std::uint32_t id : {300u, 0x3f000000u, 0x3fffffffu}) {
        EXPECT_TRUE(message([&](Page& p) { p.pairs[5].x = id; }).starts_with(element)) << id;
        EXPECT_TRUE(message([&](Page& p) { p.pairs.back().y = id | shared::kBvhPageAlpha; }).starts_with(element));
    }
    OnePage shallow = source_of(good);
    --shallow.index().stack_entries;
    EXPECT_TRUE(error_message([&] { read_with_rows(shallow, 3); }).starts_with(element));
    // Whatever a flipped bit makes of a page: it is refused, or kernels can read it.
    std::mt19937 random(9);
    int placed = 0;
    constexpr int kRuns = 3000;
    for (int run = 0; run < kRuns; ++run) {
        Page page = good;
        std::vector<uvec4>& texels = run % 2 == 0 ? page.nodes : page.pairs;
        texels[random() % texels.size()][static_cast<int>(random() % 4)] ^= 1u << random() % 32;
        const OnePage source = source_of(std::move(page));
        LoadedPage loaded;
        const std::string refusal = error_message([&] { loaded = read_with_rows(source, 3); });
        EXPECT_TRUE(refusal.empty() || refusal.starts_with("pages: page 3 ")) << refusal;
        if (!refusal.empty()) continue;
        EXPECT_EQ(test::SlotCheck(loaded, source.index()).defect(), "");
        ++placed;
    }
    EXPECT_GT(placed, kRuns / 10);
    EXPECT_LT(placed, kRuns * 9 / 10);
}

TEST(Pages, TrianglesOfTheStillPartStayInIt) {
    OnePage page(build_pages(soup(300, 0.1f, 8), numbers(300)).pages.at(0), {});
    page.index().triangles = 300;
    const auto message = [&](std::uint32_t number, std::uint32_t triangles) {
        page.still_part = {1, triangles};
        return error_message([&] { read_with_rows(page, number); });
    };
    EXPECT_EQ(message(0, 300), "");
    EXPECT_TRUE(message(0, 299).starts_with("pages: page 0 "));
    EXPECT_EQ(message(1, 299), "");
}

TEST(Pages, NoTriangles) {
    const PageSet set = build_pages({}, {});
    EXPECT_TRUE(set.pages.empty());
    EXPECT_TRUE(set.roots.empty());
    const rays::Bvh bvh = hierarchy_over({});
    ASSERT_EQ(bvh.nodes.size(), 1u);
    EXPECT_EQ(bvh.nodes[0].child_count(), 0);
}

TEST(Pages, IdsAndFlagsReachTheSlots) {
    const std::vector<Corners> triangles = soup(50, 0.1f, 5);
    const std::uint32_t first_id = shared::kBvhTriangleLimit - 50u;
    std::vector<std::uint32_t> words(50);
    for (std::size_t i = 0; i < 50; ++i)
        words[i] = (i % 3 == 0 ? kTriangleAlpha : 0) | (i % 4 < 2    ? 0u
                                                        : i % 4 == 2 ? kTriangleOneSided
                                                                     : kTriangleOneSided | kTriangleMirrored);
    const PageSet set = build_pages(triangles, numbers(50, first_id), words);
    ASSERT_EQ(set.pages.size(), 1u);
    OnePage source(set.pages[0], {});
    source.index().alpha = true;
    const LoadedPage loaded = read_with_rows(source, 0);
    EXPECT_EQ(loaded.rows.triangles.size(), 17u);
    std::set<std::uint32_t> met;
    for (std::size_t texel = 0; texel < loaded.first_rows.size(); ++texel) {
        const uvec4& pair = loaded.texels[texel];
        const std::uint32_t id = pair.x & shared::kBvhTriangleMask;
        if (id < first_id || id >= shared::kBvhTriangleLimit) continue;  // a node
        std::uint32_t row = loaded.first_rows[texel];
        for (const std::uint32_t word : std::set{pair.x, pair.y}) {
            const std::uint32_t triangle = word & shared::kBvhTriangleMask;
            if (triangle - first_id >= 50) continue;
            met.insert(triangle);
            const std::uint32_t flags = words[triangle - first_id];
            EXPECT_EQ((word & shared::kBvhPageAlpha) != 0, (flags & kTriangleAlpha) != 0);
            EXPECT_EQ((pair.x & shared::kBvhPageFacing) != 0, (flags & kTriangleOneSided) != 0);
            EXPECT_EQ((pair.y & shared::kBvhPageFacing) != 0, (flags & kTriangleMirrored) != 0);
        }
        for (int which = 0; which < 2; ++which) {
            if (which == 1 && ((pair.x ^ pair.y) & shared::kBvhTriangleMask) == 0) continue;
            if ((pair[which] & shared::kBvhPageAlpha) == 0) continue;
            ASSERT_LT(row, loaded.rows.triangles.size());
            EXPECT_EQ(loaded.rows.triangles[row++].w, pair[which] & shared::kBvhTriangleMask);
        }
    }
    EXPECT_EQ(met.size(), 50u);
}

}  // namespace
}  // namespace halflight::paging
