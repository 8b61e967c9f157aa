#include <filesystem>
#include <set>
#include <sstream>

#include "engine/color/ocio.h"
#include "engine/core/error.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

// bytes; the largest config of the ACES project has 2 MB
constexpr std::uint64_t kMaxConfigBytes = std::uint64_t{64} << 20;
// bytes; a text LUT of 129^3 entries has a tenth of this size
constexpr std::uint64_t kMaxLutBytes = std::uint64_t{1} << 30;

/// Search for the files of a config. It refuses devices and pipes, which OpenColorIO would open and read or wait for
/// without end.
class FileGuard {
  public:
    explicit FileGuard(const ocio::Config& config) : config_(config) {}

    /// Returns the existing files, sorted by name.
    std::set<fs::path> check_all() {
        for (int i = 0; i < config_.getNumColorSpaces(ocio::SEARCH_REFERENCE_SPACE_ALL, ocio::COLORSPACE_ALL); ++i) {
            const auto space = config_.getColorSpace(
                config_.getColorSpaceNameByIndex(ocio::SEARCH_REFERENCE_SPACE_ALL, ocio::COLORSPACE_ALL, i));
            check(space->getTransform(ocio::COLORSPACE_DIR_TO_REFERENCE));
            check(space->getTransform(ocio::COLORSPACE_DIR_FROM_REFERENCE));
        }
        for (int i = 0; i < config_.getNumLooks(); ++i) {
            const auto look = config_.getLook(config_.getLookNameByIndex(i));
            check(look->getTransform());
            check(look->getInverseTransform());
        }
        for (int i = 0; i < config_.getNumViewTransforms(); ++i) {
            const auto view = config_.getViewTransform(config_.getViewTransformNameByIndex(i));
            check(view->getTransform(ocio::VIEWTRANSFORM_DIR_TO_REFERENCE));
            check(view->getTransform(ocio::VIEWTRANSFORM_DIR_FROM_REFERENCE));
        }
        for (int i = 0; i < config_.getNumNamedTransforms(ocio::NAMEDTRANSFORM_ALL); ++i) {
            const auto named =
                config_.getNamedTransform(config_.getNamedTransformNameByIndex(ocio::NAMEDTRANSFORM_ALL, i));
            check(named->getTransform(ocio::TRANSFORM_DIR_FORWARD));
            check(named->getTransform(ocio::TRANSFORM_DIR_INVERSE));
        }
        return files_;
    }

  private:
    void check(const ocio::ConstTransformRcPtr& transform) {
        if (const auto group = std::dynamic_pointer_cast<const ocio::GroupTransform>(transform)) {
            for (int i = 0; i < group->getNumTransforms(); ++i) check(group->getTransform(i));
        } else if (const auto file = std::dynamic_pointer_cast<const ocio::FileTransform>(transform)) {
            check_file(file->getSrc());
        }
    }

    void check_file(const char* source) {
        fs::path path;
        try {
            path = config_.getCurrentContext()->resolveFileLocation(source);
        } catch (const ocio::Exception&) {
            return;  // a missing LUT is reported when something needs it
        }
        std::error_code error;
        if (!fs::is_regular_file(path, error))
            throw ocio::Exception(fmt::format("LUT {}: not a regular file", path.string()).c_str());
        const auto size = fs::file_size(path, error);
        if (error) throw ocio::Exception(fmt::format("LUT {}: {}", path.string(), error.message()).c_str());
        if (size > kMaxLutBytes)
            throw ocio::Exception(
                fmt::format("LUT {}: {} bytes are more than the limit of {}", path.string(), size, kMaxLutBytes)
                    .c_str());
        files_.insert(path);
    }

    const ocio::Config& config_;
    std::set<fs::path> files_;
};

/// Reads a file. Errors do not name the file, as in OpenColorIO's exceptions.
std::string read(const fs::path& path) {
    try {
        return read_file(path, kMaxConfigBytes);
    } catch (const Error& e) {
        throw ocio::Exception(std::string(e.reason()).c_str());
    }
}

}  // namespace

ConfigFile read_config(const fs::path& path) {
    ocio::ClearAllCaches();  // LUTs may have changed since another config was read
    if (path.string().starts_with("ocio://")) {
#if OCIO_VERSION_HEX >= 0x02020000
        return {ocio::Config::CreateFromFile(path.c_str()), {}};
#else
        throw ocio::Exception("configs that are part of OpenColorIO exist since its version 2.2; name a file");
#endif
    }
    const VersionedFile file = versioned(path);
    const std::string bytes = read(path);
    if (is_lfs_pointer(bytes)) throw ocio::Exception("it is a Git LFS pointer, not the file itself");
    check_aliases(bytes);
    std::istringstream text(bytes);
    const ocio::ConfigRcPtr config = ocio::Config::CreateFromStream(text)->createEditableCopy();
    config->setWorkingDir(fs::absolute(path).parent_path().c_str());  // base of relative file names
    ConfigFile result{config, {file}};
    check_references(*config);
    for (const fs::path& lut : FileGuard(*config).check_all()) result.files.push_back(versioned(lut));
    return result;
}

}  // namespace halflight
