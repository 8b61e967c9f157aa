// Light links: which objects a light lights, and which ones cast its shadows.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"

namespace halflight {

/// Links of a scene's lights, by index of the object, and classes of its objects.
struct FoundLightLinks {
    std::vector<LightLinks> lights, materials, instances;
    LightLinks environment{};
    std::vector<std::uint8_t> classes;  // Instance::link_class of each instance
    std::uint8_t ground = 0;            // class of the ground that SceneEdits::ground adds
};

/// Returns the links of SceneEdits::light_links and shadow_links. Names of lights are those of light groups
/// (find_light_groups()). Names of objects are those of shadow catchers, and "ground" is the added one. A light that
/// several links name has the objects that are in all of them. Throws Error about `subject` for names that find
/// nothing, for objects without surfaces, for two links of one name, and for more than kMostLinkClasses classes.
FoundLightLinks find_light_links(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                                 const std::string& subject);

/// Sets the links of lights, materials and environment. Those of instances are set before edits of nodes.
void set_light_links(const FoundLightLinks& found, Scene& scene);

}  // namespace halflight
