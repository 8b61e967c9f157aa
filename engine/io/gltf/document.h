// A glTF file that has been read and checked, before conversion to a scene.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/gltf/meshopt.h"
#include "engine/io/gltf/tinygltf.h"

namespace halflight {

/// The location of an encoded image.
struct GltfImageSource {
    std::string label;  // URI or name of the image, for messages
    std::string uri;    // URI of the image; empty: the image is in `buffer_view`
    int buffer_view = kNone;
    bool optional = false;  // whether a texture does without the image, which an optional extension names
    int fallback = kNone;   // the texture's image where this one cannot be read
};

/// Collection of warnings. Equal warnings about several elements become one line.
class GltfWarnings {
  public:
    /// Adds the warning `what` about `element`, which may be empty.
    void add(const std::string& what, const std::string& element = "");
    /// Appends the warnings of another collection.
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

/// Decompressed buffer views, by index.
struct GltfDecodedViews {
    struct View {
        ByteSource bytes;
        MemoryLedger::Entry memory;
    };
    std::mutex mutex;  // held by view_bytes()
    std::map<int, View> views;
};

/// A parsed file. All indices are in range or kNone (schema.h). Buffers and images stay where they
/// are until they are read, so that a scene needs only the bytes that it uses.
struct GltfDocument {
    std::string file;  // file name, subject of messages
    std::filesystem::path folder;
    GltfOptions options;
    std::uint64_t bytes_of_files = 0;  // bytes of the scene's file, buffers and images opened so far
    tinygltf::Model model;             // without buffers, images, materials and animations
    std::vector<ByteSource> buffers;   // each as long as its byteLength; empty: no data, or an unused fallback
    std::map<int, GltfMeshoptView> compressed_views;                                   // by index of the buffer view
    std::unique_ptr<GltfDecodedViews> decoded = std::make_unique<GltfDecodedViews>();  // cache of view_bytes()
    std::vector<GltfImageSource> images;
    std::vector<std::string> variants;                   // names of the material variants
    std::vector<float> stroke_radii;                     // radius of points and lines, by mesh; empty: left out
    std::optional<FrameRate> frame_rate;                 // frame rate in the scene's extras
    std::vector<Lens> lenses;                            // lens of each camera, from its extras
    nlohmann::json materials = nlohmann::json::array();  // materials of the file, checked
    nlohmann::json animations;                           // animations of the file, unchecked; null: none
    std::vector<VersionedFile> files;                    // files opened so far, the scene's own first
    GltfWarnings warnings;

    template <class... Args>
    [[noreturn]] void fail(std::string_view element, fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(fmt::format("{}: {}", file, element), "{}", fmt::format(format, std::forward<Args>(args)...));
    }
    /// Returns the number of bytes of a buffer view after decompression. Throws Error where its buffer is too short.
    std::uint64_t view_size(int buffer_view) const;
    /// Returns the bytes of a buffer view, decompressed. Throws Error where its buffer is too short, and where its
    /// compressed data are damaged or do not fit into the memory budget. Thread-safe.
    ByteSource view_bytes(int buffer_view) const;
    /// Returns the bytes behind a URI. Throws Error about `element`, which the URI belongs to.
    ByteSource open_uri(const std::string& uri, const std::string& element);
};

/// Reads the JSON and opens the buffers. Throws Error for files that are unreadable, outside the folder or a Git LFS
/// pointer, and for JSON that is too large. Also throws it for content that is not glTF 2.0, breaks the schema or
/// requires an unknown extension.
GltfDocument open_gltf(const std::filesystem::path& path, const GltfOptions& options);

}  // namespace halflight
