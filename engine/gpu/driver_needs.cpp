#include "engine/gpu/driver_needs.h"

#include <fcntl.h>
#include <pthread.h>
#include <pwd.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/thread_limit.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kThreadStack = 8 * kMiB;  // greatest stack of a thread

/// Returns the bytes of address space that the process uses.
std::uint64_t used_address_space() {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;  // 0 where there is no such file
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Returns the folder of Mesa's shader cache; empty where there is none. Mesa 22 and 23 search in this order.
fs::path mesa_cache() {
    constexpr const char* kName = "mesa_shader_cache";
    for (const char* const variable : {"MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR", "XDG_CACHE_HOME"})
        if (const char* const folder = std::getenv(variable); folder && *folder) return fs::path(folder) / kName;
    passwd user{}, *found = nullptr;
    std::vector<char> text(4096);
    if (getpwuid_r(getuid(), &user, text.data(), text.size(), &found) != 0 || !found) return {};
    return fs::path(found->pw_dir) / ".cache" / kName;
}

/// Reserves the space of the index; returns false where Mesa would map a file without space.
bool reserve_index(const fs::path& folder) {
    // Size of the index in Mesa 17 to 23: a counter, and 2^16 keys of 20 bytes.
    constexpr off_t kIndexBytes = 8 + (off_t{1} << 16) * 20;
    for (const fs::path& made : {folder.parent_path(), folder}) mkdir(made.c_str(), 0700);  // Mesa makes them likewise
    const fs::path index = folder / "index";
    const bool is_new = access(index.c_str(), F_OK) != 0;
    const int file = open(index.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0) return false;  // Mesa 22.3 cannot open it either, and would say so on stderr
    const bool reserved = posix_fallocate(file, 0, kIndexBytes) == 0;
    close(file);
    if (!reserved && is_new) unlink(index.c_str());
    return reserved;
}

/// Returns the greatest number of threads in each of the two pools of Mesa's software driver (Mesa 22.3). The driver
/// counts the processors that the process may use, which are fewer than the machine's in a cpuset.
int pool_threads() {
    cpu_set_t allowed;
    int threads = sched_getaffinity(0, sizeof allowed, &allowed) == 0
                      ? CPU_COUNT(&allowed)
                      : static_cast<int>(std::thread::hardware_concurrency());
    if (const char* const asked = std::getenv("LP_NUM_THREADS"))
        std::from_chars(asked, asked + std::strlen(asked), threads);
    return std::clamp(threads, 1, 32);
}

/// Returns the threads that pictures take besides the main one: TBB's workers, and two pools, the writer of Mesa's
/// cache and a reader or renderer for each display. Two are spare for each, because the kernel counts ended threads for
/// a while.
int needed_threads(int displays) {
    const auto builders = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return displays * (2 * pool_threads() + 4) + static_cast<int>(builders) - 1;
}

void check_address_space(int threads) {
    // Measured with Mesa's software driver on small scenes: 420 MiB with the 8 threads that two cores take.
    const std::uint64_t needed = 448 * kMiB + kThreadStack * static_cast<std::uint64_t>(threads);
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
    const std::uint64_t used = used_address_space();
    const std::uint64_t free = limit.rlim_cur > used ? limit.rlim_cur - used : 0;
    if (free < needed)
        throw Error("GPU",
                    "the address space is limited to {} MiB (ulimit -v), of which {} MiB are left; drivers need {} MiB",
                    limit.rlim_cur / kMiB, free / kMiB, needed / kMiB);
}

void check_stack() {
    // The smallest limit that worked with Mesa's software driver was 320 KiB. The rest is a margin for larger shaders.
    constexpr rlim_t kNeeded = rlim_t{1} << 20;
    rlimit limit{};
    if (getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur < kNeeded)
        throw Error("GPU", "the stack is limited to {} KiB (ulimit -s); drivers need {} KiB", limit.rlim_cur / 1024,
                    kNeeded / 1024);
}

/// Threads reserve as much address space as the stack may grow to, which may be more than there is.
void limit_thread_stacks() {
#ifdef __GLIBC__
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
    pthread_attr_t attributes;
    if (pthread_getattr_default_np(&attributes) != 0) return;
    std::size_t size = 0;
    if (pthread_attr_getstacksize(&attributes, &size) == 0 && size > kThreadStack &&
        pthread_attr_setstacksize(&attributes, kThreadStack) == 0)
        pthread_setattr_default_np(&attributes);
    pthread_attr_destroy(&attributes);
#endif
}

/// Mesa's software driver waits without end for threads that could not be started.
void check_threads(int needed) {
    const int started = startable_threads(needed);
    if (started < needed)
        throw Error("GPU",
                    "only {} of the {} threads that drivers need can be started (ulimit -u, ulimit -v, pids.max of the "
                    "cgroup); --threads and LP_NUM_THREADS lower the need",
                    started, needed);
}

void secure_shader_cache() {
    const fs::path folder = mesa_cache();
    // Mesa writes to the index through a mapping. The kernel answers such a write by SIGBUS where the disk is full.
    if (!folder.empty() && !reserve_index(folder)) setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
}

}  // namespace

bool mesa_keeps_code() {
    const auto is_set = [](const char* variable) {
        const char* const value = std::getenv(variable);
        return value != nullptr && std::strchr("1tTyY", *value) != nullptr && *value != '\0';
    };
    const fs::path folder = mesa_cache();
    return !is_set("MESA_SHADER_CACHE_DISABLE") && !is_set("MESA_GLSL_CACHE_DISABLE") && !folder.empty() &&
           access((folder / "index").c_str(), W_OK) == 0;
}

void prepare_for_drivers(int displays) {
    static std::once_flag once;
    std::call_once(once, [displays] {
        const int threads = needed_threads(displays);
        check_address_space(threads);
        check_stack();
        limit_thread_stacks();
        check_threads(threads);
        // The XDG Base Directory Specification ignores such values; Mesa does not.
        if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache && *cache != '/') unsetenv("XDG_CACHE_HOME");
        secure_shader_cache();
        // Zink compiles copies of kernels for values of uniforms, unless a GPU runs them. After many values of one
        // kernel, Mesa 22.3 uses a copy for other values.
        setenv("ZINK_INLINE_UNIFORMS", "0", 0);
        // Drivers that do not work are skipped, or named by an Error.
        setenv("EGL_LOG_LEVEL", "fatal", 0);
    });
}

}  // namespace halflight::gpu
