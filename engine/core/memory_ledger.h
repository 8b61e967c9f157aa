// The memory budget of the process, and the ledger of what it holds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "engine/core/error.h"

namespace halflight {

/// Returns the bytes that the process may still take without swapping. The system has them free or can free them at
/// once, and they are left to the process's cgroup and the groups above it (cgroup v1 and v2). File cache counts as
/// free. None if the system does not tell. root: the folder of /proc and /sys.
std::optional<std::size_t> available_memory(const std::filesystem::path& root = "/");

/// Returns a size as text: "1.5 GiB", "312 MiB", "17 KiB".
std::string text_of_bytes(std::size_t bytes);
/// Parses a size: a number with an optional unit K, M, G or T, powers of 1024, which KiB, MiB, ... mean, too. None for
/// other texts and for sizes below 1.
std::optional<std::size_t> parse_bytes(std::string_view text);

/// Part of the process's memory, as statistics name it.
enum class MemoryPart : std::uint8_t {
    program,     // program, driver and compiled shaders
    scene,       // meshes, textures and environment as read
    tables,      // tables and hierarchies of scenes, on CPU and device
    picture,     // pictures with their layers, copies and buffers for writing them
    bands,       // buffers of bands
    visibility,  // tile lists that are carried from sample to sample
    textures,    // pool of texture tiles, and tables for it
    pages,       // pages and table rows of scenes larger than memory, and buffers of their conversion
};
inline constexpr std::size_t kMemoryParts = 8;
const char* name(MemoryPart part);

/// Bytes of MemoryPart::program: those of a first run, which compiles all shaders (measured, and rounded up).
inline constexpr std::size_t kProgramBytes = std::size_t{160} << 20;

/// Error of something that does not fit into the memory budget.
class BudgetError : public Error {
  public:
    using Error::Error;
};

/// A limit for the memory of a process, and the bytes that its parts hold. Parts are sizes of large arrays and upper
/// estimates of everything else. Thread-safe.
class MemoryLedger {
  public:
    /// Bytes that a part holds until the entry is destroyed.
    class Entry {
      public:
        Entry() = default;
        Entry(MemoryLedger& ledger, MemoryPart part, std::size_t bytes);
        Entry(Entry&& other) noexcept;
        Entry& operator=(Entry&& other) noexcept;
        ~Entry();
        std::size_t bytes() const { return bytes_; }

      private:
        MemoryLedger* ledger_ = nullptr;
        MemoryPart part_ = MemoryPart::program;
        std::size_t bytes_ = 0;
    };

    /// Returns the ledger of this process. Its limit is three quarters of available_memory() at the first call, or none
    /// if the system does not tell.
    static MemoryLedger& process();

    explicit MemoryLedger(std::size_t limit) : limit_(limit) {}
    /// Sets the limit, bytes.
    void set_limit(std::size_t bytes);
    std::size_t limit() const;
    std::size_t bytes(MemoryPart part) const;
    /// Returns the bytes that are left; 0 if the parts hold more than the limit.
    std::size_t free() const;

    /// Throws BudgetError about `subject` if fewer than `bytes` are left. what: "textures 3.0 GiB, picture 17 MiB".
    void check(std::size_t bytes, std::string_view subject, std::string_view what) const;

  private:
    void add(MemoryPart part, std::size_t bytes);
    void remove(MemoryPart part, std::size_t bytes);

    mutable std::mutex mutex_;
    std::size_t limit_;
    std::array<std::size_t, kMemoryParts> bytes_{};
};

}  // namespace halflight
