#include "tools/view/widgets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <utility>

#include "engine/core/short_number.h"
#include "tools/view/keys.h"

namespace halflight::view {
namespace {

constexpr float kLabelShare = 0.42f;  // share of the width that labels take

bool restored = false;  // a double click has restored the value of a slider

float left_edge() {
    return ImGui::GetWindowContentRegionMin().x;
}
float right_edge() {
    return ImGui::GetWindowContentRegionMax().x;
}

/// Puts an item of that width beside the last one if there is room.
void beside(float width) {
    const float right = ImGui::GetWindowPos().x + right_edge();
    if (ImGui::GetItemRectMax().x + ImGui::GetStyle().ItemSpacing.x + width <= right) ImGui::SameLine();
}

/// Gives the controls of a row an id of their own.
class Id {
  public:
    explicit Id(const char* name) { ImGui::PushID(name); }
    ~Id() { ImGui::PopID(); }
    Id(const Id&) = delete;
    Id& operator=(const Id&) = delete;
};

/// Lets a double click on the slider that is declared next open its text, as on the other numbers; Dear ImGui 1.86 asks
/// for Ctrl and a click. The first click has moved the slider, so the second one restores the value, and the viewer
/// takes back the edit (wants_state_before_click()).
class TypesByDoubleClick {
  public:
    template <class T>
    explicit TypesByDoubleClick(T& value) : ctrl_(ImGui::GetIO().KeyCtrl) {
        static ImGuiID clicked = 0;  // slider that was clicked last, and its value before that
        static T before{};
        const ImVec2 corner = ImGui::GetCursorScreenPos();
        const ImVec2 end(corner.x + ImGui::CalcItemWidth(), corner.y + ImGui::GetFrameHeight());
        const ImGuiID id = ImGui::GetID("##slider");
        if (!ImGui::IsWindowHovered() || !ImGui::IsMouseHoveringRect(corner, end)) {
            if (clicked == id && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) clicked = 0;
            return;
        }
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
            ImGui::GetIO().KeyCtrl = true;
            if (clicked == id) restores_ = std::exchange(value, before) != before;
            restored |= restores_;
        } else if (ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
            clicked = id, before = value;
        }
    }
    TypesByDoubleClick(const TypesByDoubleClick&) = delete;
    TypesByDoubleClick& operator=(const TypesByDoubleClick&) = delete;
    ~TypesByDoubleClick() { ImGui::GetIO().KeyCtrl = ctrl_; }
    bool restores() const { return restores_; }

  private:
    bool ctrl_, restores_ = false;
};

}  // namespace

void text(const std::string& line) {
    ImGui::PushTextWrapPos();
    ImGui::TextUnformatted(line.c_str());
    ImGui::PopTextWrapPos();
}

void faint_text(const std::string& line) {
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    text(line);
    ImGui::PopStyleColor();
}

void error_text(const std::string& line) {
    ImGui::PushStyleColor(ImGuiCol_Text, kErrorColor);
    text(line);
    ImGui::PopStyleColor();
}

std::string shortened(const std::string& text, float width) {
    if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
    const auto inside = [&](std::size_t at) { return at < text.size() && (text[at] & 0xc0) == 0x80; };
    const auto with = [&](std::size_t letters) {  // bytes on both sides together, whole UTF-8 letters
        std::size_t head = (letters + 1) / 2, tail = text.size() - letters / 2;
        while (head > 0 && inside(head)) --head;
        while (inside(tail)) ++tail;
        return text.substr(0, head) + "..." + text.substr(tail);
    };
    std::size_t fits = 0, not_fits = text.size();
    while (fits + 1 < not_fits) {
        const std::size_t middle = (fits + not_fits) / 2;
        (ImGui::CalcTextSize(with(middle).c_str()).x <= width ? fits : not_fits) = middle;
    }
    return with(fits);
}

void tooltip(const char* help) {
    if (*help == 0 || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    const ImVec2 padding = ImGui::GetStyle().WindowPadding;
    const float wrap = 24 * ImGui::GetFontSize();
    const ImVec2 text = ImGui::CalcTextSize(help, nullptr, false, wrap);
    const float width = text.x + 2 * padding.x;
    const float left = ImGui::GetWindowPos().x, right = left + ImGui::GetWindowWidth();
    const float top = ImGui::GetItemRectMin().y;
    if (right + width <= ImGui::GetIO().DisplaySize.x)
        ImGui::SetNextWindowPos({right, top});
    else if (width <= left)
        ImGui::SetNextWindowPos({left, top}, ImGuiCond_Always, {1, 0});
    // Without a size, the tooltip has that of the last one in its first frame.
    ImGui::SetNextWindowSize({width, text.y + 2 * padding.y});
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(padding.x + wrap);
    ImGui::TextUnformatted(help);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

void close_by_escape() {
    if (key_pressed(ImGuiKey_Escape)) ImGui::CloseCurrentPopup();
}

void value(const char* name, const std::string& text, const char* help) {
    ImGui::TextUnformatted(name);
    tooltip(help);
    const float column = left_edge() + kLabelShare * (right_edge() - left_edge());
    const float gap = ImGui::GetStyle().ItemSpacing.x;
    const bool name_fits = left_edge() + ImGui::CalcTextSize(name).x + gap < column;
    // Dear ImGui breaks lines at points, too: inside of numbers.
    const bool text_fits = column + ImGui::CalcTextSize(text.c_str()).x <= right_edge();
    if (name_fits && text_fits) ImGui::SameLine(column);
    ImGui::PushTextWrapPos();
    ImGui::TextUnformatted(text.c_str());
    ImGui::PopTextWrapPos();
}

void heading(const char* title) {
    ImGui::Spacing();
    text(title);
    ImGui::Separator();
}

void label(const char* text, const char* help) {
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(text);
    tooltip(help);
    const float column = left_edge() + kLabelShare * (right_edge() - left_edge());
    const float end = ImGui::GetItemRectMax().x - ImGui::GetWindowPos().x;
    if (end + ImGui::GetStyle().ItemSpacing.x < column) ImGui::SameLine(column);
    ImGui::SetNextItemWidth(-FLT_MIN);
}

bool slider(const char* name, int& value, int lower, int upper, const char* help, ImGuiSliderFlags flags,
            const char* format) {
    const Id id(name);
    label(name, help);
    const TypesByDoubleClick typed(value);
    const bool changed = ImGui::SliderInt("##slider", &value, lower, upper, format, flags) || typed.restores();
    tooltip(help);
    return changed;
}

bool slider(const char* name, float& value, float lower, float upper, const char* format, const char* help,
            ImGuiSliderFlags flags) {
    const Id id(name);
    label(name, help);
    const TypesByDoubleClick typed(value);
    const bool changed = ImGui::SliderFloat("##slider", &value, lower, upper, format, flags) || typed.restores();
    tooltip(help);
    return changed;
}

bool slider(const char* name, double& value, double lower, double upper, const char* format, const char* help) {
    auto shown = static_cast<float>(value);
    if (!slider(name, shown, static_cast<float>(lower), static_cast<float>(upper), format, help)) return false;
    value = short_number(shown);
    return true;
}

bool slider(const char* name, const char* setting_name, int& value) {
    const Setting& s = setting(setting_name);
    return slider(name, value, static_cast<int>(s.slider_from), static_cast<int>(s.slider_to), s.help);
}

bool slider(const char* name, const char* setting_name, float& value, const char* format, ImGuiSliderFlags flags) {
    const Setting& s = setting(setting_name);
    return slider(name, value, static_cast<float>(s.slider_from), static_cast<float>(s.slider_to), format, s.help,
                  flags);
}

bool wants_state_before_click() {
    return std::exchange(restored, false);
}

bool checkbox(const char* name, bool& value, const char* help, const Constraint* against) {
    ImGui::BeginDisabled(against);
    const bool changed = ImGui::Checkbox(name, &value);
    ImGui::EndDisabled();
    tooltip(against ? against->text().c_str() : help);
    return changed;
}

bool drag(const char* name, dvec3& value, float speed, const char* help) {
    const Id id(name);
    constexpr const char* kAxes[] = {"X", "Y", "Z"};
    bool changed = false;
    ImGui::TextUnformatted(name);
    tooltip(help);
    for (int axis = 0; axis < 3; ++axis) {
        const Id own(kAxes[axis]);
        label(kAxes[axis], help);
        changed |= ImGui::DragScalar("##drag", ImGuiDataType_Double, &value[axis], speed, nullptr, nullptr, "%.4g");
    }
    return changed;
}

bool choose(const char* name, std::string& chosen, std::span<const std::string> all, const char* help) {
    const Id id(name);
    label(name, help);
    bool changed = false;
    const float width =
        ImGui::GetContentRegionAvail().x - ImGui::GetFrameHeight() - 2 * ImGui::GetStyle().FramePadding.x;
    if (ImGui::BeginCombo("##combo", shortened(chosen, width).c_str(), ImGuiComboFlags_HeightLarge)) {
        for (const std::string& one : all) {
            if (!ImGui::Selectable(one.c_str(), one == chosen)) continue;
            changed = one != chosen;
            chosen = one;
        }
        close_by_escape();
        ImGui::EndCombo();
    } else {
        tooltip(help);
    }
    return changed;
}

bool pick_color(const char* name, vec3& linear, const char* help) {
    constexpr float kGamma = 2.2f;
    const Id id(name);
    label(name, help);
    vec3 shown = glm::pow(linear, vec3(1 / kGamma));
    const bool changed =
        ImGui::ColorEdit3("##color", &shown.r, ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_NoOptions);
    tooltip(help);
    {
        const Id edit("##color");
        if (ImGui::BeginPopup("picker")) {                         // the picker that ColorEdit3() opens
            if (!ImGui::GetIO().WantTextInput) close_by_escape();  // Escape ends typing first
            ImGui::EndPopup();
        }
    }
    if (changed) linear = glm::pow(glm::clamp(shown, 0.0f, 1.0f), vec3(kGamma));
    return changed;
}

bool button(const char* name, const char* help, bool same_line) {
    const float frame = 2 * ImGui::GetStyle().FramePadding.x;
    if (same_line) beside(ImGui::CalcTextSize(name, nullptr, true).x + frame);
    const std::string shown = shortened(name, ImGui::GetContentRegionAvail().x - frame);
    const bool cut = shown != name;
    const Id id(cut ? name : "");
    const bool clicked = ImGui::Button(shown.c_str());
    tooltip(cut ? fmt::format("{}: {}", name, help).c_str() : help);
    return clicked;
}

bool foldable(const std::string& title, bool open) {
    const Id id(title.c_str());
    const std::string shown = shortened(title, ImGui::GetContentRegionAvail().x - 2.5f * ImGui::GetFontSize());
    const bool is_open =
        ImGui::CollapsingHeader((shown + "###header").c_str(), open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    if (shown != title) tooltip(title.c_str());
    return is_open;
}

bool radio(const char* name, bool on, const char* help, bool same_line) {
    if (same_line)
        beside(ImGui::CalcTextSize(name, nullptr, true).x + ImGui::GetFrameHeight() +
               ImGui::GetStyle().ItemInnerSpacing.x);
    const bool clicked = ImGui::RadioButton(name, on);
    tooltip(help);
    return clicked;
}

}  // namespace halflight::view
