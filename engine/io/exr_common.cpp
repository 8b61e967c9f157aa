#include "engine/io/exr_common.h"

#include <Iex.h>
#include <ImfThreading.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "engine/core/process.h"
#include "engine/core/thread_limit.h"

namespace halflight {

int exr_threads() {
    static const int threads = [] {
        const int count = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
        // OpenEXR uses freed memory if a part of its threads cannot be started, and a finished picture must not be
        // lost. The kernel may still count the threads of this check when OpenEXR starts its own, so there are twice as
        // many.
        if (startable_threads(2 * count) < 2 * count) return 0;
        Imf::setGlobalThreadCount(count);
        return count;
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
