// A glTF file that has been read and checked, before it is made a scene.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/io/gltf/gltf.h"

namespace halflight {

/// Where an encoded image lies.
struct GltfImageSource {
    std::string label;  // for messages: its URI, or its name
    std::string uri;    // empty: in `buffer_view`
    int buffer_view = kNone;
};

/// Collects what deserves a warning: the same thing in many places becomes one line.
class GltfWarnings {
  public:
    /// `what` is the line, `element` one of the places that it is about; may be empty.
    void add(const std::string& what, const std::string& element = "");
    /// What was collected elsewhere, later.
    void add(const GltfWarnings& more);
    void write_to(SceneReport& report) const;

  private:
    struct Places {
        std::string first;
        std::size_t count = 0;
    };
    std::vector<std::string> order_;
    std::map<std::string, Places> places_;
};

/// The model as tinygltf gives it, with buffers in memory, each as long as its byteLength says. All indices are in
/// range or kNone (gltf_schema.h). Images are left encoded, so that those which nothing refers to need not be readable.
struct GltfDocument {
    std::string file;  // subject of messages
    std::filesystem::path folder;
    GltfOptions options;
    std::uint64_t bytes_read = 0;  // of max_total_bytes
    tinygltf::Model model;
    std::vector<GltfImageSource> images;
    std::optional<FrameRate> frame_rate;                 // that extras tell
    nlohmann::json materials = nlohmann::json::array();  // checked; animations change it, and not `model`
    nlohmann::json animations;                 // the list as it stands in the file, unchecked; null where there is none
    std::vector<std::filesystem::path> files;  // that have been read so far, the scene's own first
    GltfWarnings warnings;

    template <class... Args>
    [[noreturn]] void fail(std::string_view element, fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(fmt::format("{}: {}", file, element), "{}", fmt::format(format, std::forward<Args>(args)...));
    }
    /// The bytes of a buffer view. Throws Error where its buffer does not have them.
    std::string_view view_bytes(int buffer_view) const;
    /// The bytes that a URI stands for; `element` is whose URI it is.
    std::string read_uri(const std::string& uri, const std::string& element);
};

/// Reads file and buffers. Throws Error: unreadable, too large, outside the folder, a Git LFS pointer, not glTF 2.0,
/// not of the schema, an extension required that is not known.
GltfDocument open_gltf(const std::filesystem::path& path, const GltfOptions& options);

}  // namespace halflight
