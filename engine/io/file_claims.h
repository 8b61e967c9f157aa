// Claims by which processes that write the same numbered files share the work.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "engine/core/frames.h"

namespace halflight {

/// Claims on the files of a pattern. A claim is the lock of a byte of an empty file beside them. The kernel drops the
/// lock when the process ends, however it ends. The last process that uses the empty file removes it; if all were
/// killed, the next one does. On file systems without locks every process gets every claim.
class FileClaims {
  public:
    explicit FileClaims(const std::filesystem::path& pattern);
    FileClaims(const FileClaims&) = delete;
    FileClaims& operator=(const FileClaims&) = delete;
    ~FileClaims();

    /// Claims the file of this frame, and gives up the claim before it. Returns false while another object has the
    /// claim. Throws Error if the folder cannot be written.
    bool take(FrameNumber frame);
    /// Returns whether another object has a claim.
    bool others() const;
    void release();  ///< Gives up the claim, if there is one.

  private:
    bool lock(short type, std::uint64_t start, std::uint64_t count) const;
    bool is_named() const;
    void close();

    std::string subject_;
    std::filesystem::path name_;  // name of the empty file
    int file_ = -1;
};

}  // namespace halflight
