#include "tools/view/file_prompt.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "api/halflight/picture_file.h"
#include "engine/core/error.h"
#include "tools/view/keys.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr std::array<std::string_view, 4> kScenes = {"glb", "gltf", "exr", "hdr"};
constexpr std::array<std::string_view, 2> kEnvironments = {"exr", "hdr"};
constexpr std::array<std::string_view, 1> kProfiles = {"ies"};
constexpr std::array<std::string_view, 2> kPictures = {"exr", "png"};
constexpr std::array<std::string_view, 1> kSettings = {"json"};

struct PurposeRow {
    const char* title;
    const char* files;  // which files the dialog shows
    const char* verb;   // label of the button that takes the name
    std::span<const std::string_view> extensions;
};

const PurposeRow& row_of(FilePrompt::Purpose purpose) {
    static constexpr PurposeRow kRows[] = {
        {"Open a scene or an environment", "scenes .glb, .gltf; environments .exr, .hdr", "Open", kScenes},
        {"Choose an environment", "environments .exr, .hdr", "Open", kEnvironments},
        {"Choose a light profile", "profiles .ies", "Open", kProfiles},
        {"Compare with a picture", "pictures .exr, .png", "Open", kPictures},
        {"Save settings as", "settings .json", "Save", kSettings},
        {"Save the picture as", "pictures .exr, .png", "Save", kPictures}};
    return kRows[static_cast<std::size_t>(purpose)];
}

}  // namespace

void FilePrompt::ask(Purpose purpose, const std::filesystem::path& first, const std::string& name,
                     const std::string& note) {
    note_ = note;
    purpose_ = purpose;
    asked_ = asking_ = true;
    problem_.clear();
    to_replace_.clear();
    std::error_code unknown;
    proposed_ = name;
    set_name(name);
    enter(folder().empty() ? std::filesystem::absolute(first.empty() ? "." : first, unknown) : folder());
}

void FilePrompt::ask_to_replace(const std::filesystem::path& file) {
    std::error_code unknown;
    folders_[static_cast<std::size_t>(Purpose::save)] = std::filesystem::absolute(file, unknown).parent_path();
    ask(Purpose::save, "", file.filename().string());
    to_replace_ = typed_path(folder(), name_.data());
    problem_ = fmt::format("Another program has changed {}; Save replaces it", file.string());
}

void FilePrompt::enter(const std::filesystem::path& path) {
    try {
        entries_ = list_folder(path, row_of(purpose_).extensions);
        problem_.clear();
        set_name(proposed_);
        folder() = path.lexically_normal();
        if (!folder().has_filename() && folder().has_relative_path()) folder() = folder().parent_path();
    } catch (const Error& error) {
        problem_ = error.what();
    }
}

void FilePrompt::set_name(const std::string& name) {
    name_ = {};
    std::ranges::copy_n(name.begin(), std::min(std::ssize(name), std::ssize(name_) - 1), name_.begin());
}

/// Enters the folder of that name, or returns the file.
std::optional<std::filesystem::path> FilePrompt::take(const std::string& name) {
    if (name.empty()) return std::nullopt;
    std::filesystem::path path = typed_path(folder(), name);
    std::error_code unknown;
    if (std::filesystem::is_directory(path, unknown)) {
        enter(path);
        return std::nullopt;
    }
    const bool saves = purpose_ == Purpose::save || purpose_ == Purpose::picture;
    const auto known = [&](std::string_view extension) { return has_extension(path, std::string(extension).c_str()); };
    if (saves && std::ranges::none_of(row_of(purpose_).extensions, known))
        path += purpose_ == Purpose::save ? ".json" : ".png";
    const bool exists = std::filesystem::exists(path, unknown);
    if (saves ? !exists || path == to_replace_ : exists) return path;
    problem_ = saves ? fmt::format("{} exists; Save replaces it", path.string())
                     : fmt::format("There is no file {}", path.string());
    to_replace_ = path;
    return std::nullopt;
}

/// Lists folder and files. A click writes a name into the field, a double click takes it.
void FilePrompt::list_entries(std::string& taken) {
    const auto row = [&](const std::string& name, const std::string& shown) {
        const bool chosen = name == name_.data();
        if (!ImGui::Selectable(shortened(shown, ImGui::GetContentRegionAvail().x).c_str(), chosen,
                               ImGuiSelectableFlags_AllowDoubleClick | ImGuiSelectableFlags_DontClosePopups))
            return;
        set_name(name);
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) taken = name;
    };
    if (folder().has_relative_path()) row("..", "../");
    for (const FolderEntry& entry : entries_) {
        ImGui::PushID(entry.name.c_str());
        row(entry.name, entry.folder ? entry.name + "/" : entry.name);
        ImGui::PopID();
    }
    if (std::ranges::all_of(entries_, &FolderEntry::folder))
        faint_text(fmt::format("No files here ({}).", row_of(purpose_).files));
}

std::optional<FilePrompt::Answer> FilePrompt::declare() {
    const PurposeRow& row = row_of(purpose_);
    if (std::exchange(asked_, false)) ImGui::OpenPopup(row.title);
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    const float height = ImGui::GetFontSize();
    ImGui::SetNextWindowPos({window.x / 2, window.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({std::min(46 * height, window.x), std::min(32 * height, window.y)});
    asking_ = ImGui::BeginPopupModal(row.title, nullptr, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoSavedSettings);
    if (!asking_) return std::nullopt;
    std::string taken;
    ImGui::TextUnformatted(shortened(folder().string(), ImGui::GetContentRegionAvail().x).c_str());
    tooltip(folder().string().c_str());
    // Below the list: the field, two lines for a problem, which may wrap, and the buttons.
    const bool layers = purpose_ == Purpose::picture;
    const float below = (layers ? 3 : 2) * ImGui::GetFrameHeightWithSpacing() +
                        (2 + !note_.empty()) * ImGui::GetTextLineHeightWithSpacing();
    ImGui::BeginChild("files", {0, std::max(ImGui::GetContentRegionAvail().y - below, 3 * height)}, true);
    list_entries(taken);
    ImGui::EndChild();
    if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(-1);
    if (ImGui::InputTextWithHint("##name", "name of a file or folder", name_.data(), name_.size(),
                                 ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll)) {
        taken = name_.data();
        ImGui::SetKeyboardFocusHere(-1);  // the name of a folder opens it, and the user types the next name
    }
    if (layers) checkbox("All layers in an .exr", all_layers_, "adds the components and the data of each pixel");
    if (!note_.empty()) faint_text(note_);
    const float lines = ImGui::GetCursorPosY();
    if (problem_.empty())
        faint_text(row.files);
    else
        error_text(problem_);
    ImGui::SetCursorPosY(std::max(ImGui::GetCursorPosY(), lines + 2 * ImGui::GetTextLineHeightWithSpacing()));
    if (button(row.verb, "takes the file, or shows the folder (Enter)")) taken = name_.data();
    const bool cancelled = button("Cancel", "takes no file (Escape)", true) || key_pressed(ImGuiKey_Escape);
    const auto file = take(taken);
    if (file || cancelled) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
    if (!file) return std::nullopt;
    return Answer{purpose_, *file, layers && all_layers_};
}

}  // namespace halflight::view
