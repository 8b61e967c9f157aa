// Tests the reader of pages and the sets of pages that batches use.
#include "engine/paging/page_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>

#include "engine/core/error.h"
#include "engine/paging/page_uses.h"
#include "tests/support/error_message.h"

namespace halflight::paging {
namespace {

using namespace std::chrono_literals;

/// Pages that have a vertex whose coordinates are their number. Page 999 is damaged.
class NumberedPages final : public PageSource {
  public:
    const PageIndex& index() const override { return index_; }
    Page read(std::uint32_t page) const override {
        ++reads;
        std::this_thread::sleep_for(delay);
        if (page == 999) throw Error("numbers", "page 999 is damaged");
        const rays::PageNode root = rays::encode_page_node({});
        return {.roots = 1, .nodes = {root.begin(), root.end()}, .pairs = {}, .vertices = {vec3(page)}};
    }
    void read_rows(std::span<const std::uint32_t>, TriangleRows&) const override {}

    std::chrono::milliseconds delay{0};
    mutable std::atomic<std::size_t> reads{0};

  private:
    PageIndex index_;
};

std::vector<std::uint32_t> take_all(PageReader& reader) {
    std::vector<std::uint32_t> pages;
    while (true) {
        const std::vector<PageReader::Arrival> arrivals = reader.take(true);
        if (arrivals.empty()) return pages;
        for (const PageReader::Arrival& arrival : arrivals) {
            EXPECT_EQ(std::bit_cast<float>(arrival.content.texels.at(0).x), static_cast<float>(arrival.page));
            pages.push_back(arrival.page);
        }
    }
}

std::vector<std::uint32_t> numbers(std::uint32_t count) {
    std::vector<std::uint32_t> pages;
    for (std::uint32_t page = 0; page < count; ++page) pages.push_back((7 * page) % count);
    return pages;
}

TEST(PageReader, ReadsInTheOrderOfTheQueue) {
    const NumberedPages source;
    PageReader reader(source);
    EXPECT_TRUE(reader.take(true).empty());
    const std::vector<std::uint32_t> pages = numbers(500);
    reader.ask(pages);
    EXPECT_EQ(take_all(reader), pages);
    EXPECT_EQ(source.reads, 500u);
}

TEST(PageReader, ReadsNoMoreThanItMayHold) {
    const NumberedPages source;
    PageReader reader(source);
    reader.ask(numbers(500));
    while (source.reads < PageReader::kMostArrived) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(20ms);
    EXPECT_LE(source.reads, PageReader::kMostArrived + PageReader::kPortion);
}

TEST(PageReader, ANewQueueReplacesTheOldOne) {
    NumberedPages source;
    source.delay = 1ms;
    PageReader reader(source);
    reader.ask(numbers(50));
    const std::vector<std::uint32_t> pages{1000, 0, 7, 1001};  // 0 and 7 may be under way
    reader.ask(pages);
    std::vector<std::uint32_t> arrived = take_all(reader);
    for (const std::uint32_t page : pages) EXPECT_EQ(std::ranges::count(arrived, page), 1) << page;
    EXPECT_LT(arrived.size(), 25u);
    reader.ask({});
    EXPECT_TRUE(reader.take(true).empty());
}

TEST(PageReader, ThrowsTheErrorOfAPage) {
    const NumberedPages source;
    PageReader reader(source);
    reader.ask(std::vector<std::uint32_t>{999, 1, 2});
    EXPECT_EQ(error_message([&] { take_all(reader); }), "numbers: page 999 is damaged");
    reader.ask(std::vector<std::uint32_t>{3, 4});
    EXPECT_EQ(take_all(reader), (std::vector<std::uint32_t>{3, 4}));
}

TEST(PageReader, EndsWhileItReads) {
    NumberedPages source;
    source.delay = 5ms;
    {
        PageReader reader(source);
        reader.ask(numbers(500));
        std::this_thread::sleep_for(2ms);
    }
    EXPECT_LE(source.reads, 2 * PageReader::kPortion);
}

TEST(PageUses, KnowsTheSetOfABatchAndTheNextUseOfAPage) {
    PageUses uses(4);
    const auto run = [&](std::uint32_t batch, std::initializer_list<std::uint32_t> pages) {
        uses.begin(batch);
        for (const std::uint32_t page : pages) uses.touch(page);
        uses.end();
    };
    run(0, {0, 1});
    run(1, {1, 2});
    run(2, {2});
    uses.begin(0);
    EXPECT_EQ(uses.set(), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(uses.next_use(0), 0u);
    EXPECT_EQ(uses.next_use(2), 1u);
    EXPECT_EQ(uses.next_use(3), PageUses::kBatches);
    uses.touch(3);
    EXPECT_EQ(uses.next_use(3), 0u);
    uses.end();  // the batch has left pages 0 and 1
    uses.begin(2);
    EXPECT_EQ(uses.next_use(0), PageUses::kBatches);
    EXPECT_EQ(uses.next_use(1), PageUses::kBatches - 1);  // batch 1 comes again after all the others
    EXPECT_EQ(uses.next_use(3), PageUses::kBatches - 2);
    uses.forget();
    uses.begin(0);
    EXPECT_TRUE(uses.set().empty());
}

}  // namespace
}  // namespace halflight::paging
