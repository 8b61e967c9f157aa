// Tests page files: round trips, damaged, truncated, foreign and replaced files.
#include "engine/paging/page_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <thread>
#include <tuple>

#include "engine/core/hash.h"
#include "shaders/shared/bvh_nodes.h"
#include "tests/support/error_message.h"
#include "tests/unit/io/file_size_limit.h"
#include "tests/unit/paging/scene_meshes.h"
#include "tools/common/temporary_folder.h"

namespace halflight::paging {
namespace {

using test::same_bytes;

/// Content of a page file.
struct Content {
    PageIndex index;
    std::vector<Page> pages;
    std::vector<TableBlock> blocks;
};

constexpr std::uint32_t kMaterials = 7;

/// Returns content without meaning, whose rows and pages can be told apart.
Content content_of(std::uint32_t triangles, std::uint32_t pages) {
    std::mt19937 random(1);
    const auto number = [&] { return static_cast<float>(random()); };
    Content content;
    PageIndex& index = content.index;
    index.origin = dvec3(1e7, -2, 0.1);
    index.bounds.add(vec3(-1)), index.bounds.add(vec3(2));
    index.triangles = triangles;
    index.vertices = triangles > 0 ? triangles + 2 : 0;
    index.vertex_texels = 2;
    index.stack_entries = 17;
    index.slivers = true;
    index.geometry.used_materials.assign(kMaterials, true);
    MeshRange range;
    range.merged = true;
    range.vertex_count = triangles + 2;
    range.triangle_count = triangles;
    if (triangles > 0) index.ranges.push_back(range);
    for (std::uint32_t first = 0; first < triangles; first += kTrianglesPerBlock) {
        TableBlock block;
        const std::uint32_t count = std::min(kTrianglesPerBlock, triangles - first);
        for (std::uint32_t i = 0; i < count; ++i) {
            const auto word = static_cast<std::uint32_t>(random() & ~kTriangleMaterialMask);
            block.triangles.emplace_back(first + i, first + i + 1, first + i + 2, word | random() % kMaterials);
            const auto corner = static_cast<std::uint16_t>(i);
            block.corners.push_back(
                {corner, static_cast<std::uint16_t>(corner + 1), static_cast<std::uint16_t>(corner + 2)});
        }
        for (std::uint32_t i = 0; i < count + 2; ++i) {
            block.positions.emplace_back(number(), number(), number());
            for (int k = 0; k < 2; ++k) block.attributes.emplace_back(number(), number(), number(), number());
        }
        content.blocks.push_back(std::move(block));
    }
    for (std::uint32_t p = 0; p < pages; ++p) {
        Page page;
        page.nodes.resize((p % 5 + 1) * shared::kBvhPageTexels);
        page.pairs.resize(p % 7 + 1);
        page.roots = 1;
        for (uvec4& texel : page.nodes) texel = uvec4(random(), random(), random(), random());
        for (uvec4& pair : page.pairs) pair = uvec4(random() >> 1, random() >> 1, random(), random());
        for (std::uint32_t i = 0; i < p % 4; ++i) page.vertices.emplace_back(number(), number(), number());
        index.roots.push_back({index.bounds, p, pages >= 8 && p < 8 ? p / 4 + 1 : PageRoot::kNoParent});
        content.pages.push_back(std::move(page));
    }
    if (pages >= 8) index.above = {PageRoot::kNoParent, 0, 0};
    return content;
}

void write(const Content& content, const std::filesystem::path& path) {
    write_unnamed(path, [&](const auto& temporary) {
        PageFileWriter writer(temporary, path.string());
        for (std::size_t i = 0; i < std::max(content.blocks.size(), content.pages.size()); ++i) {
            if (i < content.blocks.size()) writer.add_block(encode(content.blocks[i]));
            if (i >= content.pages.size()) continue;
            const Page& page = content.pages[i];
            writer.add_page(encode(page), size_of(page));
        }
        writer.finish(content.index);
    });
}

std::string bytes_of(const std::filesystem::path& path) {
    return read_file(path, 1u << 30);
}

/// Reads everything in a file.
void read_all(const PageFile& file) {
    for (std::uint32_t p = 0; p < file.index().pages.size(); ++p) file.read(p);
    TriangleRows rows;
    file.read_rows(test::all_triangles(file.index().triangles), rows);
}

class PageFiles : public testing::Test {
  protected:
    std::filesystem::path path() const { return folder / "scene.pages"; }
    TemporaryFolder folder;
};

TEST_F(PageFiles, ReturnWhatWasWritten) {
    for (const std::uint32_t triangles : {0u, 1u, 512u, 513u, 3000u}) {
        const Content content = content_of(triangles, triangles / 50);
        write(content, path());
        const PageFile file(path(), WhenDamaged::keep, 1 << 14);  // a cache of less than a block
        const PageIndex& index = file.index();
        const auto facts = [](const PageIndex& i) {
            return std::tie(i.origin, i.bounds.lower, i.bounds.upper, i.triangles, i.vertices, i.vertex_texels,
                            i.stack_entries, i.slivers, i.ranges, i.above);
        };
        EXPECT_TRUE(facts(index) == facts(content.index));
        EXPECT_TRUE(same_bytes(index.roots, content.index.roots));
        ASSERT_EQ(index.pages.size(), content.pages.size());
        for (std::uint32_t p = 0; p < content.pages.size(); ++p) {
            EXPECT_EQ(index.pages[p].nodes * shared::kBvhPageTexels, content.pages[p].nodes.size());
            const Page page = file.read(p);
            EXPECT_TRUE(same_bytes(page.nodes, content.pages[p].nodes)) << p;
            EXPECT_TRUE(same_bytes(page.pairs, content.pages[p].pairs)) << p;
            EXPECT_TRUE(same_bytes(page.vertices, content.pages[p].vertices)) << p;
            EXPECT_EQ(page.roots, content.pages[p].roots);
        }
        // Rows in any order, some more than once, by several threads.
        const auto read_some = [&](unsigned seed) {
            std::mt19937 random(seed);
            std::vector<std::uint32_t> wanted(triangles > 0 ? 700 : 0);
            for (std::uint32_t& t : wanted) t = static_cast<std::uint32_t>(random() % triangles);
            TriangleRows rows;
            file.read_rows(wanted, rows);
            ASSERT_EQ(rows.triangles.size(), wanted.size());
            for (std::size_t i = 0; i < wanted.size(); ++i) {
                const TableBlock& block = content.blocks[wanted[i] / kTrianglesPerBlock];
                const std::size_t row = wanted[i] % kTrianglesPerBlock;
                ASSERT_EQ(rows.triangles[i], block.triangles[row]);
                for (std::size_t k = 0; k < 3; ++k) {
                    ASSERT_EQ(rows.positions[3 * i + k], block.positions[block.corners[row][k]]);
                    for (std::size_t x = 0; x < 2; ++x)
                        ASSERT_EQ(rows.attributes[6 * i + 2 * k + x], block.attributes[2 * block.corners[row][k] + x]);
                }
            }
        };
        std::vector<std::thread> threads;
        for (unsigned seed = 0; seed < 4; ++seed) threads.emplace_back(read_some, seed);
        for (std::thread& thread : threads) thread.join();
        EXPECT_EQ(file.sizes().file, std::filesystem::file_size(path()));
        EXPECT_EQ(file.sizes().file, 64 + file.sizes().pages + file.sizes().tables + file.sizes().index);
    }
}

TEST_F(PageFiles, EveryFlippedBitIsDetectedOrHarmless) {
    const Content content = content_of(700, 10);
    write(content, path());
    const std::string whole = bytes_of(path());
    std::mt19937 random(7);
    int detected = 0;
    constexpr int kRuns = 500;
    for (int run = 0; run < kRuns; ++run) {
        std::string bytes = whole;
        // The header and the index get half of the flips.
        const std::size_t index = whole.size() - PageFile(path()).sizes().index;
        const std::size_t at = run % 4 == 0   ? random() % 64
                               : run % 4 == 1 ? index + random() % (whole.size() - index)
                                              : random() % whole.size();
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        std::ofstream(folder / "bad.pages", std::ios::binary) << bytes;  // write_file() would wait for the disk
        const std::string message = error_message([&] {
            const PageFile file(folder / "bad.pages");
            read_all(file);
            // Zstandard ignores some bits; what it returns has the right checksum.
            for (std::uint32_t p = 0; p < content.pages.size(); ++p)
                ASSERT_TRUE(same_bytes(file.read(p).pairs, content.pages[p].pairs));
        });
        detected += !message.empty();
        if (message.empty()) continue;
        EXPECT_TRUE(message.starts_with((folder / "bad.pages").string() + ": ")) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos);
    }
    EXPECT_GT(detected, kRuns * 95 / 100);
}

TEST_F(PageFiles, TruncatedFilesAreRefused) {
    write(content_of(700, 10), path());
    const std::string whole = bytes_of(path());
    const std::filesystem::path bad = folder / "bad.pages";
    const auto message = [&](const std::string& bytes) {
        std::ofstream(bad, std::ios::binary) << bytes;  // write_file() would wait for the disk
        return error_message([&] { read_all(PageFile(bad)); });
    };
    for (std::size_t size = 0; size < whole.size(); size += 1 + size / 8)
        EXPECT_TRUE(message(whole.substr(0, size)).starts_with(bad.string() + ": ")) << size;
    EXPECT_NE(message(whole.substr(0, 100)).find("truncated page file"), std::string::npos);
    EXPECT_NE(message(whole + "x").find("damaged"), std::string::npos);
    // A file of which some pages never reached the disk has zeros in their place.
    std::string holes = whole;
    std::fill_n(holes.begin() + 64, 2000, '\0');
    EXPECT_NE(message(holes).find("is damaged"), std::string::npos);
    EXPECT_EQ(message(std::string(1000, 'x')), bad.string() + ": is not a page file");
    EXPECT_FALSE(is_page_file(bad));
    std::string version = whole;
    version[8] = kPageFileVersion + 1;
    EXPECT_NE(message(version).find(fmt::format("is a page file of version {}", kPageFileVersion + 1)),
              std::string::npos);
    EXPECT_TRUE(is_page_file(bad) && is_page_file(path()));
    std::filesystem::remove(bad);
    for (const std::filesystem::path& none : {bad, folder.path})
        EXPECT_TRUE(error_message([&] { PageFile{none}; }).starts_with(none.string() + ": cannot read: "));
}

/// Returns content with a chain of nodes over the roots: a root beside each node, and two beside the last one.
Content chain_of(std::uint32_t nodes) {
    Content content = content_of(700, nodes + 1);
    content.index.above.clear();
    for (std::uint32_t i = 0; i < nodes; ++i) {
        content.index.above.push_back(i - 1);
        content.index.roots[i].parent = i;
    }
    content.index.roots[nodes].parent = nodes - 1;
    return content;
}

using Change = std::function<void(Content&)>;

TEST_F(PageFiles, IndicesThatContradictThemselvesAreRefused) {
    std::vector<Change> changes = {
        [](Content& c) { c.index.triangles = 2000; },
        [](Content& c) { c.index.roots[3].page = 70; },
        [](Content& c) { std::swap(c.index.roots[3], c.index.roots[5]); },
        [](Content& c) { c.index.roots[3].parent = 3; },
        [](Content& c) { c.index.roots[4].parent = 1; },                              // five children
        [](Content& c) { c.index.above[1] = 1; },                                     // a node that is its own parent
        [](Content& c) { c.index.above.push_back(0); },                               // no child
        [](Content& c) { c.index.above.push_back(0), c.index.roots[9].parent = 3; },  // a single child
        [](Content& c) { c = chain_of(129); },
        [](Content& c) { c = chain_of(20000); },
        [](Content& c) { c.index.limits.alpha_tested = 1 << 16; },
        [](Content& c) { c.pages[4].roots = 2; },
        [](Content& c) { c.pages[9].roots = 0, c.index.roots.pop_back(); },
        [](Content& c) { c.pages[4].vertices.resize(kMostPageBytes / 12); },
        [](Content& c) { c.index.vertex_texels = 1000; },
        [](Content& c) { c.index.ranges[0].first_vertex = 1; },
        [](Content& c) { c.index.ranges[0].merged = false; },
        [](Content& c) { c.index.ranges[0].block = 1; },
        [](Content& c) {
            c.index.geometry.resident = {1, 1};
        },
        [](Content& c) { c.index.geometry.resident = {700}; },
        [](Content& c) { c.index.origin.y = kInfinity; },
        [](Content& c) { c.index.origin.y = std::nan(""); },
    };
    for (const std::uint32_t bytes : {48u, 1000u, kMostPageBytes + kPageByteSteps})
        changes.emplace_back([=](Content& c) { c.index.limits.bytes = bytes; });
    for (const std::uint32_t entries : {0u, 257u, ~0u})
        changes.emplace_back([=](Content& c) { c.index.stack_entries = entries; });
    std::vector<Change> harmless = {
        [](Content&) {},
        [](Content& c) { c = chain_of(128); },
        [](Content& c) { c.pages.pop_back(), c.index.roots.pop_back(); },
    };
    for (const bool whole : {false, true}) {
        const auto of = [=](Content& c) -> Bounds& { return whole ? c.index.bounds : c.index.roots[3].bounds; };
        for (const float wrong : {kInfinity, -kInfinity, std::nanf(""), 2e12f, -2e12f}) {
            changes.emplace_back([=](Content& c) { of(c).lower.z = wrong; });
            changes.emplace_back([=](Content& c) { of(c).upper.x = wrong; });
        }
        changes.emplace_back([=](Content& c) { of(c) = Bounds(); });
        changes.emplace_back([=](Content& c) { of(c).upper.y = of(c).lower.y - 1; });
        harmless.emplace_back([=](Content& c) { of(c).upper.y = of(c).lower.y; });
    }
    std::vector<Change> in_block = {
        [](Content& c) { c.blocks[1].triangles[9].w = kMaterials; },
        [](Content& c) {
            c.blocks[1].triangles[9].w = 3;
            c.index.geometry.used_materials[3] = false;
            for (uvec4& t : c.blocks[0].triangles) t.w = 0;
        },
        [](Content& c) { c.blocks[1].triangles.back().z = 702; },
    };
    for (const float wrong : {kInfinity, 2e12f, std::nanf("")})
        in_block.emplace_back([=](Content& c) { c.blocks[1].positions[9].y = wrong; });
    const Change other_texels = [](Content& c) { c.index.vertex_texels = 3; };
    const std::string of_file = path().string() + ": ", in_rows = " of its table rows is damaged";
    const std::pair<std::vector<Change>, std::string> cases[] = {{changes, of_file + "its index is damaged"},
                                                                 {harmless, ""},
                                                                 {in_block, of_file + "block 1" + in_rows},
                                                                 {{other_texels}, of_file + "block 0" + in_rows}};
    for (const auto& [all, message] : cases)
        for (std::size_t i = 0; i < all.size(); ++i) {
            Content content = content_of(700, 10);
            all[i](content);
            write(content, path());
            EXPECT_EQ(error_message([&] { read_all(PageFile(path())); }), message) << i;
        }
}

TEST_F(PageFiles, IndicesOfAnotherSizeAreRefused) {
    write(content_of(700, 10), path());
    const std::string whole = bytes_of(path());
    const auto message = [&](std::uint64_t raw_bytes) {
        std::string bytes = whole;
        std::memcpy(bytes.data() + 40, &raw_bytes, sizeof raw_bytes);
        const std::uint64_t sum = hash_of({bytes.data(), 56});
        std::memcpy(bytes.data() + 56, &sum, sizeof sum);
        write_file(path(), bytes);
        return error_message([&] { PageFile{path()}; });
    };
    std::uint64_t right = 0;
    std::memcpy(&right, whole.data() + 40, sizeof right);
    EXPECT_EQ(message(right), "");
    for (const std::uint64_t wrong : {right - 1, right + 1})
        EXPECT_EQ(message(wrong), path().string() + ": its index is damaged");
    for (const int shift : {26, 40, 62, 63})  // 2 * 2^63 is 0; no frame of a few bytes holds 2^26
        EXPECT_EQ(message(std::uint64_t{1} << shift), path().string() + ": is a page file with a damaged header");
}

TEST_F(PageFiles, ReplacedFilesAreReadOn) {
    const Content content = content_of(700, 10);
    write(content, path());
    const PageFile file(path(), WhenDamaged::keep, 0);
    // The time of the last change tells the cache when a file was used, also while others read it.
    std::filesystem::last_write_time(path(), std::filesystem::last_write_time(path()) + std::chrono::seconds(1));
    read_all(file);
    write(content_of(100, 1), path());
    EXPECT_EQ(PageFile(path()).index().triangles, 100u);
    read_all(file);
    EXPECT_TRUE(same_bytes(file.read(9).pairs, content.pages[9].pairs));
    // A file that is overwritten in its place is damaged. A whole file that replaces a damaged one is kept.
    for (const bool replaced : {false, true}) {
        write(content, path());
        const PageFile overwritten(path(), WhenDamaged::remove, 0);
        std::ofstream(path(), std::ios::in | std::ios::out).seekp(64).write(std::string(40, 'x').c_str(), 40);
        if (replaced) write(content, path());
        EXPECT_NE(error_message([&] { read_all(overwritten); }).find("is damaged"), std::string::npos);
        EXPECT_EQ(std::filesystem::exists(path()), replaced);
    }
    read_all(PageFile(path()));
    // A file that is cut is damaged.
    write(content, path());
    const PageFile cut(path(), WhenDamaged::keep, 0);
    std::filesystem::resize_file(path(), 100);
    EXPECT_NE(error_message([&] { read_all(cut); }).find("cannot read"), std::string::npos);
}

TEST_F(PageFiles, FullDisksLeaveNothing) {
    const Content content = content_of(700, 10);
    write_file(path(), "old");
    for (const rlim_t room : {0, 100, 20000}) {
        const std::string message = error_message([&] {
            const test::FileSizeLimit tight(room);
            write(content, path());
        });
        EXPECT_EQ(message, path().string() + ": cannot write: File too large") << room;
        EXPECT_EQ(folder.entries(), std::vector<std::string>{"scene.pages"});
        EXPECT_EQ(bytes_of(path()), "old");
    }
}

}  // namespace
}  // namespace halflight::paging
