// The pages that the batches of a frame use: visibility state that is carried from sample to sample and from frame to
// frame. It affects time only. No OpenGL is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace halflight::paging {

class PageUses {
  public:
    /// Number of batches that are told apart. Later ones share the state of earlier ones.
    static constexpr std::uint32_t kBatches = 64;

    explicit PageUses(std::size_t pages) : users_(pages, 0), touched_(pages, false) {}

    /// Starts a run of a batch. Batches are numbered in the order in which a frame runs them.
    void begin(std::uint32_t batch);
    /// Records that the batch uses a page.
    void touch(std::uint32_t page) { touched_[page] = true; }
    bool touched(std::uint32_t page) const { return touched_[page]; }
    /// Ends the run. The pages that it has touched are the set of the batch.
    void end();
    /// Forgets the sets of all batches.
    void forget();
    /// Changes the number of pages to `pages`. The sets keep their first `still` pages alone.
    void follow(std::size_t pages, std::size_t still);

    /// Returns the pages that the last run of the current batch has touched, in ascending order.
    std::vector<std::uint32_t> set() const;
    /// Returns the number of batches until a page is used next, if all batches use what they used last. It is 0 for
    /// pages of the current batch, and kBatches for pages that no batch uses.
    std::uint32_t next_use(std::uint32_t page) const;

  private:
    std::vector<std::uint64_t> users_;  // per page, a bit for each batch whose set has it
    std::vector<bool> touched_;         // per page, in the current run
    int batch_ = 0;                     // bit of the current batch
};

}  // namespace halflight::paging
