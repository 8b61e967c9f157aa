// Reads pages in the background, while the device traces. No OpenGL is used.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "engine/paging/pages.h"

namespace halflight::paging {

/// A queue of pages, and the thread that reads them. The thread owns a page until it has arrived; take() hands it over.
/// All functions are for one thread, the owner of the object.
class PageReader {
  public:
    struct Arrival {
        std::uint32_t page = 0;
        LoadedPage content;
    };
    /// Maximum number of pages that wait for take(). More are not read.
    static constexpr std::size_t kMostArrived = 64;
    static constexpr std::size_t kPortion = 8;  // pages that are read in parallel

    /// The source outlives the reader.
    explicit PageReader(const PageSource& source);
    PageReader(const PageReader&) = delete;
    PageReader& operator=(const PageReader&) = delete;
    /// Waits for the pages that are being read; the rest of the queue is not read.
    ~PageReader();

    /// Replaces the queue. Pages are read in this order. Pages that are being read or have arrived are not read again.
    void ask(std::span<const std::uint32_t> pages);
    /// Returns the pages that have arrived. If `wait` is set and there are none, waits for one, unless the queue is
    /// empty. Throws the Error of a page that could not be read; the queue is then empty.
    std::vector<Arrival> take(bool wait);

  private:
    void work();

    const PageSource& source_;
    std::mutex mutex_;  // guards all that follows
    std::condition_variable changed_;
    std::deque<std::uint32_t> queue_;
    std::vector<std::uint32_t> reading_;
    std::vector<Arrival> arrived_;
    std::exception_ptr error_;
    bool stop_ = false;
    std::thread thread_;  // the last member, because the thread uses the others
};

}  // namespace halflight::paging
