// Hashes of byte strings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace halflight {

/// 64-bit FNV-1a hash (Fowler, Noll, Vo; IETF draft-eastlake-fnv). It tells inputs apart and is not cryptographic.
class Hash {
  public:
    void add_bytes(const void* bytes, std::size_t count) {
        const auto* at = static_cast<const unsigned char*>(bytes);
        for (std::size_t i = 0; i < count; ++i) value_ = (value_ ^ at[i]) * 0x100000001b3;
    }
    /// Adds the bytes of a value; the type must not have padding.
    template <class T>
    requires std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>
    void add(const T& value) { add_bytes(&value, sizeof(value)); }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = 0xcbf29ce484222325;
};

inline std::uint64_t hash_of(std::string_view bytes) {
    Hash hash;
    hash.add_bytes(bytes.data(), bytes.size());
    return hash.value();
}

}  // namespace halflight
