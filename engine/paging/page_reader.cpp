#include "engine/paging/page_reader.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace halflight::paging {

PageReader::PageReader(const PageSource& source) : source_(source), thread_([this] { work(); }) {}

PageReader::~PageReader() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void PageReader::ask(std::span<const std::uint32_t> pages) {
    {
        const std::lock_guard lock(mutex_);
        std::vector<std::uint32_t> read = reading_;
        for (const Arrival& arrival : arrived_) read.push_back(arrival.page);
        std::ranges::sort(read);
        queue_.clear();
        std::ranges::copy_if(pages, std::back_inserter(queue_),
                             [&](std::uint32_t page) { return !std::ranges::binary_search(read, page); });
    }
    changed_.notify_all();
}

std::vector<PageReader::Arrival> PageReader::take(bool wait) {
    std::unique_lock lock(mutex_);
    if (wait) {
        changed_.wait(lock, [&] { return error_ || !arrived_.empty() || (queue_.empty() && reading_.empty()); });
    }
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    std::vector<Arrival> taken = std::exchange(arrived_, {});
    lock.unlock();
    changed_.notify_all();
    return taken;
}

void PageReader::work() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return stop_ || (!queue_.empty() && arrived_.size() < kMostArrived); });
        if (stop_) return;
        const auto end = queue_.begin() + static_cast<std::ptrdiff_t>(std::min(kPortion, queue_.size()));
        reading_.assign(queue_.begin(), end);
        queue_.erase(queue_.begin(), end);
        const std::vector<std::uint32_t> pages = reading_;
        lock.unlock();
        std::vector<Arrival> read(pages.size());
        std::exception_ptr error;
        try {
            tbb::parallel_for(std::size_t{0}, pages.size(), [&](std::size_t i) {
                read[i] = {pages[i], read_with_rows(source_, pages[i])};
            });
        } catch (...) {
            error = std::current_exception();
        }
        lock.lock();
        reading_.clear();
        if (error) {
            error_ = error;
            queue_.clear();
        } else {
            std::ranges::move(read, std::back_inserter(arrived_));
        }
        changed_.notify_all();
    }
}

}  // namespace halflight::paging
