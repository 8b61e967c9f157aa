// Declarations shared by the files of this folder. No other header names OpenColorIO's types.
#pragma once

#include <OpenColorIO/OpenColorIO.h>

#include <filesystem>
#include <string>
#include <vector>

#include "engine/color/color.h"

namespace halflight {

namespace ocio = OCIO_NAMESPACE;

/// Optimizations that keep arithmetic exact, so that CPU and GPU differ by rounding only. Inverse LUTs have no exact
/// GPU form; both sides use the fast one.
inline constexpr auto kOptimization =
    static_cast<ocio::OptimizationFlags>(ocio::OPTIMIZATION_LOSSLESS | ocio::OPTIMIZATION_LUT_INV_FAST);

/// A config and the files that it consists of.
struct ConfigFile {
    ocio::ConstConfigRcPtr config;
    std::vector<VersionedFile> files;  // the config's own file, then existing LUTs
};
/// Reads a config. Throws ocio::Exception if it or a file that it names is not a regular file.
ConfigFile read_config(const std::filesystem::path& path);

/// Throws ocio::Exception if the aliases of a config's YAML text stand for too much, or for themselves.
void check_aliases(const std::string& text);

/// Throws ocio::Exception that names the objects if colour spaces, looks or transforms refer to themselves, directly
/// or through others, or are nested too deep.
void check_references(const ocio::Config& config);

struct ColorConfig::Data {
    ocio::ConstConfigRcPtr config;
    std::string source;
    std::vector<VersionedFile> files;
    std::string rendering_space;       // name of the config's colour space that `from_rec709` converts to
    ocio::TransformRcPtr from_rec709;  // conversion; null if rendering_space is linear Rec.709
};

/// Returns ViewProcessor::encoding() for views that end in `space`.
std::optional<DisplayEncoding> encoding_of(const ocio::Config& config, const ocio::ConstColorSpaceRcPtr& space);

/// A tone map for which OpenColorIO 2.1 has no exact transform: the minimum and maximum over channels of PBR Neutral,
/// the analytic curve of AgX. A view transform asks for it by its family.
struct ToneMap {
    const char* family;          // family of the view transform
    const char* function;        // name in shaders/shared/tone_map.h
    vec3 (*apply)(vec3 colour);  // linear Rec.709 to linear Rec.709
};

/// The steps of a view: looks, then the tone map, then the processor. Views without a tone map have the looks in the
/// processor.
struct ViewProcessor::Data {
    std::string display, view, look;
    std::optional<DisplayEncoding> encoding;
    float exposure_scale = 1;
    ocio::ConstProcessorRcPtr looks;      // linear Rec.709 to linear Rec.709; null: no step
    const ToneMap* tone_map = nullptr;    // null: no step
    ocio::ConstProcessorRcPtr processor;  // linear Rec.709 to the display
    ocio::ConstCPUProcessorRcPtr looks_cpu, cpu;
};

}  // namespace halflight
