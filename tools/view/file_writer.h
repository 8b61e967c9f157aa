// Writes files on a thread of its own, so that the window does not wait for compression and disks.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace halflight::view {

class FileWriter {
  public:
    /// changed: called from the thread after each file.
    explicit FileWriter(std::function<void()> changed);
    FileWriter(const FileWriter&) = delete;
    FileWriter& operator=(const FileWriter&) = delete;
    ~FileWriter();  ///< Waits until all files are written.

    /// Queues a file. `write` runs on the thread; its errors become results.
    void write(std::string name, std::function<void()> write);
    struct Result {
        std::string name;
        std::string error;  // empty: the file is complete
    };
    /// Returns the results since the last call, in the order of write().
    std::vector<Result> results();
    /// Waits until all files are written.
    void finish();
    /// Returns the number of files that are not written yet.
    std::size_t waiting() const;

  private:
    struct Job {
        std::string name;
        std::function<void()> write;
    };
    void run();

    const std::function<void()> changed_;
    mutable std::mutex mutex_;  // guards the members below
    std::condition_variable wake_, done_;
    std::deque<Job> jobs_;  // the first job is being written
    std::vector<Result> results_;
    bool stop_ = false;
    std::thread thread_;  // last member, so that all others exist when it starts
};

}  // namespace halflight::view
