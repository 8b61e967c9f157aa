// What the files of this folder share, and the only place that names OpenColorIO's types.
#pragma once

#include <OpenColorIO/OpenColorIO.h>

#include <filesystem>
#include <string>
#include <vector>

#include "engine/color/color.h"

namespace halflight {

namespace ocio = OCIO_NAMESPACE;

/// Exact arithmetic, so that CPU and GPU differ by rounding only; inverse LUTs have no exact GPU form, so fast on both.
inline constexpr auto kOptimization =
    static_cast<ocio::OptimizationFlags>(ocio::OPTIMIZATION_LOSSLESS | ocio::OPTIMIZATION_LUT_INV_FAST);

/// A config, and the files that it is made of.
struct ConfigFile {
    ocio::ConstConfigRcPtr config;
    std::vector<std::filesystem::path> files;  // its own first, then those of LUTs that are there
};
/// The config in a file, and what it names are regular files. Throws ocio::Exception.
ConfigFile read_config(const std::filesystem::path& path);

struct ColorConfig::Data {
    ocio::ConstConfigRcPtr config;
    std::string source;
    std::vector<std::filesystem::path> files;
    std::string rendering_space;       // a name of the config that `from_rec709` leads to
    ocio::TransformRcPtr from_rec709;  // null where rendering_space is linear Rec.709 itself
};

struct ViewProcessor::Data {
    std::string display, view, look;
    float exposure_scale = 1;
    ocio::ConstProcessorRcPtr processor;
    ocio::ConstCPUProcessorRcPtr cpu;
};

}  // namespace halflight
