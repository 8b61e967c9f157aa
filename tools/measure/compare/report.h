// Writes the results of `halflight compare`: a table, JSON, maps.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/measure/compare/compare.h"

namespace halflight::compare {

/// Returns lines: the table, the missing layers, and the reasons of the verdict.
std::string table(const Comparison& result, const CompareArguments& arguments, const PictureFile& image);

/// Returns all results. windows: the line of align().
nlohmann::ordered_json json(const Comparison& result, const CompareArguments& arguments, const PictureFile& image,
                            const PictureFile& reference, const std::string& windows);

/// Returns what is known of pictures that cannot be compared.
nlohmann::ordered_json json(Verdict verdict, const CompareArguments& arguments, const std::string& reason);

/// Writes an .exr with every map as channels LAYER.METRIC, or a .png with one map in magma. That map is FLIP of the
/// first layer from 0 to 1, or else the first map from 0 to its 99.9 % quantile. Pixels that are not finite are green.
/// Returns a description of the map. Throws Error.
std::string write_map(const std::filesystem::path& path, const Comparison& result);

}  // namespace halflight::compare
