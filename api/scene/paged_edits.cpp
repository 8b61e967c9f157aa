#include "api/scene/paged_edits.h"

#include "engine/core/error.h"
#include "engine/paging/pages.h"
#include "engine/scene/material_lobes.h"
#include "engine/tables/table_rows.h"

namespace halflight {
namespace {

/// Returns whether alpha decides hits on surfaces of a material whose vertices are opaque.
bool is_tested(const Material& material, const Scene& scene) {
    Scene alone;
    alone.images = scene.images;
    alone.materials = {material};
    return (TriangleWords(alone).of(0, 1) & kTriangleAlpha) != 0;
}

/// Returns whether alpha decides more hits on surfaces of a material than before.
bool adds_alpha_tests(const Material& before, const Material& now, const Scene& scene, bool vertex_colors) {
    const bool higher_cutoff = before.alpha_mode == AlphaMode::mask && now.alpha_cutoff > before.alpha_cutoff;
    const bool less = now.base_color.a < before.base_color.a || higher_cutoff;
    if (before.alpha_mode == AlphaMode::opaque || !less || is_tested(before, scene)) return false;
    return vertex_colors || is_tested(now, scene);  // the alpha of vertices is not known here
}

}  // namespace

void check_no_moved_surfaces(const SceneEdits& edits, const std::string& file) {
    if (change_surfaces(edits))
        throw Error(
            file,
            "nodes, transforms, hidden surfaces, shadow catchers, a ground, rectangles and discs cannot change with "
            "pages (light:NAME hides a light)");
    if (!edits.light_links.empty() || !edits.shadow_links.empty())
        throw Error(file, "light links and shadow links need the scene in memory, not in pages");
}

void check_paged_edits(const SceneEdits& edits, const Scene& scene, const paging::PageIndex& index,
                       const std::string& file, const std::string& source, const std::vector<bool>& driven) {
    check_no_moved_surfaces(edits, file);
    if (edits.straight_glass != index.straight_glass)
        throw Error(file, "the pages were {} with --glass-shadows straight, and a picture of them needs the same",
                    index.straight_glass ? "made" : "not made");
    if (edits.materials.empty()) return;
    Scene paged, edited;  // materials alone
    paged.name = edited.name = scene.name;
    paged.materials = edited.materials = scene.materials;
    edit_materials({.straight_glass = index.straight_glass}, paged);
    edit_materials(edits, edited, source);
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        if (i < index.geometry.used_materials.size() && index.geometry.used_materials[i] &&
            (is_one_sided(paged.materials[i]) != is_one_sided(edited.materials[i]) ||
             is_pane(paged.materials[i]) != is_pane(edited.materials[i])))
            throw Error(source.empty() ? scene.name : source + ": " + scene.name,
                        "material {}: the pages hold whether its surfaces are seen from both sides and whether light "
                        "passes them straight on, which edits of double_sided, transmission, thickness, dispersion, "
                        "roughness or "
                        "straight_shadows "
                        "cannot change (--backfaces show shows all)",
                        i);
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        if (!(i < driven.size() && driven[i]) &&
            adds_alpha_tests(scene.materials[i], edited.materials[i], scene, index.geometry.vertex_colors))
            throw Error(source.empty() ? scene.name : source + ": " + scene.name,
                        "material {}: its surfaces are opaque in the pages, and edits cannot make them transparent", i);
}

}  // namespace halflight
