// Bytes that copies of an object share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace halflight {

/// An array of bytes whose copies share its memory until one of them is edited. Copying costs a reference count.
class SharedBytes {
  public:
    SharedBytes() = default;
    SharedBytes(std::vector<std::uint8_t> bytes)
        : bytes_(std::make_shared<std::vector<std::uint8_t>>(std::move(bytes))) {}
    SharedBytes(std::initializer_list<std::uint8_t> bytes) : SharedBytes(std::vector<std::uint8_t>(bytes)) {}

    const std::vector<std::uint8_t>& get() const {
        static const std::vector<std::uint8_t> kNothing;
        return bytes_ ? *bytes_ : kNothing;
    }
    operator const std::vector<std::uint8_t>&() const { return get(); }
    std::size_t size() const { return bytes_ ? bytes_->size() : 0; }
    bool empty() const { return size() == 0; }
    const std::uint8_t* data() const { return get().data(); }
    const std::uint8_t& operator[](std::size_t index) const { return (*bytes_)[index]; }
    auto begin() const { return get().begin(); }
    auto end() const { return get().end(); }

    /// Returns the bytes for a change, which no copy sees: they are copied first if they are shared.
    std::vector<std::uint8_t>& edit() {
        if (!bytes_ || bytes_.use_count() > 1) bytes_ = std::make_shared<std::vector<std::uint8_t>>(get());
        return *bytes_;
    }

    friend bool operator==(const SharedBytes& a, const SharedBytes& b) { return a.get() == b.get(); }

  private:
    std::shared_ptr<std::vector<std::uint8_t>> bytes_;  // null: empty
};

}  // namespace halflight
