#include "tools/view/file_writer.h"

#include <exception>
#include <new>
#include <utility>

namespace halflight::view {

FileWriter::FileWriter(std::function<void()> changed) : changed_(std::move(changed)), thread_([this] { run(); }) {}

FileWriter::~FileWriter() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

void FileWriter::write(std::string name, std::function<void()> write) {
    const std::lock_guard lock(mutex_);
    jobs_.push_back({std::move(name), std::move(write)});
    wake_.notify_all();
}

std::vector<FileWriter::Result> FileWriter::results() {
    const std::lock_guard lock(mutex_);
    return std::exchange(results_, {});
}

void FileWriter::finish() {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [&] { return jobs_.empty(); });
}

std::size_t FileWriter::waiting() const {
    const std::lock_guard lock(mutex_);
    return jobs_.size();
}

void FileWriter::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        wake_.wait(lock, [&] { return stop_ || !jobs_.empty(); });
        if (jobs_.empty()) return;
        Job& job = jobs_.front();  // deques keep the place of an element while others are added
        lock.unlock();
        std::string error;
        try {
            job.write();
        } catch (const std::bad_alloc&) {
            error = "out of memory";
        } catch (const std::exception& e) {
            error = e.what();
        }
        job.write = {};  // frees the picture before the next one is written
        lock.lock();
        results_.push_back({job.name, error});
        jobs_.pop_front();
        done_.notify_all();
        lock.unlock();
        changed_();
        lock.lock();
    }
}

}  // namespace halflight::view
