// Tests controls of the viewer with Dear ImGui, without a window: frames with a mouse at given places.
#include <gtest/gtest.h>
#include <imgui.h>

#include <type_traits>

#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

class ViewWidgets : public testing::Test {
  protected:
    ViewWidgets() {
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.DisplaySize = {400, 200};
        io.DeltaTime = 0.02f;
        unsigned char* pixels = nullptr;
        int width = 0, height = 0;
        io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
        wants_state_before_click();
    }
    ~ViewWidgets() override { ImGui::DestroyContext(); }

    /// Declares one frame, in which the mouse is at `place` and its left button is pressed or not. Returns whether the
    /// slider has changed the value.
    template <class Value>
    bool frame(const ImVec2& place, bool pressed, Value& value) {
        ImGui::GetIO().MousePos = place;
        ImGui::GetIO().MouseDown[0] = pressed;
        ImGui::NewFrame();
        ImGui::SetNextWindowPos({0, 0});
        ImGui::SetNextWindowSize({400, 200});
        ImGui::Begin("controls", nullptr, ImGuiWindowFlags_NoDecoration);
        bool changed = false;
        if constexpr (std::is_same_v<Value, float>) {
            changed = slider("Roughness", value, 0, 1, "%.3f", "");
        } else {
            changed = slider("Bounces", value, 0, 6, "");
        }
        const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
        middle = {0.5f * (from.x + to.x), 0.5f * (from.y + to.y)};
        ImGui::End();
        ImGui::EndFrame();
        return changed;
    }

    ImVec2 middle;  // middle of the slider
};

TEST_F(ViewWidgets, ADoubleClickOnASliderTypesAndRestoresItsValue) {
    float value = 0.25f;
    for (int i = 0; i < 3; ++i) frame({300, 190}, false, value);
    for (const bool pressed : {false, true, false}) frame(middle, pressed, value);
    EXPECT_NEAR(value, 0.5f, 0.05f) << "the first click moves the slider";
    EXPECT_FALSE(wants_state_before_click());
    EXPECT_TRUE(frame(middle, true, value));
    EXPECT_EQ(value, 0.25f);
    EXPECT_TRUE(wants_state_before_click());
    EXPECT_FALSE(wants_state_before_click()) << "once for each double click";
    for (int i = 0; i < 2; ++i) frame(middle, false, value);
    EXPECT_TRUE(ImGui::GetIO().WantTextInput) << "a text field is open";
    EXPECT_EQ(value, 0.25f);
}

TEST_F(ViewWidgets, ADoubleClickOnAnUnmovedSliderRestoresNothing) {
    int value = 3;
    for (int i = 0; i < 3; ++i) frame({300, 190}, false, value);
    for (const bool pressed : {false, true, false, true, false}) frame(middle, pressed, value);
    EXPECT_EQ(value, 3);
    EXPECT_FALSE(wants_state_before_click());
}

}  // namespace
}  // namespace halflight::view
