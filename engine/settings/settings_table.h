// The table of render settings. Checks, fingerprints, settings files, command lines, viewer panels and docs/settings.md
// follow it. A new setting needs a member of RenderSettings, a row in settings_table.cpp and its use.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "engine/settings/render_settings.h"

namespace halflight {

/// One setting that users can set. Its default is that of RenderSettings.
struct Setting {
    const char* name = "";     // key in settings files, fingerprints and docs; its option is "--name"
    const char* aliases = "";  // other names of the option, such as "-s,--spp"
    std::string_view group;    // heading in help texts
    const char* metavar = "";  // placeholder for the value in help texts; empty for a flag
    const char* help = "";     // purpose; names of values and the default are appended
    double lower = 0;          // smallest number allowed
    double upper = 0;          // largest number allowed
    bool zero = false;         // 0 is allowed below `lower`, too, and disables the setting
    bool fingerprint = true;   // decides pixels, so frames made with another value differ
    bool saved = false;        // true: part of settings files, and an option of `halflight view`
    bool memory = false;       // an option of `halflight info`, whose memory estimate depends on it
    double slider_from = 0;    // range of the viewer's slider; empty: the viewer has none
    double slider_to = 0;

    enum class Type { whole, number, flag, text, list };
    Type type = Type::text;
    std::string values{};  // names that are accepted, separated by commas; empty: numbers or any text
    /// Text of the value, which set() reads back exactly.
    std::function<std::string(const RenderSettings&)> get{};
    /// Sets the value by its text. Returns what is wrong with the text, as a phrase that follows the setting's name;
    /// empty if the value was set.
    std::function<std::string(RenderSettings&, const std::string& text)> set{};
};

/// Returns all rows, in the order of help texts.
std::span<const Setting> known_settings();
/// Returns the row of that name, which must exist.
const Setting& setting(std::string_view name);

/// Copies one setting.
void copy_setting(const Setting& setting, const RenderSettings& from, RenderSettings& to);
/// Throws Error "render settings: NAME ..." for the first setting that is out of range, not finite or unknown.
void check_setting_ranges(const RenderSettings& settings);
/// Returns docs/settings.md: this table and that of layers.
std::string settings_markdown();

}  // namespace halflight
