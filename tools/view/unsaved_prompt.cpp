#include "tools/view/unsaved_prompt.h"

#include <imgui.h>

#include <algorithm>
#include <utility>

#include "tools/view/keys.h"
#include "tools/view/widgets.h"

namespace halflight::view {

void UnsavedPrompt::ask(std::string question, std::string file, std::function<void()> f) {
    question_ = std::move(question);
    file_ = std::move(file);
    then_ = std::move(f);
}

void UnsavedPrompt::proceed() {
    if (const auto then = std::exchange(then_, {})) then();
}

UnsavedPrompt::Answer UnsavedPrompt::declare() {
    constexpr const char* kTitle = "Unsaved edits";
    if (!then_) return Answer::none;
    if (!ImGui::IsPopupOpen(kTitle)) ImGui::OpenPopup(kTitle);
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({std::min(28 * ImGui::GetFontSize(), size.x), 0});
    if (!ImGui::BeginPopupModal(kTitle, nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoSavedSettings))
        return Answer::none;
    text(question_);
    faint_text(shortened("Settings file: " + file_, ImGui::GetContentRegionAvail().x));
    ImGui::Spacing();
    Answer answer = Answer::none;
    if (button("Save", "writes the settings file (Enter)")) answer = Answer::save;
    if (button("Discard", "loses the edits", true)) answer = Answer::discard;
    if (button("Cancel", "keeps the edits and goes on (Escape)", true)) answer = Answer::cancel;
    if (key_pressed(ImGuiKey_Enter) || key_pressed(kKeypadEnter)) answer = Answer::save;
    if (key_pressed(ImGuiKey_Escape)) answer = Answer::cancel;
    if (answer != Answer::none) ImGui::CloseCurrentPopup();
    if (answer == Answer::cancel) then_ = {};
    ImGui::EndPopup();
    return answer;
}

}  // namespace halflight::view
