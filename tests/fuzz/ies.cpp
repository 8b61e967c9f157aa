#include "engine/io/ies.h"
#include "engine/scene/scene.h"

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/targets.h"

namespace halflight::fuzz {

void ies(std::string_view input) {
    check_errors("lamp.ies", [&] {
        Scene scene;
        scene.light_profiles = {read_ies("lamp.ies", input)};
        validate(scene);
        const LitCone cone = lit_cone(scene.light_profiles[0]);
        if (!(cone.angle > 0 && cone.share >= 0 && cone.share <= 1)) throw Broken("the cone of a profile is none");
    });
}

}  // namespace halflight::fuzz
