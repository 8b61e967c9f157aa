// Tests bytes that copies share.
#include <gtest/gtest.h>

#include "engine/core/shared_bytes.h"

namespace halflight {
namespace {

TEST(SharedBytes, CopiesShareUntilOneIsEdited) {
    SharedBytes a{1, 2, 3};
    const SharedBytes b = a;
    EXPECT_EQ(a.data(), b.data());
    a.edit()[1] = 9;
    EXPECT_EQ(a.get(), (std::vector<std::uint8_t>{1, 9, 3}));
    EXPECT_EQ(b.get(), (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_FALSE(a == b);
    const std::uint8_t* const own = a.data();
    a.edit()[1] = 2;
    EXPECT_EQ(a.data(), own) << "bytes that nobody shares stay where they are";
    EXPECT_TRUE(a == b);
}

TEST(SharedBytes, EmptyOnesTakeBytes) {
    SharedBytes a;
    EXPECT_TRUE(a.empty());
    EXPECT_EQ(a.begin(), a.end());
    a.edit().push_back(7);
    EXPECT_EQ(a.size(), 1u);
    const SharedBytes b = a;
    a = {};
    EXPECT_TRUE(a.empty());
    EXPECT_EQ(b[0], 7);
}

}  // namespace
}  // namespace halflight
