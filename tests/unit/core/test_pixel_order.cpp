// Tests the mapping between path indices and pixels of a band.
#include "shaders/shared/pixel_order.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>
#include <vector>

#include "shaders/shared/reuse_groups.h"

namespace halflight::shared {
namespace {

/// Checks that every path has its own pixel within the band's blocks, and that the inverse mapping returns the path.
void expect_bijection(const uvec2& tiles) {
    const uvec2 size = tiles * 16u;
    std::vector<char> taken(std::size_t{size.x} * size.y);
    for (uint path = 0; path < taken.size(); ++path) {
        const uvec2 pixel = pixel_of_path(path, tiles);
        ASSERT_TRUE(pixel.x < size.x && pixel.y < size.y) << path << " of " << tiles.x << "x" << tiles.y;
        ASSERT_EQ(path_of_pixel(pixel, tiles), path) << tiles.x << "x" << tiles.y;
        char& mark = taken[std::size_t{pixel.y} * size.x + pixel.x];
        ASSERT_FALSE(mark) << path << " of " << tiles.x << "x" << tiles.y;
        mark = 1;
    }
}

TEST(PixelOrder, IsABijectionForEverySize) {
    for (uint y = 1; y <= 12; ++y)
        for (uint x = 1; x <= 12; ++x) expect_bijection({x, y});
    for (const uvec2 tiles : {uvec2(80, 45), uvec2(81, 46), uvec2(1, 257), uvec2(257, 1), uvec2(4096, 1)})
        expect_bijection(tiles);
}

TEST(PixelOrder, EveryAlignedPowerOfFourPathsIsASquare) {
    for (const uvec2 tiles : {uvec2(1, 1), uvec2(3, 4), uvec2(5, 3)})
        for (const uint side : {2u, 4u, 8u, 16u})
            for (uint path = 0; path < tiles.x * tiles.y * 256; ++path)
                EXPECT_EQ(pixel_of_path(path, tiles) / side, pixel_of_path(path & ~(side * side - 1), tiles) / side);
}

TEST(PixelOrder, FirstHalfOfThePathsHoldsEveryOtherRowOfBlocks) {
    for (const uint rows : {2u, 5u, 8u, 45u}) {
        const uvec2 tiles(3, rows);
        const uint even = (rows + 1) / 2;
        for (uint block = 0; block < tiles.x * rows; ++block)
            EXPECT_EQ(pixel_of_path(block * 256, tiles).y / 16 % 2 == 0, block / tiles.x < even) << block;
    }
}

/// Checks groups of path reuse: one step leads to a partner and back, and all members find the same group.
TEST(PixelOrder, GroupsTakeAPixelOfEachCellOfTheirBlock) {
    const uvec2 tiles{2, 3};
    for (const auto& [size, extent] : {std::pair{4u, uvec2(8, 8)}, {8u, uvec2(16, 8)}, {16u, uvec2(16, 16)}}) {
        for (const uint grouping : {0u, 0xffffu, 0x1234u, 0x8421u, 0x0f3cu}) {
            for (uint path = 0; path < tiles.x * tiles.y * 256; path += 7) {
                const uvec2 block = pixel_of_path(path, tiles) / extent;
                std::set<uint> group, cells, group_of_last;
                for (uint i = 0; i < size; ++i) {
                    const uint member = path ^ member_step(i, grouping);
                    ASSERT_EQ(pixel_of_path(member, tiles) / extent, block) << size << ", " << grouping << ": " << path;
                    group.insert(member), cells.insert(member >> 4);
                    group_of_last.insert(path ^ member_step(size - 1, grouping) ^ member_step(i, grouping));
                }
                ASSERT_EQ(cells.size(), size) << grouping << ": " << path;
                ASSERT_EQ(group, group_of_last) << size << ", " << grouping << ": " << path;
                ASSERT_TRUE(group.contains(path));
            }
        }
    }
}

}  // namespace
}  // namespace halflight::shared
