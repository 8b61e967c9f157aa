#include "tools/view/gui.h"

#include <backends/imgui_impl_opengl3.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "engine/core/error.h"
#include "tools/view/clock.h"
#include "tools/view/fonts.h"
#include "tools/view/keys.h"

namespace halflight::view {
namespace {

constexpr float kTextHeight = 14;     // height of text at scale 1, pixels
constexpr float kDefaultHeight = 13;  // height of Dear ImGui's own font, which is made of pixels
constexpr float kSideWidth = 25;      // width of the side bar, heights of text

// Latin with its extensions, Greek, Cyrillic, punctuation, arrows: names in scenes.
constexpr ImWchar kGlyphs[] = {0x20, 0x24f, 0x370, 0x52f, 0x2010, 0x2030, 0x2190, 0x2199, 0};

const char* clipboard(void* window) {
    return glfwGetClipboardString(static_cast<GLFWwindow*>(window));
}
void set_clipboard(void* window, const char* text) {
    glfwSetClipboardString(static_cast<GLFWwindow*>(window), text);
}

/// Returns the name of a key for KeyPress; empty for keys that actions do not use. signs: names keys by their signs.
std::string name_of(const InputEvent& e, bool signs) {
    if (e.symbol != 0) return signs ? std::string{e.symbol} : "";
    if (e.code >= GLFW_KEY_F1 && e.code <= GLFW_KEY_F25) return fmt::format("F{}", e.code - GLFW_KEY_F1 + 1);
    switch (e.code) {
        case GLFW_KEY_SPACE:
            return "Space";
        case GLFW_KEY_DELETE:
            return "Delete";
        case GLFW_KEY_HOME:
            return "Home";
        case GLFW_KEY_ESCAPE:
            return "Escape";
        default:
            return "";
    }
}

}  // namespace

Gui::Gui(Window& window, std::optional<double> scale) : window_(window), clock_(now()) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // Dear ImGui writes no settings file
    io.BackendFlags |= ImGuiBackendFlags_HasMouseCursors;
    io.GetClipboardTextFn = clipboard;
    io.SetClipboardTextFn = set_clipboard;
    io.ClipboardUserData = window.handle();
    use_glfw_keys();
    cursors_.resize(ImGuiMouseCursor_COUNT);
    for (const auto& [ours, glfw] : {std::pair{ImGuiMouseCursor_TextInput, GLFW_IBEAM_CURSOR},
                                     {ImGuiMouseCursor_ResizeNS, GLFW_VRESIZE_CURSOR},
                                     {ImGuiMouseCursor_ResizeEW, GLFW_HRESIZE_CURSOR},
                                     {ImGuiMouseCursor_Hand, GLFW_HAND_CURSOR}})
        cursors_[static_cast<std::size_t>(ours)] = glfwCreateStandardCursor(glfw);
    set_scale(static_cast<float>(scale.value_or(window.monitor_scale())));
    if (!ImGui_ImplOpenGL3_Init("#version 450 core")) {
        ImGui::DestroyContext();
        throw Error("window", "Dear ImGui cannot use this OpenGL context");
    }
    load_font();
}

Gui::~Gui() {
    for (GLFWcursor* cursor : cursors_)
        if (cursor) glfwDestroyCursor(cursor);
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
}

void Gui::set_scale(float scale) {
    scale = std::clamp(scale, kLeastUiScale, kMostUiScale);
    scale_changed_ |= scale != scale_;
    scale_ = scale;
}

void Gui::load_font() {
    ImGuiIO& io = ImGui::GetIO();
    io.Fonts->Clear();
    const char* folders = std::getenv("XDG_DATA_DIRS");
    const auto file = find_font(folders ? folders : "");
    ImFont* font = nullptr;
    if (file) font = io.Fonts->AddFontFromFileTTF(file->c_str(), std::round(kTextHeight * scale_), nullptr, kGlyphs);
    has_font_ = font != nullptr;
    if (!font) {
        ImFontConfig config;
        config.SizePixels = std::round(kDefaultHeight * scale_);
        io.Fonts->AddFontDefault(&config);
    }
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    style.WindowRounding = 0;
    style.FrameRounding = 3;
    style.GrabMinSize = 12;
    // The number of a slider is drawn over its grab, which must be dark enough for it.
    style.Colors[ImGuiCol_SliderGrab] = {0.20f, 0.40f, 0.70f, 1};
    style.Colors[ImGuiCol_SliderGrabActive] = {0.24f, 0.47f, 0.82f, 1};
    // Keys of menus are disabled text, also on the entry under the mouse.
    style.Colors[ImGuiCol_HeaderHovered] = style.Colors[ImGuiCol_SliderGrab];
    style.Colors[ImGuiCol_TextDisabled] = {0.62f, 0.62f, 0.62f, 1};
    style.Colors[ImGuiCol_WindowBg] = {0.11f, 0.11f, 0.12f, 1};
    style.Colors[ImGuiCol_PopupBg] = {0.14f, 0.14f, 0.15f, 1};
    style.Colors[ImGuiCol_ModalWindowDimBg] = {0, 0, 0, 0.55f};
    style.ScaleAllSizes(scale_);
    ImGui::GetStyle() = style;
#if IMGUI_VERSION_NUM < 19200  // since then NewFrame() makes the texture from the new font
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    ImGui_ImplOpenGL3_CreateFontsTexture();
#endif
    scale_changed_ = false;
}

void Gui::take(const InputEvent& e) {
    ImGuiIO& io = ImGui::GetIO();
    switch (e.kind) {
        case InputEvent::Kind::key:
            if (e.code < 0 || e.code >= static_cast<int>(held_.size())) break;
            held_.set(static_cast<std::size_t>(e.code), e.down);
            if (e.down) with_ctrl_.set(static_cast<std::size_t>(e.code), (e.modifiers & GLFW_MOD_CONTROL) != 0);
            // The event tells which modifiers were held before it.
            tell_key(e.code, e.down,
                     {.ctrl = held_[GLFW_KEY_LEFT_CONTROL] || held_[GLFW_KEY_RIGHT_CONTROL],
                      .shift = held_[GLFW_KEY_LEFT_SHIFT] || held_[GLFW_KEY_RIGHT_SHIFT],
                      .alt = held_[GLFW_KEY_LEFT_ALT] || held_[GLFW_KEY_RIGHT_ALT],
                      .super = held_[GLFW_KEY_LEFT_SUPER] || held_[GLFW_KEY_RIGHT_SUPER]});
            break;
        case InputEvent::Kind::letter:
            io.AddInputCharacter(e.letter);
            break;
        case InputEvent::Kind::button:
            if (e.code >= 0 && e.code < ImGuiMouseButton_COUNT) io.MouseDown[e.code] = e.down;
            break;
        case InputEvent::Kind::wheel:
            io.MouseWheelH += static_cast<float>(e.value.x);
            io.MouseWheel += static_cast<float>(e.value.y);
            break;
        case InputEvent::Kind::position:
            io.MousePos = {static_cast<float>(e.value.x), static_cast<float>(e.value.y)};
            break;
        case InputEvent::Kind::focus:
            io.AddFocusEvent(e.down);
            if (e.down) break;
            io.ClearInputKeys();
            held_.reset();
            std::ranges::fill(io.MouseDown, false);
            break;
    }
}

void Gui::show_cursor() {
    if (ImGui::GetIO().ConfigFlags & ImGuiConfigFlags_NoMouseCursorChange) return;
    const int shape = ImGui::GetMouseCursor();
    glfwSetCursor(window_.handle(), shape < 0 ? nullptr : cursors_[static_cast<std::size_t>(shape)]);
}

void Gui::begin() {
    if (scale_changed_) load_font();
    ImGuiIO& io = ImGui::GetIO();
    const ivec2 size = window_.framebuffer_size();
    io.DisplaySize = {static_cast<float>(size.x), static_cast<float>(size.y)};
    events_ = window_.events().take();
    for (const InputEvent& event : events_) take(event);
    // Frames for events that have waited pass in the time of the events, so that double clicks stay double clicks.
    const double time = pending() && !events_.empty() ? events_.back().time : now();
    io.DeltaTime = static_cast<float>(std::max(time - clock_, 1e-5));
    clock_ = std::max(time, clock_);
    ImGui_ImplOpenGL3_NewFrame();
    show_cursor();
    ImGui::NewFrame();
    for (const bool clicked : io.MouseClicked) clicks_ += clicked ? 1 : 0;
}

void Gui::skip() {
    ImGui::EndFrame();
}

void Gui::draw() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

Input Gui::input(const WindowLayout& layout, const ivec2& picture) const {
    const ImGuiIO& io = ImGui::GetIO();
    Input in;
    in.seconds = double{io.DeltaTime};
    in.fast = io.KeyShift;
    if (!io.WantCaptureMouse) {
        // Movement in the frame of a press happened before the press.
        const bool pressed = ImGui::IsMouseClicked(ImGuiMouseButton_Left) ||
                             ImGui::IsMouseClicked(ImGuiMouseButton_Middle) ||
                             ImGui::IsMouseClicked(ImGuiMouseButton_Right);
        if (!pressed) in.drag = dvec2(io.MouseDelta.x, io.MouseDelta.y) / double(std::max(layout.picture.size.y, 1));
        in.left = ImGui::IsMouseDown(ImGuiMouseButton_Left);
        in.middle = ImGui::IsMouseDown(ImGuiMouseButton_Middle);
        in.right = ImGui::IsMouseDown(ImGuiMouseButton_Right);
        in.shift = io.KeyShift;
        in.wheel = double{io.MouseWheel};
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left) && layout.picture.contains(mouse()))
            in.double_click = picture_point(layout, picture, mouse());
    }
    if (!io.WantTextInput && !io.KeyCtrl) {
        // A key that was tapped between two frames counts, too.
        const auto held = [&](int key) {
            if (with_ctrl_.test(static_cast<std::size_t>(key))) return false;  // Ctrl may be released first
            return held_.test(static_cast<std::size_t>(key)) || std::ranges::any_of(events_, [&](const InputEvent& e) {
                       return e.kind == InputEvent::Kind::key && e.code == key && !e.down;
                   });
        };
        const auto axis = [&](int more, int less) { return (held(more) ? 1.0 : 0.0) - (held(less) ? 1.0 : 0.0); };
        in.movement = {axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S)};
    }
    return in;
}

std::vector<KeyPress> Gui::pressed() const {
    std::vector<KeyPress> all;
    if (ImGui::GetIO().WantTextInput) return all;
    for (const InputEvent& e : events_) {
        if (!e.down) continue;
        const bool ctrl = (e.modifiers & GLFW_MOD_CONTROL) != 0;
        if (e.kind == InputEvent::Kind::key) {
            // Without Ctrl, a key with a sign on it comes as a letter, too.
            std::string key = name_of(e, ctrl);
            if (!key.empty()) all.push_back({std::move(key), ctrl, (e.modifiers & GLFW_MOD_SHIFT) != 0});
        } else if (e.kind == InputEvent::Kind::letter && e.letter > ' ' && e.letter < 0x7f) {
            all.push_back({{static_cast<char>(std::toupper(static_cast<int>(e.letter)))}});
        }
    }
    return all;
}

dvec2 Gui::mouse() const {
    const ImGuiIO& io = ImGui::GetIO();
    return {io.MousePos.x, io.MousePos.y};
}

std::optional<double> Gui::event_time() const {
    if (events_.empty()) return std::nullopt;
    return events_.front().time;
}

float Gui::text_height() const {
    return std::round((has_font_ ? kTextHeight : kDefaultHeight) * scale_);
}

Parts Gui::parts() const {
    const ImGuiStyle& style = ImGui::GetStyle();
    const float height = text_height();
    return {.menu = static_cast<int>(std::ceil(height + 2 * style.FramePadding.y)),
            .status = static_cast<int>(std::ceil(height + 2 * style.FramePadding.y + 2 * scale_)),
            .side = static_cast<int>(std::ceil(kSideWidth * height))};
}

}  // namespace halflight::view
