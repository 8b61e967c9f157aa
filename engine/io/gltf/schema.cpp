#include "engine/io/gltf/schema.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/document.h"
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
    Checker(ListSizes list_sizes, const std::string& file, GltfWarnings& warnings)
        : file_(file), warnings_(warnings), list_sizes_(std::move(list_sizes)) {}
    Checker(Json& root, const std::string& file, GltfWarnings& warnings) : file_(file), warnings_(warnings) {
        for (auto& [key, value] : root.items()) {
            if (value.is_array()) list_sizes_[key] = value.size();
        }
        for (const auto& [list, place] : {std::pair("lights", "/extensions/KHR_lights_punctual/lights"),
                                          std::pair(kLightProfileList, "/extensions/EXT_lights_ies/lights"),
                                          std::pair(kAreaLightList, "/extensions/EXT_lights_area/lights"),
                                          std::pair(kImageLightList, "/extensions/EXT_lights_image_based/lights"),
                                          std::pair("variants", "/extensions/KHR_materials_variants/variants")}) {
            const Json::json_pointer pointer(place);
            if (root.contains(pointer) && root[pointer].is_array()) list_sizes_[list] = root[pointer].size();
        }
    }

    /// Checks an object. `path` is the position of `value`, for messages; it is unchanged on return.
    void object(Json& value, std::string_view type, std::string& path) {
        if (!value.is_object()) fail(path, "is not an object");
        const std::vector<GltfRule>& rules = gltf_rules().find(type)->second;
        for (auto it = value.begin(); it != value.end();)
            it = std::ranges::find(rules, it.key(), &GltfRule::key) == rules.end() ? value.erase(it) : std::next(it);
        for (const GltfRule& rule : rules) {
            const auto it = value.find(rule.key);
            if (it == value.end()) {
                if (rule.required) throw Unusable(error(path, "has no '{}'", rule.key));
                continue;
            }
            const Descent down(path, "{}{}", path.empty() ? "" : ".", rule.key);
            if (it->is_null() && !rule.required) {
                warnings_.fault("is null, it is ignored", path);
                if (const auto stub = gltf_stubs().find(rule.of);
                    rule.kind == GltfKind::object && stub != gltf_stubs().end())
                    *it = Json::parse(stub->second);
                else
                    value.erase(it);
            } else if (rule.dropped && rule.kind == GltfKind::object) {
                if (is_damaged([&] { property(*it, rule, path); })) value.erase(it);
            } else {
                property(*it, rule, path);
            }
        }
    }

    std::vector<GltfFault> take_faults() { return std::move(faults_); }

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

    /// The error about a wrong index or a missing member, which loaders notice only in objects that they use. Values of
    /// wrong types are another matter: most loaders refuse them everywhere.
    struct Unusable : Error {
        explicit Unusable(const Error& error) : Error(error) {}
    };

    template <class... Args>
    Error error(const std::string& path, fmt::format_string<Args...> format, Args&&... args) const {
        const std::string subject = path.empty() ? file_ : file_ + ": " + path;
        return {subject, "{}", fmt::format(format, std::forward<Args>(args)...)};
    }
    template <class... Args>
    [[noreturn]] void fail(const std::string& path, fmt::format_string<Args...> format, Args&&... args) const {
        throw error(path, format, std::forward<Args>(args)...);
    }

    /// Returns whether f() throws an Error, and turns it into a warning.
    template <class F>
    bool is_damaged(F f) {
        try {
            f();
        } catch (const Error& damage) {
            warnings_.fault(fmt::format("{}; it is left out", damage.reason()), element_of(damage, file_));
            return true;
        }
        return false;
    }

    void property(Json& value, const GltfRule& rule, std::string& path) {
        switch (rule.kind) {
            case GltfKind::anything:
                break;
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
            case GltfKind::index_lists:
                each(value, path, [&](Json& list) { each(list, path, [&](Json& v) { index(v, rule.of, path); }); });
                break;
            case GltfKind::naturals:
                each_value(value, path, [&](Json& v) { natural(v, kMaxNatural, path); });
                break;
            case GltfKind::object:
                object(value, rule.of, path);
                break;
            case GltfKind::objects:
                objects(value, rule, path);
                break;
        }
    }

    void objects(Json& list, const GltfRule& rule, std::string& path) {
        std::vector<std::size_t> damaged;
        std::size_t index = 0;
        const auto stub = gltf_stubs().find(rule.of);
        each(list, path, [&](Json& v) {
            const std::size_t place = index++;
            if (rule.dropped) {
                if (is_damaged([&] { object(v, rule.of, path); })) damaged.push_back(place);
            } else if (stub == gltf_stubs().end()) {
                object(v, rule.of, path);
            } else {
                try {
                    object(v, rule.of, path);
                } catch (const Unusable& fault) {
                    faults_.push_back({rule.key, place, fault});
                    v = Json::parse(stub->second);
                }
            }
        });
        while (!damaged.empty()) {
            list.erase(damaged.back());
            damaged.pop_back();
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
            throw Unusable(
                error(path, "{} is not an index into {}, which has {}", value.get<std::uint64_t>(), list, size));
    }

    void index_map(Json& value, const std::string& list, std::string& path) const {
        each_value(value, path, [&](Json& v) { index(v, list, path); });
    }

    template <class F>
    void each_value(Json& object, std::string& path, F f) const {
        if (!object.is_object()) fail(path, "is not an object");
        object.erase("extras");
        for (auto& [key, v] : object.items()) {
            const Descent down(path, ".{}", key);
            f(v);
        }
    }

    const std::string& file_;
    GltfWarnings& warnings_;
    ListSizes list_sizes_;
    std::vector<GltfFault> faults_;
};

// Limit of nesting, far above the needs of glTF, for functions that recurse over the tree.
constexpr std::size_t kMaxDepth = 256;

/// The memory that a text of JSON takes once it is parsed. The scan stops below kMaxDepth levels.
struct JsonSize {
    std::size_t structures = 0;  // objects and arrays
    std::size_t bytes = 0;
    bool too_deep = false;
};

/// Returns the size of JSON before it is parsed. (nlohmann's parser has a callback for the depth, but then it visits
/// all elements of a list again for each of them.) The peaks of `halflight info` were measured with files of 300,000
/// equal objects and of millions of equal values. They are, per object: empty nodes 990 bytes, nodes with a translation
/// 1160, nodes with a matrix 1550, meshes 1610, accessors with limits 1750, nodes with a name and three properties
/// 1890, buffer views 1010, textures 800. They are, per value: numbers in an array 47, empty strings in an array 95,
/// numbers in an object 127. The sum below is 0.8 to 1.5 times as large for all of these.
JsonSize measure_json(std::string_view text) {
    constexpr std::size_t kListed = 770;  // object in an array: most become an object of the model, too
    constexpr std::size_t kObject = 100;  // other object
    constexpr std::size_t kArray = 40;    // array without its elements
    constexpr std::size_t kElement = 24;  // place in an array, and in the copy that is made when the array doubles
    constexpr std::size_t kMember = 96;   // member of an object: key, value and links
    constexpr std::size_t kMoved = 24;    // value of the largest object, when the object is destroyed
    constexpr std::size_t kString = 48;   // string of at most kShort characters
    constexpr std::size_t kShort = 15;    // characters of a string without memory of their own
    constexpr std::size_t kCopies = 3;    // copies of the other characters of strings
    struct Level {
        bool is_array = false;
        std::size_t commas = 0;
    };
    std::array<Level, kMaxDepth + 1> levels;
    JsonSize size;
    size.bytes = text.size();
    std::size_t depth = 0, largest_object = 0;
    const auto close = [&] {
        const Level& level = levels[depth];
        const std::size_t values = level.commas + 1;  // an empty array or object counts as one value
        if (level.is_array)
            size.bytes += kElement * std::bit_ceil(values);
        else
            largest_object = std::max(largest_object, values);
        if (depth > 0) --depth;
    };
    bool in_string = false;
    std::size_t start = 0;  // start of the last string
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c != '"') continue;
            in_string = false;
            size.bytes += kCopies * (std::max(i - start, kShort + 1) - kShort - 1);
        } else if (c == '"') {
            in_string = true;
            start = i;
            size.bytes += kString;
        } else if (c == '{' || c == '[') {
            ++size.structures;
            size.bytes += c == '[' ? kArray : levels[depth].is_array ? kListed : kObject;
            if (depth == kMaxDepth) {
                size.too_deep = true;
                return size;
            }
            levels[++depth] = {c == '[', 0};
        } else if (c == '}' || c == ']') {
            close();
        } else if (c == ',') {
            ++levels[depth].commas;
        } else if (c == ':') {
            size.bytes += kMember - kString;  // its key counts as a string
        }
    }
    if (in_string) size.bytes += kCopies * (text.size() - start);
    while (depth > 0) close();  // a truncated file is parsed up to its end
    size.bytes += kMoved * largest_object;
    return size;
}

}  // namespace

Json parse_gltf_json(std::string_view text, const std::string& file) {
    const JsonSize size = measure_json(text);
    if (size.too_deep) throw Error(file, "JSON is nested deeper than {} levels", kMaxDepth);
    MemoryLedger::process().check(size.bytes, file, fmt::format("{} objects and arrays of JSON", size.structures));
    try {
        return Json::parse(text);
    } catch (const Json::exception& e) {
        const std::string_view message = e.what();  // "[json.exception...] parse error at line 1, ..."
        throw Error(file, message.substr(message.find("] ") + 2));
    }
}

std::string element_of(const Error& error, const std::string& file) {
    std::string_view element = error.what();
    element.remove_suffix(std::min(element.size(), error.reason().size() + 2));
    if (element.starts_with(file + ": ")) element.remove_prefix(file.size() + 2);
    return std::string(element);
}

std::vector<GltfFault> check_gltf(Json& root, const std::string& file, GltfWarnings& warnings) {
    std::string path;
    Checker checker(root, file, warnings);
    checker.object(root, "root", path);
    return checker.take_faults();
}

void check_gltf_animation(Json& animation, std::size_t index, std::size_t accessors, std::size_t nodes,
                          const std::string& file, GltfWarnings& warnings) {
    std::string path = fmt::format("animations[{}]", index);
    Checker({{"accessors", accessors}, {"nodes", nodes}}, file, warnings).object(animation, "animation", path);
}

}  // namespace halflight
