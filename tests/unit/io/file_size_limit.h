// Makes writes fail in the middle of a file, as on a full disk.
#pragma once

#include <sys/resource.h>

#include <csignal>

namespace halflight::test {

/// Limits the size of files that this process writes, bytes, until the object is destroyed.
class FileSizeLimit {
  public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &whole_);
        const rlimit tight{bytes, whole_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &tight);
    }
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &whole_);
        std::signal(SIGXFSZ, handler_);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

  private:
    void (*handler_)(int);
    rlimit whole_{};
};

}  // namespace halflight::test
