#include "engine/io/gltf/named_files.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "engine/core/error.h"
#include "engine/io/files.h"
#include "engine/io/gltf/parts.h"
#include "engine/io/gltf/uri.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Collects the values of all members "uri" that are no data, up to the first error.
class UriReader : public nlohmann::json_sax<Json> {
  public:
    std::vector<std::string> uris;

    bool key(string_t& name) override { return is_uri_ = name == "uri", true; }
    bool string(string_t& text) override {
        if (is_uri_ && uri_scheme(text).empty()) uris.push_back(std::move(text));
        return is_uri_ = false, true;
    }
    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_object(std::size_t) override { return true; }
    bool end_object() override { return true; }
    bool start_array(std::size_t) override { return true; }
    bool end_array() override { return true; }
    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

  private:
    bool is_uri_ = false;  // the value of a member "uri" follows
};

/// Returns the JSON of a file: all of it, or the first chunk of a .glb (glTF 2.0, section 4.4). Texts that are too
/// large for a quick look are empty.
std::string json_of(const fs::path& path) {
    constexpr std::uint64_t kMost = std::uint64_t{256} << 20, kHeader = 20;
    const ByteSource file(path);
    std::string buffer;
    std::uint64_t from = 0, count = file.size();
    if (const std::string_view start = file.read(0, std::min(count, kHeader), buffer); start.starts_with("glTF")) {
        if (start.size() < kHeader) return "";
        std::uint32_t length = 0;
        std::memcpy(&length, start.data() + 12, sizeof length);
        from = kHeader, count = std::min<std::uint64_t>(length, count - kHeader);
    }
    return count > kMost ? "" : std::string(file.read(from, count, buffer));
}

void add(const fs::path& scene, std::set<fs::path>& files) {
    if (!files.insert(scene).second) return;
    UriReader reader;
    try {
        Json::sax_parse(json_of(scene), &reader);
    } catch (const Error&) {  // loading reports it
    }
    const bool list = is_part_list(scene);
    for (const std::string& uri : reader.uris) {
        // The loader takes the first of these names that exists.
        for (const std::string& name : {percent_decode(uri), uri, percent_decode(without_query(uri))}) {
            if (name.empty() || name.find('\0') != std::string::npos) continue;
            const fs::path file = scene.parent_path() / name;
            if (list && !is_part_list(file))
                add(file, files);
            else
                files.insert(file);
        }
    }
}

}  // namespace

std::vector<fs::path> files_named_by(const fs::path& scene) {
    std::set<fs::path> files;
    add(scene, files);
    return {files.begin(), files.end()};
}

}  // namespace halflight
