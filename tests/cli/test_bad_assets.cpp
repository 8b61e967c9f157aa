// Tests bad files of other projects in ../shared/assets/bad: invalid scenes from the tests of Khronos' glTF validator,
// and files that once crashed OpenEXR.
#include <set>

#include "tests/cli/bad_input.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kBad = fs::path(HALFLIGHT_SHARED_DIR) / "assets/bad";

/// Validation errors with which a scene still loads, in groups with the reason why that is right for rendering.
const Strings kTolerated = words(
    // Bounds are taken from the data.
    "ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND ACCESSOR_MAX_MISMATCH ACCESSOR_MIN_MISMATCH",
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS",
    // Triangles that are not finite are left out and counted. Tangents that cannot be used are made anew. Normals and
    // tangents are brought to unit length. Colours are clamped.
    "ACCESSOR_INVALID_FLOAT ACCESSOR_INVALID_SIGN ACCESSOR_VECTOR3_NON_UNIT ACCESSOR_NON_CLAMPED",
    // Data is read byte by byte.
    "ACCESSOR_MATRIX_ALIGNMENT ACCESSOR_OFFSET_ALIGNMENT ACCESSOR_TOTAL_OFFSET_ALIGNMENT GLB_CHUNK_LENGTH_UNALIGNED",
    // The vertex of that number is there. Normalization of floats says nothing. 32-bit integers convert like others.
    "ACCESSOR_INDEX_PRIMITIVE_RESTART ACCESSOR_NORMALIZED_INVALID MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT",
    // The bytes are those of the buffer, whatever they call themselves. What follows the comma of a URI can be read.
    "BUFFER_DATA_URI_MIME_TYPE_INVALID INVALID_URI",
    // Nothing that is shown reads the buffer, the view, or an extension that is not known.
    "BUFFER_MISSING_GLB_DATA BUFFER_VIEW_TOO_LONG TYPE_MISMATCH UNSATISFIED_DEPENDENCY",
    // Named twice is named; an empty list is as good as none; an extension that is there is used.
    "DUPLICATE_ELEMENTS EMPTY_ENTITY UNDECLARED_EXTENSION",
    // Chunks after the first two are skipped, as those of unknown type are. The chunk says itself what it is. A byte
    // order mark is skipped.
    "GLB_DUPLICATE_CHUNK GLB_UNEXPECTED_BIN_CHUNK INVALID_JSON",
    // Each primitive is morphed by the targets and weights that it has; targets of weight 0 are not read.
    "MESH_INVALID_WEIGHTS_COUNT MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR",
    "MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT",
    // Attributes of unknown names are not read; sets are found by their numbers and used in pairs; a missing set is
    // zero.
    "MESH_PRIMITIVE_INVALID_ATTRIBUTE MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY",
    "MESH_PRIMITIVE_JOINTS_WEIGHTS_MISMATCH MESH_PRIMITIVE_TOO_FEW_TEXCOORDS");

/// Files that load because no node instances their invalid part. Once instanced, the part is refused.
const Strings kNotRead = words(
    "ACCESSOR_INDEX_OOB ACCESSOR_JOINTS_INDEX_DUPLICATE ACCESSOR_JOINTS_INDEX_OOB ACCESSOR_SMALL_BYTESTRIDE",
    "ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE ACCESSOR_TOO_LONG ACCESSOR_WEIGHTS_NEGATIVE ACCESSOR_WEIGHTS_NON_NORMALIZED",
    "BUFFER_VIEW_INVALID_BYTE_STRIDE BUFFER_VIEW_TARGET_OVERRIDE MESH_PRIMITIVE_ACCESSOR_UNALIGNED",
    "MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT",
    "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE",
    "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT");

/// Valid files that are refused: glTF 2.0 does not have the type; nothing is downloaded; what the last two show is in a
/// buffer without data.
const Strings kRefusedThoughValid =
    words("accessor/unknown_type.gltf buffer/non_relative_uri.gltf root/named_objects.gltf root/unused_objects.gltf");

bool listed(const Strings& list, const std::string& name) {
    return std::ranges::find(list, name) != list.end();
}

class BadAssets : public CommandTest {
  protected:
    void SetUp() override {
        if (!fs::exists(kBad)) GTEST_SKIP() << "no assets in " << kBad;
    }
};

/// A file of the validator's own tests, and the errors in its report.
struct Validated {
    std::string name;  // path, for example "mesh/valid.gltf"
    std::set<std::string> errors;
};

std::vector<Validated> validated() {
    std::vector<Validated> files;
    const std::string suffix = ".report.json";
    for (const auto& entry : fs::recursive_directory_iterator(kBad / "gltf-validator")) {
        std::string name = entry.path().lexically_relative(kBad / "gltf-validator");
        if (!name.ends_with(suffix)) continue;
        name.resize(name.size() - suffix.size());
        Validated& file = files.emplace_back(Validated{name, {}});
        const Json report = Json::parse(read_text(entry.path()));
        for (const Json& message : report["issues"]["messages"])
            if (message["severity"] == 0) file.errors.insert(message["code"]);
    }
    std::ranges::sort(files, {}, &Validated::name);
    return files;
}

TEST_F(BadAssets, AgreeWithTheValidatorExceptForListedCases) {
    std::set<std::string> surprises;
    for (const auto& [name, errors] : validated()) {
        const Verdict verdict = judge("validator: " + name, with_scene(kBad / "gltf-validator" / name));
        ASSERT_TRUE(verdict.fate == Fate::loaded || verdict.fate == Fate::refused) << name << ": " << verdict.line;
        if (errors.empty() && verdict.fate == Fate::refused) {
            EXPECT_TRUE(listed(kRefusedThoughValid, name)) << name << ": " << verdict.line;
            surprises.insert(name);
        }
        if (verdict.fate != Fate::loaded) continue;
        for (const std::string& error : errors) {
            EXPECT_TRUE(listed(kTolerated, error) || listed(kNotRead, error)) << name << " loads: " << error;
            surprises.insert(error);
        }
    }
    for (const std::string& name : words(kTolerated, kNotRead, kRefusedThoughValid))
        EXPECT_TRUE(surprises.contains(name)) << "no longer: " << name;
}

/// No node instances most of the validator's meshes, so this test adds a node for each of them.
TEST_F(BadAssets, InstancedMeshesAreRead) {
    int shown = 0;
    for (const auto& [name, errors] : validated()) {
        if (!name.starts_with("mesh")) continue;
        const fs::path source = kBad / "gltf-validator" / name;
        Json scene = Json::parse(read_text(source));
        if (!scene.contains("meshes") || scene.contains("nodes")) continue;
        for (std::size_t i = 0; i < scene["meshes"].size(); ++i) scene["nodes"].push_back({{"mesh", i}});
        write_text(folder / "scene.gltf", scene.dump());
        const fs::path binary = fs::path(source).replace_extension(".bin");
        if (fs::exists(binary)) fs::copy_file(binary, folder / binary.filename(), fs::copy_options::overwrite_existing);
        const Verdict verdict = judge("validator, shown: " + name, with_scene(folder / "scene.gltf"));
        ASSERT_TRUE(verdict.fate == Fate::loaded || verdict.fate == Fate::refused) << name << ": " << verdict.line;
        if (verdict.fate == Fate::refused) {
            EXPECT_FALSE(errors.empty()) << name << ": " << verdict.line;
            continue;
        }
        for (const std::string& error : errors) EXPECT_TRUE(listed(kTolerated, error)) << name << " loads: " << error;
        ++shown;
    }
    EXPECT_GT(shown, 0);
}

TEST_F(BadAssets, PointersAndTruncatedScenes) {
    for (const char* kind : {"lfs-buffers", "lfs-pointer", "truncated"}) {
        int files = 0;
        for (const fs::path& path : fs::recursive_directory_iterator(kBad / kind)) {
            const bool scene = path.extension() == ".glb" || path.extension() == ".gltf";
            if (!scene && path.extension() != ".hdr") continue;
            ++files;
            expect_refused(path.lexically_relative(kBad), scene ? with_scene(path) : with_environment(path),
                           {path.string() + ": "});
        }
        EXPECT_GT(files, 0) << kind;
    }
}

TEST_F(BadAssets, ScenesWithFormerlyUnsupportedExtensionsLoad) {
    int files = 0;
    for (const fs::path& path : fs::recursive_directory_iterator(kBad / "unsupported-ext")) {
        if (path.extension() != ".glb" && path.extension() != ".gltf") continue;
        ++files;
        expect_loaded(path.lexically_relative(kBad), with_scene(path));
    }
    EXPECT_GT(files, 0);
}

TEST_F(BadAssets, FilesOfOpenExr) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(kBad / "exr"))
        if (entry.path().filename() != "COPYING.openexr-images") files.push_back(entry.path());
    std::ranges::sort(files);
    for (const fs::path& path : files)
        expect_refused("environment: exr/" + path.filename().string(), with_environment(path), {path.string() + ": "});
    EXPECT_GT(files.size(), 80u);
}

}  // namespace
}  // namespace halflight::test
