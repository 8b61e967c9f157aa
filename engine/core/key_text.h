// Texts of keys and values that tell pictures apart: "sources=0123456789abcdef;samples=16;scene=fedcba9876543210".
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace halflight {

/// Text of keys and values, in the order in which they were added. Keys are unique.
class KeyText {
  public:
    KeyText() = default;
    explicit KeyText(std::string text) : text_(std::move(text)) {}

    /// Adds a value. A hash stands for one that is long, or has characters other than letters, digits and "
    /// +-.,:/%()_".
    KeyText& add(std::string_view key, std::string_view value);
    const std::string& text() const { return text_; }

  private:
    std::string text_;
};

/// Returns the value of a key; empty if the text lacks it.
std::string value_of(std::string_view text, std::string_view key);

/// Returns whether two texts are equal. The values of "sources" may differ if each is one of `accepted` or
/// `own`, the hash of this program's sources.
bool same_keys(const std::string& found, const std::string& expected, std::string_view own,
               std::span<const std::string> accepted);

/// Returns what differs, as phrases: "samples is 4, not 8; scene differs". A key that is missing has its usual value.
/// Texts without keys, of other programs and versions, have no fingerprint.
std::string differences(const std::string& found, const std::string& expected);

}  // namespace halflight
