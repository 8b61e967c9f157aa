// What `halflight compare` says: a table, JSON, maps.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/measure/compare/compare.h"

namespace halflight::compare {

/// The table, what is missing, and why it is not the same; lines.
std::string table(const Comparison& result, const CompareArguments& arguments, const PictureFile& image);

nlohmann::ordered_json json(const Comparison& result, const CompareArguments& arguments, const PictureFile& image);

/// .exr: every map, as channels LAYER.METRIC. .png: the first layer's FLIP from 0 to 1, in magma, else the first map
/// from 0 to what 99.9 % of its pixels are below; pixels that are not finite are green. Returns what it shows, in
/// words. Throws Error.
std::string write_map(const std::filesystem::path& path, const Comparison& result);

}  // namespace halflight::compare
