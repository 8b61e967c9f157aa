// Reads and appends values of stored bytes, which are little-endian.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace halflight::paging {

static_assert(std::endian::native == std::endian::little);

template <class T>
void append_bytes(const T* values, std::size_t count, std::string& bytes) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

/// Reads values from bytes; a read beyond their end gives zeros and makes ok() false.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
    bool ok() const { return ok_; }
    bool at_end() const { return ok_ && bytes_.empty(); }

    std::string_view take(std::uint64_t count) {
        ok_ = ok_ && count <= bytes_.size();
        if (!ok_) return {};
        const std::string_view taken = bytes_.substr(0, count);
        bytes_.remove_prefix(count);
        return taken;
    }
    template <class T>
    T value() {
        T result{};
        const std::string_view from = take(sizeof(T));
        if (ok_) std::memcpy(&result, from.data(), sizeof(T));
        return result;
    }
    /// Reads a vector, whose length precedes it.
    template <class T>
    std::vector<T> list() {
        const auto count = value<std::uint64_t>();
        ok_ = ok_ && count <= bytes_.size() / sizeof(T);
        std::vector<T> values(ok_ ? count : 0);
        const std::string_view from = take(values.size() * sizeof(T));
        if (ok_ && !values.empty()) std::memcpy(values.data(), from.data(), from.size());
        return values;
    }

  private:
    std::string_view bytes_;
    bool ok_ = true;
};

}  // namespace halflight::paging
