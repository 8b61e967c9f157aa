#include "engine/io/file_claims.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "engine/core/error.h"
#include "engine/io/temporary_name.h"

namespace halflight {

FileClaims::FileClaims(const std::filesystem::path& pattern)
    : subject_(pattern.string()), name_(pattern.parent_path() / (temporary_prefix(pattern) + "claims")) {}

FileClaims::~FileClaims() {
    if (file_ < 0) file_ = open(name_.c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC);  // a killed process may have left it
    if (file_ < 0) return;
    release();
    if (lock(F_WRLCK, 0, 0) && is_named()) unlink(name_.c_str());
    close();
}

bool FileClaims::take(FrameNumber frame) {
    release();
    for (;;) {
        if (file_ < 0) {
            file_ = open(name_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
            if (const int why = errno; file_ < 0) {
                std::error_code none;
                throw Error(std::filesystem::exists(name_, none) ? name_.string() : subject_, "cannot write: {}",
                            std::generic_category().message(why));
            }
            fchmod(file_, 0666);  // other users may render frames, too; fails if one of them has made the file
        }
        if (!lock(F_WRLCK, static_cast<std::uint64_t>(frame - kLeastFrame), 1) && (errno == EAGAIN || errno == EACCES))
            return false;
        if (is_named()) return true;
        close();  // another process has removed the file, and a third one may have made it anew
    }
}

bool FileClaims::others() const {
    struct flock range {};
    range.l_type = F_WRLCK;
    range.l_whence = SEEK_SET;
    return file_ >= 0 && fcntl(file_, F_OFD_GETLK, &range) == 0 && range.l_type != F_UNLCK;
}

void FileClaims::release() {
    if (file_ >= 0) lock(F_UNLCK, 0, 0);
}

/// Changes the lock of bytes; `count` 0: up to the end.
bool FileClaims::lock(short type, std::uint64_t start, std::uint64_t count) const {
    struct flock range {};
    range.l_type = type;
    range.l_whence = SEEK_SET;
    range.l_start = static_cast<off_t>(start);
    range.l_len = static_cast<off_t>(count);
    return fcntl(file_, F_OFD_SETLK, &range) == 0;
}

/// Returns whether the open file still has its name.
bool FileClaims::is_named() const {
    struct stat opened = {}, named = {};
    return fstat(file_, &opened) == 0 && lstat(name_.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
           opened.st_ino == named.st_ino;
}

void FileClaims::close() {
    ::close(std::exchange(file_, -1));
}

}  // namespace halflight
