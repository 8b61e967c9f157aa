// Tests bad files of other projects in ../shared/assets/bad: invalid scenes from the tests of Khronos' glTF validator,
// and files that once crashed OpenEXR.
#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cli/bad_input.h"

namespace halflight::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kBad = fs::path(HALFLIGHT_SHARED_DIR) / "assets/bad";

/// Validation errors with which a scene still loads, each with the reason why that is right for rendering.
const std::map<std::string, std::string> kTolerated = {
    {"ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND", "bounds are taken from the data"},
    {"ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND", "bounds are taken from the data"},
    {"ACCESSOR_MAX_MISMATCH", "bounds are taken from the data"},
    {"ACCESSOR_MIN_MISMATCH", "bounds are taken from the data"},
    {"MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS", "bounds are taken from the data"},
    {"ACCESSOR_INVALID_FLOAT", "triangles that are not finite are left out and counted"},
    {"ACCESSOR_INVALID_SIGN", "tangents that cannot be used are made anew, with a warning"},
    {"ACCESSOR_VECTOR3_NON_UNIT", "normals and tangents are brought to unit length"},
    {"ACCESSOR_NON_CLAMPED", "colours are clamped, with a warning"},
    {"ACCESSOR_INDEX_PRIMITIVE_RESTART", "the vertex of that number is there"},
    {"ACCESSOR_MATRIX_ALIGNMENT", "data is read byte by byte"},
    {"ACCESSOR_OFFSET_ALIGNMENT", "data is read byte by byte"},
    {"ACCESSOR_TOTAL_OFFSET_ALIGNMENT", "data is read byte by byte"},
    {"GLB_CHUNK_LENGTH_UNALIGNED", "data is read byte by byte"},
    {"ACCESSOR_NORMALIZED_INVALID", "says nothing about floats"},
    {"BUFFER_DATA_URI_MIME_TYPE_INVALID", "the bytes are those of the buffer, whatever they call themselves"},
    {"BUFFER_MISSING_GLB_DATA", "nothing that is shown reads the buffer"},
    {"BUFFER_VIEW_TOO_LONG", "nothing that is shown reads the view"},
    {"DUPLICATE_ELEMENTS", "named twice is named"},
    {"EMPTY_ENTITY", "an empty list is as good as none"},
    {"GLB_DUPLICATE_CHUNK", "chunks after the first two are passed over, as those of unknown type are"},
    {"GLB_UNEXPECTED_BIN_CHUNK", "the chunk says itself what it is"},
    {"INVALID_JSON", "a byte order mark harms nobody"},
    {"INVALID_URI", "what follows its comma can be read"},
    {"MESH_INVALID_WEIGHTS_COUNT", "what has no weight is not morphed, with a warning"},
    {"MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT", "each primitive is morphed by the targets that it has"},
    {"MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT", "targets of weight 0 are not read; others are refused"},
    {"MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR", "what is not there is not morphed"},
    {"MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT", "32-bit integers convert like any other"},
    {"MESH_PRIMITIVE_INVALID_ATTRIBUTE", "attributes of unknown names are not read"},
    {"MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY", "the sets that are wanted are found by their numbers"},
    {"MESH_PRIMITIVE_JOINTS_WEIGHTS_MISMATCH", "sets are used in pairs, and only by skins"},
    {"MESH_PRIMITIVE_TOO_FEW_TEXCOORDS", "a missing set is all zero, with a warning"},
    {"TYPE_MISMATCH", "extensions that are not known are not looked into"},
    {"UNDECLARED_EXTENSION", "an extension that is there is used"},
    {"UNSATISFIED_DEPENDENCY", "an offset into nothing is not followed"},
};

/// Files that load because no node instances their invalid part. Once instanced, the part is refused.
const std::set<std::string> kNotRead = {
    "ACCESSOR_INDEX_OOB",
    "ACCESSOR_JOINTS_INDEX_DUPLICATE",
    "ACCESSOR_JOINTS_INDEX_OOB",
    "ACCESSOR_SMALL_BYTESTRIDE",
    "ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE",
    "ACCESSOR_TOO_LONG",
    "ACCESSOR_WEIGHTS_NEGATIVE",
    "ACCESSOR_WEIGHTS_NON_NORMALIZED",
    "BUFFER_VIEW_INVALID_BYTE_STRIDE",
    "BUFFER_VIEW_TARGET_OVERRIDE",
    "MESH_PRIMITIVE_ACCESSOR_UNALIGNED",
    "MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE",
    "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT",
    "MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT",
    "MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE",
    "MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT",
};

/// Valid files that are refused, each with the reason.
const std::map<std::string, std::string> kRefusedThoughValid = {
    {"accessor/unknown_type.gltf", "a type that glTF 2.0 has not"},
    {"buffer/non_relative_uri.gltf", "nothing is downloaded"},
    {"root/named_objects.gltf", "what it shows is in a buffer without data"},
    {"root/unused_objects.gltf", "what it shows is in a buffer without data"},
};

class BadAssets : public testing::Test {
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
            EXPECT_TRUE(kRefusedThoughValid.contains(name)) << name << ": " << verdict.line;
            surprises.insert(name);
        }
        if (verdict.fate != Fate::loaded) continue;
        for (const std::string& error : errors) {
            EXPECT_TRUE(kTolerated.contains(error) || kNotRead.contains(error)) << name << " loads: " << error;
            surprises.insert(error);
        }
    }
    std::set<std::string> listed = kNotRead;
    for (const auto& list : {kTolerated, kRefusedThoughValid})
        for (const auto& [name, reason] : list) listed.insert(name);
    for (const std::string& name : listed) EXPECT_TRUE(surprises.contains(name)) << "no longer: " << name;
}

/// No node instances most of the validator's meshes, so this test adds a node for each of them.
TEST_F(BadAssets, InstancedMeshesAreRead) {
    const TemporaryFolder folder;
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
        for (const std::string& error : errors) EXPECT_TRUE(kTolerated.contains(error)) << name << " loads: " << error;
        ++shown;
    }
    EXPECT_GT(shown, 0);
}

TEST_F(BadAssets, PointersAndTruncatedScenes) {
    for (const char* folder : {"lfs-buffers", "lfs-pointer", "truncated"}) {
        int files = 0;
        for (const auto& entry : fs::recursive_directory_iterator(kBad / folder)) {
            const fs::path& path = entry.path();
            const std::string name = path.lexically_relative(kBad);
            files += path.extension() == ".glb" || path.extension() == ".gltf" || path.extension() == ".hdr";
            if (path.extension() == ".glb" || path.extension() == ".gltf")
                expect_refused("scene: " + name, with_scene(path), {path.string() + ": "});
            if (path.extension() == ".hdr")
                expect_refused("environment: " + name, with_environment(path), {path.string() + ": ", "truncated"});
        }
        EXPECT_GT(files, 0) << folder;
    }
}

TEST_F(BadAssets, ScenesWithFormerlyUnsupportedExtensionsLoad) {
    int files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(kBad / "unsupported-ext")) {
        const fs::path& path = entry.path();
        if (path.extension() != ".glb" && path.extension() != ".gltf") continue;
        ++files;
        expect_loaded("scene: " + std::string(path.lexically_relative(kBad)), with_scene(path));
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
