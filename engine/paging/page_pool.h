// The pages of a scene that are in device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "engine/paging/page_statistics.h"
#include "engine/paging/pages.h"
#include "engine/rays/rays.h"

namespace halflight::paging {

/// Slots for pages in the buffers of a TraceScene. The hierarchy over the roots of all pages is always there. A root
/// whose page is missing is a leaf without pairs, which kernels report (shaders/lib/traverse.glsl).
///
/// Pages leave in the order in which they came. Some of the oldest are hidden before they leave. A page that is
/// requested while it is hidden comes back without being read. So pages in use stay (the clock algorithm), although
/// kernels do not record which pages they visit.
class PagePool {
  public:
    /// Uses at most `bytes` bytes of device memory for slots, and at least one slot. The source outlives the pool.
    /// Throws Error where the driver's texture buffers or the references of kernels have no room for a slot.
    PagePool(const PageSource& source, std::size_t bytes);

    const rays::TraceScene& scene() const { return *scene_; }
    const PageSource& source() const { return source_; }
    std::uint32_t slots() const { return static_cast<std::uint32_t>(page_of_slot_.size()); }
    /// Returns how many pages stay if they are loaded one after another: the others may be hidden meanwhile.
    std::uint32_t lasting_slots() const;
    std::uint32_t pages() const { return static_cast<std::uint32_t>(first_root_.size()) - 1; }
    /// Returns the first root of a page; `pages()` gives the number of roots.
    std::uint32_t first_root(std::uint32_t page) const { return first_root_[page]; }
    std::uint32_t page_of(std::uint32_t root) const { return source_.index().roots[root].page; }

    /// Makes pages resident, at most slots() different ones; others leave for them. Throws Error like
    /// PageSource::read(); the pool then holds what it held, less the pages that left.
    void load(std::span<const std::uint32_t> asked);
    /// Lets every page leave.
    void clear();

    const PageTraffic& traffic() const { return traffic_; }
    void reset_traffic() { traffic_ = {}; }

  private:
    enum class State : std::uint8_t { missing, hidden, resident };
    std::uint32_t free_slot(const std::vector<bool>& kept);
    void upload(std::uint32_t page, std::uint32_t slot, Page content);
    void show(std::uint32_t page, bool visible);

    const PageSource& source_;
    std::uint32_t top_nodes_ = 0;              // nodes before the slots, the head included
    std::vector<std::uint32_t> first_root_;    // per page, and the end
    std::vector<std::uint32_t> word_of_root_;  // per root: index of its reference in the node buffer, 32-bit words
    std::vector<std::uint32_t> slot_of_page_;
    std::vector<State> state_;  // per page
    std::vector<std::uint32_t> page_of_slot_;
    std::vector<std::uint32_t> free_;   // free slots
    std::deque<std::uint32_t> queue_;   // resident pages, oldest first
    std::deque<std::uint32_t> hidden_;  // hidden pages, oldest first
    std::optional<rays::TraceScene> scene_;
    PageTraffic traffic_;
};

}  // namespace halflight::paging
