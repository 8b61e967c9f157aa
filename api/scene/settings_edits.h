// Edits in settings files: objects by name, with the keys of the command line (api/halflight/edit_text.h).
#pragma once

#include "api/halflight/edit_keys.h"
#include "api/scene/settings_element.h"

namespace halflight::settings {

/// Reads the path of a file, relative to the folder of the settings file. Throws Error for empty names.
std::filesystem::path read_path(const Element& e, const std::filesystem::path& folder);
/// Returns the text that read_path() reads. Throws Error for names that are not UTF-8.
Json path_json(const std::filesystem::path& path, const std::filesystem::path& folder);

/// Reads all edits of a file in `folder` except those of the environment. Throws Error that names the element.
void read_edits(const Element& file, const std::filesystem::path& folder, SceneEdits& edits);
/// Writes what read_edits() reads.
void write_edits(const SceneEdits& edits, const std::filesystem::path& folder, Json& json);

/// Reads the edits over frames: objects by name or key, whose members are values by frame. Throws Error about the
/// element.
void read_keys(const Element& keys, EditKeys& all);
Json keys_json(const EditKeys& keys);

}  // namespace halflight::settings
