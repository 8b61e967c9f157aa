// A session on the Cornell box, and a small animated scene, for tests of the viewer.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/process.h"
#include "tools/common/temporary_folder.h"
#include "tools/view/session.h"

namespace halflight::view {

inline constexpr ivec2 kSize(512, 512);

inline PreviewArguments arguments_for(const std::filesystem::path& scene) {
    PreviewArguments a;
    a.choice.scene = scene;
    a.log.level = LogLevel::error;
    return a;
}

/// Writes a triangle that hangs as "hand" on the node "arm", 1 unit along x. The animation "slide" of 2 s moves it. The
/// file has no camera.
inline std::filesystem::path write_hand(const TemporaryFolder& folder) {
    test::write_text(folder / "hand.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "arm", "children": [1]}, {"name": "hand", "translation": [1, 0, 0], "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "animations": [{"name": "slide", "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
                        "samplers": [{"input": 1, "output": 2}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-2, -2, 0],
                       "max": [2, 2, 0]},
                      {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
                      {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 32, "byteLength": 8},
                        {"buffer": 0, "byteOffset": 8, "byteLength": 24}],
        "buffers": [{"byteLength": 40, "uri":
            "data:application/octet-stream;base64,AAAAwAAAAMAAAAAAAAAAQAAAAMAAAAAAAAAAAAAAAEAAAAAAAAAAQA=="}]})");
    return folder / "hand.gltf";
}

/// Fixture with a session that shows scenes/cornell.glb.
class CornellSession : public testing::Test {
  protected:
    static PreviewArguments cornell() { return arguments_for(HALFLIGHT_SOURCE_DIR "/scenes/cornell.glb"); }

    Session session{cornell(), ColorConfig::load()};
};

}  // namespace halflight::view
