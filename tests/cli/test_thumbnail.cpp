// Tests `halflight thumbnail`: its pictures, and its limits of time and memory.
#include "engine/io/png.h"
#include "tests/cli/command_test.h"

namespace halflight::test {
namespace {

class Thumbnail : public CommandTest {
  protected:
    std::string scene = copy_room(folder.path);
};

TEST_F(Thumbnail, IsASquarePictureOfTheScene) {
    const Outcome outcome = done({"thumbnail", "--quiet", scene, file("a.png"), "--size", "48", "--time", "0.1"});
    EXPECT_EQ(outcome.out + outcome.err, "");
    const Image picture = read_png("a.png", read_text(file("a.png")), 4096);
    EXPECT_EQ(ivec2(picture.width, picture.height), ivec2(48));
    const auto [least, most] = std::ranges::minmax(picture.pixels);
    EXPECT_GT(most - least, 0.2f) << "it shows nothing";
    write_text(file("c.png"), "of somebody else");
    done({"thumbnail", scene, file("c"), "--size", "48", "--time", "0.1"});
    EXPECT_EQ(read_png("c", read_text(file("c")), 4096).width, 48) << "file managers name no format";
    EXPECT_EQ(read_text(file("c.png")), "of somebody else");
    std::filesystem::copy(scene, file("model"));
    refused(2, {"thumbnail", file("model"), file("model")}, "is both input and output");
    done({"thumbnail", scene, file("b.jpg"), "--time", "0.1"});
    EXPECT_TRUE(std::filesystem::exists(file("b.jpg")));
}

TEST_F(Thumbnail, EndsAtItsLimits) {
    refused(1, {"thumbnail", "--quiet", scene, file("a.png"), "--time", "1000", "--size", "1024", "--limit", "1"},
            "room.gltf: not rendered within 1 s", {.most_seconds = 20});
    refused(1, {"thumbnail", HALFLIGHT_SOURCE_DIR "/scenes/atrium.glb", file("a.png"), "--memory", "170M"}, "--memory");
    refused(2, {"thumbnail", scene, file("a.exr")}, "a.exr");
    refused(2, {"thumbnail", scene, scene}, "room.gltf");
    write_text(file("empty.gltf"), R"({"asset": {"version": "2.0"}})");
    refused(1, {"thumbnail", "--quiet", file("empty.gltf"), file("a.png")}, "empty.gltf: has no surfaces");
    refused(1, {"thumbnail", file("room.bin"), file("a.png")}, "room.bin");
}

}  // namespace
}  // namespace halflight::test
