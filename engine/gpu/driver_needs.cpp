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
#include <system_error>
#include <thread>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/thread_limit.h"
#include "engine/gpu/context.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kThreadStack = 8 * kMiB;  // greatest stack of a thread

/// Returns the bytes of address space that the process uses.
std::uint64_t used_address_space() {
    std::uint64_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;  // 0 if there is no such file
    return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Name of the folder of a cache that has a file for each entry, and a counter of their bytes in its index.
constexpr const char* kFiles = "mesa_shader_cache";

/// Returns the folder of Mesa's shader caches; empty if there is none. Mesa 22 to 25 search in this order.
fs::path cache_parent() {
    for (const char* const variable : {"MESA_SHADER_CACHE_DIR", "MESA_GLSL_CACHE_DIR", "XDG_CACHE_HOME"})
        if (const char* const folder = std::getenv(variable); folder && *folder) return folder;
    passwd user{}, *found = nullptr;
    std::vector<char> text(4096);
    if (getpwuid_r(getuid(), &user, text.data(), text.size(), &found) != 0 || !found) return {};
    return fs::path(found->pw_dir) / ".cache";
}

/// Returns whether a variable of Mesa is set to true, or to false; other values are neither.
bool is_set_to(const char* variable, bool wanted) {
    const char* const value = std::getenv(variable);
    return value != nullptr && *value != '\0' && std::strchr(wanted ? "1tTyY" : "0fFnN", *value) != nullptr;
}

bool cache_is_disabled() {
    return is_set_to("MESA_SHADER_CACHE_DISABLE", true) || is_set_to("MESA_GLSL_CACHE_DISABLE", true);
}

constexpr int kNotOpened = -1;

/// Reserves the space of an index, which is created if it is absent. Returns 0, or the error of the system if Mesa
/// would map a file without space, or kNotOpened.
int reserve_index(const fs::path& index) {
    // Size of the index in Mesa 17 to 25: a counter, and 2^16 keys of 20 bytes.
    constexpr off_t kIndexBytes = 8 + (off_t{1} << 16) * 20;
    const fs::path folder = index.parent_path();
    for (const fs::path& made : {folder.parent_path(), folder}) mkdir(made.c_str(), 0700);  // Mesa makes folders, too
    const bool is_new = access(index.c_str(), F_OK) != 0;
    const int file = open(index.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0) return kNotOpened;  // Mesa cannot open it either, and says so on stderr
    const int error = posix_fallocate(file, 0, kIndexBytes);
    close(file);
    if (error != 0 && is_new) unlink(index.c_str());
    return error;
}

/// Returns the greatest number of threads in each of the two pools of Mesa's software driver (Mesa 22 to 25). The
/// driver counts the processors that the process may use, which are fewer than the machine's in a cpuset.
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

/// Returns the stack size of threads that start from now on, in bytes; at least kThreadStack.
std::uint64_t thread_stack() {
    std::size_t size = 0;
#ifdef __GLIBC__
    pthread_attr_t attributes;
    if (pthread_getattr_default_np(&attributes) == 0) {
        pthread_attr_getstacksize(&attributes, &size);
        pthread_attr_destroy(&attributes);
    }
#endif
    return std::max<std::uint64_t>(size, kThreadStack);
}

void check_address_space(int threads) {
    // Measured with Mesa's software driver on small scenes: 420 MiB with the 8 threads that two cores take.
    const std::uint64_t needed = 448 * kMiB + thread_stack() * static_cast<std::uint64_t>(threads);
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

}  // namespace

void prepare_process() {
    limit_thread_stacks();
    // The XDG Base Directory Specification ignores such values; Mesa does not.
    if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache && *cache != '/') unsetenv("XDG_CACHE_HOME");
    // Mesa 25.0 keeps a database unless told otherwise. It has no counter that tells when an entry is on disk.
    setenv("MESA_DISK_CACHE_MULTI_FILE", "true", 1);
    for (const char* const other : {"MESA_DISK_CACHE_DATABASE", "MESA_DISK_CACHE_SINGLE_FILE"}) unsetenv(other);
    // Mesa writes to the index through a mapping. The kernel answers such a write by SIGBUS if the disk is full.
    if (const fs::path parent = cache_parent();
        !cache_is_disabled() && !parent.empty() && reserve_index(parent / kFiles / "index") != 0)
        setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
    // Zink compiles copies of kernels for values of uniforms, unless a GPU runs them. After many values of one kernel,
    // Mesa 22.3 uses a copy for other values.
    setenv("ZINK_INLINE_UNIFORMS", "0", 0);
    // Drivers that do not work are skipped, or named by an Error.
    setenv("EGL_LOG_LEVEL", "fatal", 0);
}

void check_process(int displays) {
    static std::once_flag once;
    std::call_once(once, [displays] {
        const int threads = needed_threads(displays);
        check_address_space(threads);
        check_stack();
        check_threads(threads);
    });
}

std::string reason_against_driver(std::string_view renderer, std::string_view version) {
    if (version.find("Mesa") == std::string_view::npos) return "";
    if (renderer.starts_with("zink") && is_software_renderer(renderer) && !is_set_to("ZINK_INLINE_UNIFORMS", false))
        return "zink renders wrong pictures unless ZINK_INLINE_UNIFORMS is 0 in the environment";
    const fs::path parent = cache_parent();
    if (cache_is_disabled() || parent.empty()) return "";
    for (const char* const kind : {kFiles, "mesa_shader_cache_db", "mesa_shader_cache_sf"}) {
        const fs::path index = parent / kind / "index";
        if (access(index.c_str(), F_OK) != 0) continue;  // Mesa uses another kind of cache
        if (const int error = reserve_index(index); error > 0)
            return fmt::format(
                "Mesa's shader cache {} has no space ({}), and MESA_SHADER_CACHE_DISABLE is not true in "
                "the environment",
                index.parent_path().string(), std::generic_category().message(error));
    }
    return "";
}

bool mesa_keeps_code() {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);)
        if (line.ends_with(fmt::format("/{}/index", kFiles))) return true;
    return false;
}

std::uint64_t mesa_cache_bytes() {
    static const fs::path index = cache_parent() / kFiles / "index";  // Mesa, too, searches it only once
    std::uint64_t bytes = 0;                                          // Mesa 17 to 25: the first word of the index
    const int file = open(index.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (file >= 0 && pread(file, &bytes, sizeof(bytes), 0) != sizeof(bytes)) bytes = 0;
    if (file >= 0) close(file);
    return bytes;
}

void wait_for_mesa_code(std::uint64_t before, std::chrono::steady_clock::time_point finished) {
    constexpr std::chrono::milliseconds kMost{15};
    while (mesa_cache_bytes() == before && std::chrono::steady_clock::now() < finished + kMost)
        std::this_thread::sleep_for(std::chrono::microseconds(200));
}

}  // namespace halflight::gpu
