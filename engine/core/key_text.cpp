#include "engine/core/key_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>
#include <vector>

#include "engine/core/hash.h"

namespace halflight {
namespace {

constexpr std::size_t kHash = 16;  // hexadecimal digits of a hash

bool is_plain(std::string_view value) {
    constexpr std::size_t kLongest = 40;
    constexpr std::string_view kOthers = " +-.,:/%()_";
    return value.size() <= kLongest && std::ranges::all_of(value, [&](unsigned char c) {
               return c < 128 && (std::isalnum(c) || kOthers.find(static_cast<char>(c)) != std::string_view::npos);
           });
}

bool is_hash(std::string_view value) {
    return value.size() == kHash && std::ranges::all_of(value, [](unsigned char c) { return std::isxdigit(c); });
}

using Keys = std::vector<std::pair<std::string_view, std::string_view>>;

/// Splits a text into keys and values; a part without a value has none.
Keys keys_of(std::string_view text) {
    Keys keys;
    while (!text.empty()) {
        const std::string_view part = text.substr(0, text.find(';'));
        text.remove_prefix(std::min(part.size() + 1, text.size()));
        if (const std::size_t at = part.find('='); at != std::string_view::npos)
            keys.emplace_back(part.substr(0, at), part.substr(at + 1));
    }
    return keys;
}

std::optional<std::string_view> find(const Keys& keys, std::string_view key) {
    const auto at = std::ranges::find(keys, key, [](const auto& k) { return k.first; });
    return at == keys.end() ? std::nullopt : std::optional(at->second);
}

}  // namespace

KeyText& KeyText::add(std::string_view key, std::string_view value) {
    if (!text_.empty()) text_ += ';';
    text_ += fmt::format("{}={}", key, is_plain(value) ? std::string(value) : fmt::format("{:016x}", hash_of(value)));
    return *this;
}

std::string value_of(std::string_view text, std::string_view key) {
    return std::string(find(keys_of(text), key).value_or(""));
}

bool same_keys(const std::string& found, const std::string& expected, std::string_view own,
               std::span<const std::string> accepted) {
    if (found == expected) return true;
    const auto good = [&](const std::string& text) {
        const std::string sources = value_of(text, "sources");
        return sources == own || std::ranges::find(accepted, sources) != accepted.end();
    };
    if (!good(found) || !good(expected)) return false;
    Keys a = keys_of(found), b = keys_of(expected);
    for (Keys* keys : {&a, &b}) std::erase_if(*keys, [](const auto& k) { return k.first == "sources"; });
    return a == b;
}

std::string differences(const std::string& found, const std::string& expected) {
    const Keys a = keys_of(found), b = keys_of(expected);
    if (a.empty()) return "it has no fingerprint of this program";
    std::vector<std::string> phrases;
    const auto compare = [&](std::string_view key, std::optional<std::string_view> is,
                             std::optional<std::string_view> expects) {
        if (is == expects) return;
        const bool plain = key == "sources" || (!is_hash(is.value_or("")) && !is_hash(expects.value_or("")));
        phrases.push_back(
            plain ? fmt::format("{} is {}, not {}", key, is.value_or("as usual"), expects.value_or("as usual"))
                  : fmt::format("{} differs", key));
    };
    for (const auto& [key, value] : b) compare(key, find(a, key), value);
    for (const auto& [key, value] : a)
        if (!find(b, key)) compare(key, value, std::nullopt);
    constexpr std::size_t kNamed = 8;
    const std::size_t named = std::min(phrases.size(), kNamed);
    std::string text = phrases.empty() ? "it is not in order" : "";
    for (std::size_t i = 0; i < named; ++i) text += (i > 0 ? "; " : "") + phrases[i];
    if (phrases.size() > named) text += fmt::format("; and {} more", phrases.size() - named);
    return text;
}

}  // namespace halflight
