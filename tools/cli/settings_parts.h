// Settings files whose entries no longer suit the program or the scene. The viewer opens without these entries.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "api/halflight/settings_file.h"

namespace halflight {

/// The entries of a settings file, each of which can be left out: the members of the file, or the members of those that
/// list independent edits. Settings that decide together, as those of the lens, are one entry.
class SettingsParts {
  public:
    /// Splits the text of the file at `path`. Throws the Error of parse_settings() if the text is no JSON, or not of
    /// the version that is known.
    SettingsParts(std::string_view text, std::filesystem::path path);

    /// Calls `fits` with each entry alone, and drops those for which it throws Error, or which cannot be parsed.
    /// Returns what is wrong with them, without the name of the file.
    std::vector<std::string> drop_unfit(const std::function<void(const SavedSettings&)>& fits);
    /// Returns the entries that are left. Throws the Error of parse_settings() for entries that exclude each other.
    SavedSettings settings() const;

  private:
    using Json = nlohmann::ordered_json;
    SavedSettings parsed(const Json& part) const;

    std::filesystem::path path_;
    Json version_;             // settings file that has its version alone
    std::vector<Json> parts_;  // files of one entry
};

/// Returns the warning about entries that were left out.
std::string left_out_warning(const std::filesystem::path& path, const std::vector<std::string>& problems);

}  // namespace halflight
