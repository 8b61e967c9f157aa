// Tests `halflight view --watch` by scripts, while another thread changes the files.
#include <functional>
#include <thread>
#include <utility>

#include "tests/cli/view_test.h"

namespace halflight::test {
namespace {

class ViewWatch : public ViewTest {
  protected:
    ViewWatch() { size = {96, 72}; }
    /// Runs a script. Each file that it leaves starts the change of its name, in their order.
    Outcome watch(const std::string& script,
                  const std::vector<std::pair<std::string, std::function<void()>>>& changes) {
        std::jthread changing([&](const std::stop_token& stop) {
            for (const auto& [name, change] : changes) {
                while (!std::filesystem::exists(file(name))) {
                    if (stop.stop_requested()) return;
                    std::this_thread::sleep_for(std::chrono::milliseconds(10));
                }
                change();
            }
        });
        Outcome outcome = view(script, words("--watch"));
        changing.request_stop();
        return outcome;
    }
    void change(const std::string& from, const std::string& to) {
        const std::size_t at = room.find(from);
        ASSERT_NE(at, std::string::npos);
        room.replace(at, from.size(), to);
        write_text(file("new"), room);
        std::filesystem::rename(file("new"), scene);
    }

    std::string room = read_text(scene);
};

TEST_F(ViewWatch, EditsStayAndDamageKeepsThePicture) {
    const Outcome outcome = watch(
        R"(
        wait samples 2
        material lamp.emission=4,4,4
        node "1=translate:0.5,0,0"
        select node:3
        wait samples 2
        state @1.json
        reload
        wait samples 2
        screenshot @painted.exr
        state @2.json
        reload
        wait samples 2
        screenshot @broken.exr
        state @3.json
        reload
        wait samples 2
        screenshot @renamed.exr
        state @4.json
    )",
        {{"1.json", [&] { change("[0.7,", "[0.1,"); }},
         {"2.json",
          [&] {
              write_text(file("new"), room.substr(0, 200));
              std::filesystem::rename(file("new"), scene);
          }},
         {"3.json", [&] { change("\"name\": \"lamp\", \"doubleSided\"", "\"name\": \"bulb\", \"doubleSided\""); }}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_TRUE(same_bits(exr("painted.exr"), exr("broken.exr")));
    std::size_t warnings = 0;
    for (std::size_t at = 0; (at = outcome.err.find("warning: ", at)) != std::string::npos; ++at) ++warnings;
    EXPECT_EQ(warnings, 2u) << outcome.err;
    expect_has(outcome.err, "room.gltf: ");
    expect_has(outcome.err, "lamp");  // the edit that no longer suits the scene
    EXPECT_EQ(json("4.json")["selection"], json("1.json")["selection"]);
    EXPECT_FALSE(same_bits(exr("renamed.exr"), exr("broken.exr")));
}

TEST_F(ViewWatch, CamerasFollowTheScene) {
    const Outcome outcome = watch(R"(
        camera above
        state @1.json
        reload
        wait samples 2
        screenshot @moved.exr
        orbit 20 10
        wait samples 2
        state @2.json
        reload
        wait samples 2
        state @3.json
    )",
                                  {{"1.json", [&] { change("[0, 8, 0]", "[0.5, 8, 0]"); }},
                                   {"2.json", [&] { change("[0.5, 8, 0]", "[0.7, 8, 0]"); }}});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(json("2.json")["camera"], json("3.json")["camera"]) << "a camera that the user has moved stays";
    change("[0.7, 8, 0]", "[0.5, 8, 0]");
    EXPECT_TRUE(same_bits(exr("moved.exr"), render("render.exr", "--camera above")));
}

}  // namespace
}  // namespace halflight::test
