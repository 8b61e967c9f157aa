// The table of settings that cannot be combined. Checks of settings, settings files, command lines, the viewer's panels
// and docs/settings.md follow it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "engine/settings/render_settings.h"

namespace halflight {

/// Least number of samples from which adaptive sampling and error targets estimate noise.
inline constexpr int kLeastEstimatedSamples = 16;

/// Facts that decide a picture beside its settings.
struct Occasion {
    bool shutter = false;           // motion blur
    bool checkpoint = false;        // samples are saved
    bool own_checkpoint = false;    // samples of a single picture are saved
    bool sequence = false;          // frames of a sequence are rendered
    bool part_of_sequence = false;  // some frames of a sequence are rendered in this run
    bool light_groups = false;      // layers of light groups that the settings do not list yet
    bool links = false;             // lights leave objects out
    bool pages = false;             // the geometry is read from a page file
    bool moved_surfaces = false;    // edits move, hide or add surfaces, or make them shadow catchers
    bool asked = false;             // settings are those that options ask for, without defaults of sequences
    bool finished = false;          // the picture is finished, and not a stage of one that a viewer refines
};
/// A feature that settings, or the occasion of a picture, can switch on.
struct Feature {
    const char* name;                    // name in sentences
    std::array<const char*, 4> options;  // options that switch it on, which may be settings; null: there are no more
    bool (*on)(const RenderSettings&, const Occasion&);
    const char* value = "";  // value of the first option that switches it on
    /// Returns the first option for which is_it(option) is true; null: none.
    template <class F>
    const char* option(const F& is_it) const {
        for (const char* one : options)
            if (one && is_it(one)) return one;
        return nullptr;
    }
};

/// A row: one feature needs another, or cannot be combined with it.
struct Constraint {
    enum class Kind : std::uint8_t {
        mathematics,  // the combination has no meaning
        not_built,    // the combination has a meaning, and the program lacks it
    };
    const Feature& one;
    enum class Relation : std::uint8_t { excludes, needs } relation;
    const Feature& other;
    Kind kind;
    const char* reason;  // clause that follows the names

    bool broken_by(const RenderSettings& settings, const Occasion& occasion) const;
    /// Returns "ONE cannot be combined with OTHER (option): REASON".
    std::string text(const char* option = nullptr) const;
};
std::span<const Constraint> known_constraints();

/// Returns the first row that is broken; null: none.
const Constraint* broken_constraint(const RenderSettings& settings, const Occasion& occasion = {});
/// Throws Error "render settings: ..." for that row.
void check_constraints(const RenderSettings& settings, const Occasion& occasion = {});
/// Returns the table in Markdown.
std::string constraints_markdown();

}  // namespace halflight
