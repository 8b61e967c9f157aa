// Edits in settings files: objects by name, with the keys of the command line (api/halflight/edit_text.h).
#pragma once

#include "api/scene/settings_element.h"

namespace halflight::settings {

/// Reads all edits of a file except those of the environment. Throws Error that names the element.
void read_edits(const Element& file, SceneEdits& edits);
/// Writes what read_edits() reads.
void write_edits(const SceneEdits& edits, Json& json);

}  // namespace halflight::settings
