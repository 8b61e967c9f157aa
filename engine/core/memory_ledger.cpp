#include "engine/core/memory_ledger.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <numeric>
#include <sstream>
#include <utility>

#include "engine/core/error.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

/// Returns the number in a file of one number; none for files that are missing or contain a word, such as "max".
std::optional<std::size_t> number_in(const fs::path& file) {
    std::ifstream in(file);
    std::size_t value = 0;
    return in >> value ? std::optional(value) : std::nullopt;
}

/// Returns the number after `key` in a file of lines "key number"; 0 if there is none.
std::size_t number_after(const fs::path& file, std::string_view key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::string word;
        std::size_t value = 0;
        if (words >> word >> value && word == key) return value;
    }
    return 0;
}

/// Names of a cgroup's files, which differ between the versions of the interface.
struct GroupFiles {
    const char *limit, *usage, *cache;  // cache: key in memory.stat of file cache that can be freed at once
};
constexpr GroupFiles kVersion1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr GroupFiles kVersion2{"memory.max", "memory.current", "inactive_file"};

/// Returns the bytes that a group and the groups above it, up to `top`, leave free.
std::size_t left_to_group(const fs::path& top, const fs::path& group, const GroupFiles& files) {
    std::size_t left = kNoLimit;
    for (fs::path folder = top / group.relative_path();; folder = folder.parent_path()) {
        const std::optional<std::size_t> limit = number_in(folder / files.limit);
        const std::optional<std::size_t> usage = number_in(folder / files.usage);
        if (limit && usage) {
            const std::size_t used = *usage - std::min(*usage, number_after(folder / "memory.stat", files.cache));
            left = std::min(left, *limit - std::min(*limit, used));
        }
        if (folder == top || !folder.has_relative_path()) return left;
    }
}

/// Returns the bytes that the process's cgroups leave free (cgroups(7): lines "number:controllers:group").
std::size_t left_to_cgroups(const fs::path& root) {
    std::size_t left = kNoLimit;
    std::ifstream in(root / "proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = fmt::format(",{},", line.substr(first + 1, second - first - 1));
        // The path without "/" at its end, so that the loop over parents meets `top`.
        const fs::path group = fs::path(line.substr(second + 1)).lexically_normal();
        const fs::path below = group == "/" ? fs::path() : group;
        if (controllers == ",,") left = std::min(left, left_to_group(root / "sys/fs/cgroup", below, kVersion2));
        if (controllers.find(",memory,") != std::string::npos)
            left = std::min(left, left_to_group(root / "sys/fs/cgroup/memory", below, kVersion1));
    }
    return left;
}

}  // namespace

std::optional<std::size_t> available_memory(const fs::path& root) {
    const std::size_t kilobytes = number_after(root / "proc/meminfo", "MemAvailable:");
    const std::size_t left = std::min(kilobytes > 0 ? kilobytes * 1024 : kNoLimit, left_to_cgroups(root));
    return left == kNoLimit ? std::nullopt : std::optional(left);
}

std::string text_of_bytes(std::size_t bytes) {
    constexpr const char* kUnits[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    auto value = static_cast<double>(bytes);
    std::size_t unit = 0;
    for (; value >= 1024 && unit + 1 < std::size(kUnits); ++unit) value /= 1024;
    return fmt::format("{:.{}f} {}", value, value < 10 && unit > 0 ? 1 : 0, kUnits[unit]);
}

std::optional<std::size_t> parse_bytes(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
    if (error != std::errc()) return std::nullopt;
    std::string_view unit(end, text.data() + text.size());
    if (unit.starts_with(' ')) unit.remove_prefix(1);
    if (!unit.empty()) {
        const std::size_t power = std::string_view("KMGT").find(unit[0]);
        if (power == std::string_view::npos || (unit.size() > 1 && unit.substr(1) != "iB")) return std::nullopt;
        for (std::size_t i = 0; i <= power; ++i) value *= 1024;
    }
    if (!(value >= 1 && value < 0x1p63)) return std::nullopt;
    return static_cast<std::size_t>(value);
}

const char* name(MemoryPart part) {
    constexpr std::array<const char*, kMemoryParts> kNames = {"program", "scene",      "tables",   "picture",
                                                              "bands",   "visibility", "textures", "pages"};
    return kNames.at(static_cast<std::size_t>(part));
}

MemoryLedger::Entry::Entry(MemoryLedger& ledger, MemoryPart part, std::size_t bytes)
    : ledger_(&ledger), part_(part), bytes_(bytes) {
    ledger.add(part, bytes);
}
MemoryLedger::Entry::Entry(Entry&& other) noexcept
    : ledger_(std::exchange(other.ledger_, nullptr)), part_(other.part_), bytes_(std::exchange(other.bytes_, 0)) {}
MemoryLedger::Entry& MemoryLedger::Entry::operator=(Entry&& other) noexcept {
    std::swap(ledger_, other.ledger_);
    std::swap(part_, other.part_);
    std::swap(bytes_, other.bytes_);
    return *this;
}
MemoryLedger::Entry::~Entry() {
    if (ledger_) ledger_->remove(part_, bytes_);
}

MemoryLedger& MemoryLedger::process() {
    static MemoryLedger ledger([] {
        const std::optional<std::size_t> available = available_memory();
        return available ? *available / 4 * 3 : kNoLimit;
    }());
    static const Entry program(ledger, MemoryPart::program, kProgramBytes);
    return ledger;
}

void MemoryLedger::set_limit(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    limit_ = bytes;
}
std::size_t MemoryLedger::limit() const {
    const std::lock_guard lock(mutex_);
    return limit_;
}
std::size_t MemoryLedger::bytes(MemoryPart part) const {
    const std::lock_guard lock(mutex_);
    return bytes_.at(static_cast<std::size_t>(part));
}
std::size_t MemoryLedger::free() const {
    const std::lock_guard lock(mutex_);
    return limit_ - std::min(limit_, std::accumulate(bytes_.begin(), bytes_.end(), std::size_t{0}));
}

void MemoryLedger::check(std::size_t bytes, std::string_view subject, std::string_view what) const {
    const std::size_t left = free();
    if (bytes <= left) return;
    throw BudgetError(subject, "needs {} of memory ({}), and {} of the budget of {} are left (--memory)",
                      text_of_bytes(bytes), what, text_of_bytes(left), text_of_bytes(limit()));
}

void MemoryLedger::add(MemoryPart part, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    bytes_.at(static_cast<std::size_t>(part)) += bytes;
}
void MemoryLedger::remove(MemoryPart part, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    bytes_.at(static_cast<std::size_t>(part)) -= bytes;
}

}  // namespace halflight
