#include "engine/gpu/declarations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "engine/gpu/program_slots.h"
#include "engine/gpu/shader_source.h"

namespace halflight::gpu {
namespace {

constexpr std::array<std::string_view, 8> kQualifiers = {"readonly", "writeonly", "coherent", "volatile",
                                                         "restrict", "highp",     "mediump",  "lowp"};

/// The words and punctuation characters of a text, without comments and directives.
class Tokens {
  public:
    explicit Tokens(std::string_view text) : text_(text) {}

    /// Returns the next token; empty at the end.
    std::string_view next() {
        skip();
        std::size_t end = 0;
        while (end < text_.size() && in_identifier(text_[end])) ++end;
        return take(std::max<std::size_t>(end, 1));
    }
    /// Skips up to the bracket that closes the last token, if that opens one.
    void close(std::string_view token) {
        const auto is = [](std::string_view t, std::string_view brackets) {
            return t.size() == 1 && brackets.find(t) != std::string_view::npos ? 1 : 0;
        };
        for (int depth = is(token, "([{"); depth > 0 && !token.empty();) {
            token = next();
            depth += is(token, "([{") - is(token, ")]}");
        }
    }

  private:
    std::string_view take(std::size_t count) {
        const std::string_view taken = text_.substr(0, count);
        text_.remove_prefix(taken.size());
        return taken;
    }
    /// Returns the length of the line, with the lines that continue it.
    std::size_t line() const {
        std::size_t end = text_.find('\n');
        while (end < text_.size() && text_[end - 1] == '\\') end = text_.find('\n', end + 1);
        return end;
    }
    void skip() {
        constexpr std::string_view kSpace(" \t\r\n\f\v\0", 7);
        while (!text_.empty()) {
            if (text_.starts_with("/*"))
                take(std::min(text_.find("*/", 2), text_.size() - 2) + 2);
            else if (text_.starts_with("//") || text_[0] == '#')
                take(line());
            else if (kSpace.find(text_[0]) != std::string_view::npos)
                take(1);
            else
                return;
        }
    }

    std::string_view text_;  // text that has not been read yet
};

/// Returns the kind of a uniform of that type.
std::string_view kind_of(std::string_view type) {
    if (type.starts_with('i') || type.starts_with('u'))
        if (const std::string_view rest = type.substr(1); rest.starts_with("sampler") || rest.starts_with("image"))
            type = rest;
    if (type.starts_with("sampler")) return name(SlotKind::sampler);
    return type.starts_with("image") ? name(SlotKind::image) : "uniform";
}

}  // namespace

Declarations declarations(std::string_view text) {
    Declarations found;
    const auto add = [&](std::string_view kind, std::string_view name) {
        found.emplace(name);
        found.insert(fmt::format("{} {}", kind, name));
    };
    Tokens tokens(text);
    for (std::string_view token = tokens.next(); !token.empty(); token = tokens.next()) {
        if (token != "uniform" && token != "buffer") continue;
        const SlotKind block = token == "buffer" ? SlotKind::storage_block : SlotKind::uniform_block;
        std::string_view type = tokens.next();
        while (std::ranges::find(kQualifiers, type) != kQualifiers.end() || type == "layout") {
            if (type == "layout") tokens.close(tokens.next());
            type = tokens.next();
        }
        if (type == ";") continue;  // a default layout
        token = tokens.next();
        if (token == "{") {
            add(name(block), type);
            continue;
        }
        for (bool names = true; !token.empty() && token != ";"; token = tokens.next()) {
            tokens.close(token);  // the size of an array, or an initializer
            if (names && in_identifier(token[0])) {
                add(kind_of(type), token);
                names = false;
            }
            names = names || token == ",";
        }
    }
    return found;
}

}  // namespace halflight::gpu
