#include "engine/paging/page_uses.h"

#include <algorithm>
#include <bit>

namespace halflight::paging {

void PageUses::begin(std::uint32_t batch) {
    batch_ = static_cast<int>(batch % kBatches);
    touched_.assign(touched_.size(), false);
}

void PageUses::end() {
    const std::uint64_t bit = std::uint64_t{1} << batch_;
    for (std::size_t page = 0; page < users_.size(); ++page)
        users_[page] = touched_[page] ? users_[page] | bit : users_[page] & ~bit;
}

void PageUses::forget() {
    std::ranges::fill(users_, 0);
}

void PageUses::follow(std::size_t pages, std::size_t still) {
    users_.resize(still);
    users_.resize(pages, 0);
    touched_.assign(pages, false);
}

std::vector<std::uint32_t> PageUses::set() const {
    std::vector<std::uint32_t> pages;
    for (std::uint32_t page = 0; page < users_.size(); ++page)
        if ((users_[page] >> batch_ & 1) != 0) pages.push_back(page);
    return pages;
}

std::uint32_t PageUses::next_use(std::uint32_t page) const {
    // More rays of the batch may need a page that one ray has met.
    return touched_[page] ? 0 : static_cast<std::uint32_t>(std::countr_zero(std::rotr(users_[page], batch_)));
}

}  // namespace halflight::paging
