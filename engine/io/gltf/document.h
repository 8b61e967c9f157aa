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
#include "engine/io/gltf/extras.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/gltf/meshopt.h"
#include "engine/io/gltf/tinygltf.h"
#include "engine/io/gltf/uses.h"

namespace halflight {

/// The location of an encoded image.
struct GltfImageSource {
    std::string label;  // URI or name of the image, for messages
    std::string uri;    // URI of the image; empty: the image is in `buffer_view`
    int buffer_view = kNone;
    bool optional = true;  // whether textures may lack the image, because an optional extension names it
    int fallback = kNone;  // the texture's image if this one cannot be read
    bool is_missing() const { return uri.empty() && buffer_view == kNone; }
};

/// Collection of warnings. Warnings of one kind become one line: they differ in their element, and in numbers only.
class GltfWarnings {
  public:
    /// Adds the warning `what` about `element`, which may be empty.
    void add(const std::string& what, const std::string& element = "");
    /// Adds a warning about what glTF forbids, and other loaders accept.
    void fault(const std::string& what, const std::string& element);
    /// Appends the warnings of another collection.
    void add(const GltfWarnings& more);
    void write_to(SceneReport& report) const;
    /// Throws Error about `file` for the first fault.
    void refuse_faults(const std::string& file) const;

  private:
    struct Warning {
        std::string what, element;  // text and element of the first warning of its kind
        bool fault = false;
        std::size_t count = 0;
    };
    void add(const Warning& warning);

    std::vector<Warning> warnings_;
    std::map<std::string, std::size_t> places_;  // index into `warnings_`, by kind
};

/// An element of the list of EXT_lights_ies. Elements with the same URI or buffer view share a profile.
struct GltfProfileElement {
    std::string name{};   // name for users
    int profile = kNone;  // index into GltfDocument::light_profiles; kNone: no node uses it
};

/// Decompressed buffer views, by index, and what reading has found.
struct GltfDecodedViews {
    struct View {
        ByteSource bytes;
        MemoryLedger::Entry memory;
    };
    std::mutex mutex;  // held while a member is used
    std::map<int, View> views;
    std::set<int> disordered;  // accessors whose sparse indices do not ascend
};

/// A parsed file. All indices are in range or kNone (schema.h). Buffers and images stay where they
/// are until they are read, so that a scene needs only the bytes that it uses.
struct GltfDocument {
    std::string file;  // file name, subject of messages
    std::filesystem::path folder;
    GltfOptions options;
    std::uint64_t bytes_of_files = 0;  // bytes of the scene's file, buffers and images opened so far
    tinygltf::Model model;             // without buffers, images, materials and animations
    GltfUses uses;                     // objects of the file that the scene uses
    std::vector<ByteSource> buffers;   // each as long as its byteLength; empty: no data, or an unused fallback
    std::map<int, GltfMeshoptView> compressed_views;                                   // by index of the buffer view
    std::unique_ptr<GltfDecodedViews> decoded = std::make_unique<GltfDecodedViews>();  // cache of view_bytes()
    std::vector<GltfImageSource> images;
    std::vector<std::string> variants;                   // names of the material variants
    std::vector<float> stroke_radii;                     // radius of points and lines, by mesh; empty: left out
    std::optional<FrameRate> frame_rate;                 // frame rate in the scene's extras
    std::vector<double> visible;                         // KHR_node_visibility of each node; 0: hidden
    std::set<int> switched;                              // nodes whose visibility some animation drives
    bool restarts = false;                               // the largest index restarts a strip, fan, or line
    std::vector<LightProfile> light_profiles;            // distinct profiles of EXT_lights_ies that are used
    std::vector<GltfProfileElement> profiles;            // elements of the list of EXT_lights_ies
    MemoryLedger::Entry profile_memory;                  // bytes of the profiles, here and in the scene
    Environment environment;                             // environment of the file; black: none
    MemoryLedger::Entry environment_memory;              // bytes of its map, here and in the scene
    std::vector<LightSize> light_sizes;                  // size of each light, from its extras
    std::vector<Lens> lenses;                            // lens of each camera, from its extras
    nlohmann::json materials = nlohmann::json::array();  // materials of the file, checked
    nlohmann::json animations;                           // animations of the file, unchecked; null: none
    std::vector<VersionedFile> files;                    // files opened so far, the scene's own first
    GltfWarnings warnings;
    bool posed = false;  // animations have set values, which are no faults of the file

    /// Adds a warning about a value that glTF forbids. It is no fault if an animation may have set the value.
    void value_fault(const std::string& what, const std::string& element) {
        posed ? warnings.add(what, element) : warnings.fault(what, element);
    }
    template <class... Args>
    [[noreturn]] void fail(std::string_view element, fmt::format_string<Args...> format, Args&&... args) const {
        throw Error(fmt::format("{}: {}", file, element), "{}", fmt::format(format, std::forward<Args>(args)...));
    }
    /// Throws the error about an object of a list if the scene uses it; otherwise adds it to the warnings.
    void tolerate_unused(std::string_view list, std::size_t index, const Error& error);
    /// Returns the number of bytes of a buffer view after decompression. Throws Error if its buffer is too short.
    std::uint64_t view_size(int buffer_view) const;
    /// Returns the bytes of a buffer view, decompressed. Throws Error if its buffer is too short, and if its
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
