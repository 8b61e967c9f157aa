#include "engine/io/gltf/schema.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "engine/core/error.h"
#include "engine/io/gltf/rules.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

// Limit of numbers that become an int. Real files need no larger ones in these places.
constexpr std::uint64_t kMaxNatural = std::numeric_limits<std::int32_t>::max();
constexpr std::uint64_t kMaxSize = std::uint64_t{1} << 53;  // the largest range of integers that JSON readers agree on

class Checker {
  public:
    using ListSizes = std::map<std::string, std::size_t, std::less<>>;
    Checker(ListSizes list_sizes, const std::string& file) : file_(file), list_sizes_(std::move(list_sizes)) {}
    Checker(Json& root, const std::string& file) : file_(file) {
        for (auto& [key, value] : root.items()) {
            if (value.is_array()) list_sizes_[key] = value.size();
        }
        for (const auto& [list, place] : {std::pair("lights", "/extensions/KHR_lights_punctual/lights"),
                                          std::pair("variants", "/extensions/KHR_materials_variants/variants")}) {
            const Json::json_pointer pointer(place);
            if (root.contains(pointer) && root[pointer].is_array()) list_sizes_[list] = root[pointer].size();
        }
    }

    /// Checks an object. `path` is the position of `value`, for messages; it is unchanged on return.
    void object(Json& value, std::string_view type, std::string& path) const {
        if (!value.is_object()) fail(path, "is not an object");
        for (const GltfRule& rule : gltf_rules().find(type)->second) {
            const auto it = value.find(rule.key);
            if (it == value.end()) {
                if (rule.required) fail(path, "has no '{}'", rule.key);
                continue;
            }
            const Descent down(path, "{}{}", path.empty() ? "" : ".", rule.key);
            property(*it, rule, path);
        }
    }

  private:
    /// A path that is extended during the object's lifetime.
    class Descent {
      public:
        template <class... Args>
        Descent(std::string& path, fmt::format_string<Args...> step, Args&&... args)
            : path_(path), length_(path.size()) {
            fmt::format_to(std::back_inserter(path), step, std::forward<Args>(args)...);
        }
        Descent(const Descent&) = delete;
        Descent& operator=(const Descent&) = delete;
        ~Descent() { path_.resize(length_); }

      private:
        std::string& path_;
        std::size_t length_;
    };

    template <class... Args>
    [[noreturn]] void fail(const std::string& path, fmt::format_string<Args...> format, Args&&... args) const {
        const std::string subject = path.empty() ? file_ : file_ + ": " + path;
        throw Error(subject, "{}", fmt::format(format, std::forward<Args>(args)...));
    }

    void property(Json& value, const GltfRule& rule, std::string& path) const {
        switch (rule.kind) {
            case GltfKind::flag:
                if (!value.is_boolean()) fail(path, "is not true or false");
                break;
            case GltfKind::number:
                number(value, path);
                break;
            case GltfKind::natural:
                natural(value, rule.of == "size" ? kMaxSize : kMaxNatural, path);
                break;
            case GltfKind::text:
                text(value, path);
                break;
            case GltfKind::texts:
                each(value, path, [&](Json& v) { text(v, path); });
                break;
            case GltfKind::numbers:
                each(value, path, [&](Json& v) { number(v, path); });
                if (rule.length != 0 && value.size() != rule.length)
                    fail(path, "has {} numbers, not {}", value.size(), rule.length);
                break;
            case GltfKind::index:
                index(value, rule.of, path);
                break;
            case GltfKind::indices:
                each(value, path, [&](Json& v) { index(v, rule.of, path); });
                break;
            case GltfKind::index_map:
                index_map(value, rule.of, path);
                break;
            case GltfKind::index_maps:
                each(value, path, [&](Json& v) { index_map(v, rule.of, path); });
                break;
            case GltfKind::naturals:
                each_value(value, path, [&](Json& v) { natural(v, kMaxNatural, path); });
                break;
            case GltfKind::object:
                object(value, rule.of, path);
                break;
            case GltfKind::objects:
                each(value, path, [&](Json& v) { object(v, rule.of, path); });
                break;
        }
    }

    template <class F>
    void each(Json& value, std::string& path, F f) const {
        if (!value.is_array()) fail(path, "is not an array");
        for (std::size_t i = 0; i < value.size(); ++i) {
            const Descent down(path, "[{}]", i);
            f(value[i]);
        }
    }

    void number(Json& value, const std::string& path) const {
        if (!value.is_number()) fail(path, "is not a number");
        value = value.get<double>();
    }

    void natural(Json& value, std::uint64_t limit, const std::string& path) const {
        if (value.is_number_float()) {
            const double x = value.get<double>();
            if (x >= 0 && x <= double(kMaxSize) && x == std::floor(x)) value = static_cast<std::uint64_t>(x);
        }
        if (!value.is_number_unsigned()) fail(path, "is not a non-negative whole number");
        if (value.get<std::uint64_t>() > limit) fail(path, "{} is too large", value.get<std::uint64_t>());
    }

    void text(const Json& value, const std::string& path) const {
        if (!value.is_string()) fail(path, "is not a string");
    }

    void index(Json& value, const std::string& list, const std::string& path) const {
        natural(value, kMaxNatural, path);
        const auto found = list_sizes_.find(list);
        const std::size_t size = found == list_sizes_.end() ? 0 : found->second;
        if (value.get<std::uint64_t>() >= size)
            fail(path, "{} is not an index into {}, which has {}", value.get<std::uint64_t>(), list, size);
    }

    void index_map(Json& value, const std::string& list, std::string& path) const {
        each_value(value, path, [&](Json& v) { index(v, list, path); });
    }

    template <class F>
    void each_value(Json& object, std::string& path, F f) const {
        if (!object.is_object()) fail(path, "is not an object");
        for (auto& [key, v] : object.items()) {
            const Descent down(path, ".{}", key);
            f(v);
        }
    }

    const std::string& file_;
    ListSizes list_sizes_;
};

// Limit of nesting, far above the needs of glTF, for functions that recurse over the tree.
constexpr int kMaxDepth = 256;

/// Returns the depth of nesting, before parsing. (nlohmann's parser has a callback for this, but then it visits all
/// elements of a list again for each of them.)
int depth_of(std::string_view text) {
    int depth = 0, deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string && c == '\\') {
            ++i;
        } else if (c == '"') {
            in_string = !in_string;
        } else if (!in_string && (c == '{' || c == '[')) {
            deepest = std::max(deepest, ++depth);
        } else if (!in_string && (c == '}' || c == ']')) {
            --depth;
        }
    }
    return deepest;
}

/// Removes the extras of all objects, which scenes do not need.
void remove_extras(Json& value) {
    if (value.is_object()) value.erase("extras");
    if (value.is_structured())
        for (Json& child : value) remove_extras(child);
}

}  // namespace

Json parse_gltf_json(std::string_view text, const std::string& file) {
    if (depth_of(text) > kMaxDepth) throw Error(file, "JSON is nested deeper than {} levels", kMaxDepth);
    try {
        return Json::parse(text);
    } catch (const Json::exception& e) {
        const std::string_view message = e.what();  // "[json.exception...] parse error at line 1, ..."
        throw Error(file, message.substr(message.find("] ") + 2));
    }
}

void check_gltf(Json& root, const std::string& file) {
    remove_extras(root);
    std::string path;
    Checker(root, file).object(root, "root", path);
}

void check_gltf_animations(Json& animations, std::size_t accessors, std::size_t nodes, const std::string& file) {
    Json root = {{"animations", std::move(animations)}};
    std::string path;
    Checker({{"accessors", accessors}, {"nodes", nodes}}, file).object(root, "animations", path);
    animations = std::move(root["animations"]);
}

}  // namespace halflight
