#include "engine/io/exr_common.h"

#include <Iex.h>
#include <ImfThreading.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <system_error>
#include <thread>

#include "engine/core/process.h"

namespace halflight {

int exr_threads() {
    static const int threads = [] {
        const int count = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
        try {
            Imf::setGlobalThreadCount(count);
            return count;
        } catch (const std::system_error&) {  // a finished picture must not be lost for want of threads
            Imf::setGlobalThreadCount(0);
            return 0;
        }
    }();
    static const pid_t owner = getpid();
    check_not_forked(owner, "OpenEXR");
    return threads;
}

dmat4 exr_camera_from_camera() {
    return {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}};
}

dmat4 exr_ndc_from_clip() {
    return {{0.5, 0, 0, 0}, {0, -0.5, 0, 0}, {0, 0, 1, 0}, {0.5, 0.5, 0, 1}};
}

bool ExrInput::read(char* out, int count) {
    const auto wanted = static_cast<std::uint64_t>(count);
    if (count < 0 || position_ > bytes_.size() || wanted > bytes_.size() - position_)
        throw Iex::InputExc("unexpected end of file");
    std::memcpy(out, bytes_.data() + position_, wanted);
    position_ += wanted;
    return position_ < bytes_.size();
}

}  // namespace halflight
