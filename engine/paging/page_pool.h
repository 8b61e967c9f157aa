// The pages of a scene that are in device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"
#include "engine/paging/page_reader.h"
#include "engine/paging/page_statistics.h"
#include "engine/paging/page_uses.h"
#include "engine/paging/pages.h"
#include "engine/rays/rays.h"

namespace halflight::paging {

/// Slots for pages in the buffer of a TraceScene. The hierarchy over the roots of all pages is always there, with a
/// copy of each root. While the page of a root is missing, the copy has a single child, which kernels report
/// (shaders/lib/traverse.glsl).
///
/// Pages are read in the background and uploaded by the thread that owns the pool. If there is no free slot, the page
/// leaves that the following batches will need last, and of several such pages the one loaded or used least recently.
class PagePool {
  public:
    /// Uses at most `bytes` bytes of device memory for slots, and at least one slot. The source outlives the pool.
    /// Throws Error if the driver's texture buffers or the references of kernels have no room for a slot.
    /// `shading`: SceneBuffers::defines(), needed if triangles have alpha tests.
    PagePool(const PageSource& source, std::size_t bytes, const gpu::Defines& shading = {});

    /// Returns the bytes of device memory that a slot takes.
    static std::size_t slot_bytes(const PageIndex& index);

    /// Returns the bytes that pages take between reading and upload: those that wait, and those that take() uploads.
    static std::size_t reading_bytes(const PageIndex& index) {
        return 2 * (PageReader::kMostArrived + PageReader::kPortion) * slot_bytes(index);
    }
    /// Returns the bytes that pages and roots take besides the slots, an upper estimate. They hold the hierarchy over
    /// the roots on the device, its copies while it is built, and the one for queries.
    static std::size_t fixed_bytes(const PageIndex& index) {
        constexpr std::size_t kRoot = 448, kPage = 64;
        return kRoot * index.roots.size() + kPage * index.pages.size();
    }

    const rays::TraceScene& scene() const { return *scene_; }
    const PageSource& source() const { return source_; }
    std::uint32_t slots() const { return static_cast<std::uint32_t>(page_of_slot_.size()); }
    std::uint32_t pages() const { return static_cast<std::uint32_t>(first_root_.size()) - 1; }
    /// Returns the first root of a page; `pages()` gives the number of roots.
    std::uint32_t first_root(std::uint32_t page) const { return first_root_[page]; }
    std::uint32_t page_of(std::uint32_t root) const { return source_.index().roots[root].page; }
    bool resident(std::uint32_t page) const { return slot_of_page_[page] != kNone; }
    /// Returns whether a page has to leave before another one comes.
    bool full() const { return free_.empty() && slots() < pages(); }
    /// Returns one word per root: 1 if its page is resident.
    const gpu::Buffer& shown_roots();

    /// Asks for pages, the most urgent one first. Of more than slots() pages, the first are taken. They stay until
    /// other pages are asked for. Pages that were asked for earlier and have not come follow those asked for now, as
    /// far as there is room.
    void ask(std::span<const std::uint32_t> pages);
    /// Uploads the pages that have been read. If `wait` is set and there are none, waits for one. Returns whether more
    /// pages will come. Throws Error like PageSource::read(); the pool then holds what it held, less pages that left.
    bool take(bool wait);
    /// Cancels all requests.
    void forget();
    /// Asks for pages and waits for all of them.
    void load(std::span<const std::uint32_t> pages);
    /// Removes all pages from the pool.
    void clear();

    /// Lets the pages leave that are not the same in all poses (PageSource::still()). Afterwards the source may change
    /// to another pose, since nothing reads it.
    void begin_pose();
    /// Changes to the new pose of the source. Resident pages stay. Returns false if the hierarchy over the roots has
    /// outgrown its place; the pool must then be made anew.
    bool end_pose();

    /// Sets other shading defines; scene().defines() follow.
    void set_shading(const gpu::Defines& shading) { scene_->set_shading(shading_ = shading); }
    /// Makes TraceScene::panes() of the resident tables.
    void update_panes(const TraceTables& resident) {
        scene_->update_panes(resident, rays::pack_panes(resident).get(), shading_);
    }
    /// Binds the table rows of the alpha-tested triangles in the pool, if there are any, in place of the scene's.
    void bind_rows(const gpu::Program& program) const;
    /// Returns what batches use, which decides which page leaves.
    PageUses& uses() { return uses_; }
    /// Records which slots the current batch has used: one word per slot, not 0 if used.
    void touch(std::span<const std::uint32_t> slots);

    const PageTraffic& traffic() const { return traffic_; }
    void reset_traffic() { traffic_ = {}; }

  private:
    static constexpr std::uint32_t kNone = ~0u;
    bool asked_for(std::uint32_t page) const { return asked_at_[page] == asks_; }
    std::uint32_t free_slot();
    void leave(std::uint32_t page);
    std::vector<uvec4> lay_out(const rays::Bvh& top);
    rays::PagedLayout layout(const rays::Bvh& top) const;
    void upload(std::uint32_t page, LoadedPage loaded);
    void show(std::uint32_t page, const LoadedPage* content);

    const PageSource& source_;
    std::uint32_t top_ = 0;                     // texel of the hierarchy over the roots, which follows the slots
    std::size_t top_texels_ = 0;                // room for that hierarchy
    std::vector<std::uint32_t> first_root_;     // per page, and the end
    std::vector<std::uint32_t> texel_of_root_;  // per root: texel of its node in that hierarchy
    std::vector<std::uint32_t> slot_of_page_;   // kNone: not resident
    std::vector<std::uint32_t> page_of_slot_;
    std::vector<std::uint32_t> free_;      // free slots
    std::vector<std::uint32_t> asked_;     // pages of the last ask(), the most urgent one first
    std::vector<std::uint64_t> asked_at_;  // per page: number of the last ask() that had it
    std::uint64_t asks_ = 1;               // number of the last ask()
    std::vector<std::uint64_t> used_at_;   // per page: time of its last use or upload
    std::uint64_t time_ = 0;               // uses and uploads so far
    std::vector<std::uint32_t> leaving_;   // pages that leave next, the last one first; empty: to be chosen anew
    std::vector<std::uint32_t> shown_;     // content of shown_roots_
    bool shown_changed_ = true;            // shown_roots_ has to be written
    gpu::Buffer shown_roots_;
    PageUses uses_;
    gpu::Defines shading_;
    std::optional<rays::TraceScene> scene_;
    // Per slot: table rows of its alpha-tested triangles, and LoadedPage::first_rows.
    gpu::Buffer alpha_triangles_, alpha_attributes_, first_rows_;
    PageTraffic traffic_;
    PageReader reader_;
};

}  // namespace halflight::paging
