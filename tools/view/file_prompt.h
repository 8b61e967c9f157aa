// The dialog that asks for a file.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/folder_listing.h"

namespace halflight::view {

/// A modal dialog: the files of a folder that suit its purpose, and a field for a name. It stays open, with a message,
/// if the name finds no file. Files to save may be new; existing ones are replaced once they are named twice,
/// and names without an extension get the usual one.
class FilePrompt {
  public:
    enum class Purpose { open, environment, profile, compare, save, picture };
    /// Opens the dialog. It shows the folder that it has shown last for the purpose, at first `first`, and `name`.
    /// note: what the user should know about the file.
    void ask(Purpose purpose, const std::filesystem::path& first, const std::string& name = "",
             const std::string& note = "");
    /// Opens the dialog for a settings file that another program has changed. The user may replace it, or choose
    /// another name.
    void ask_to_replace(const std::filesystem::path& file);
    struct Answer {
        Purpose purpose;
        std::filesystem::path file;
        bool all_layers = false;  // a picture takes all layers, not only the one shown
    };
    bool asking() const { return asking_; }
    /// Declares the dialog; returns the file once the user has chosen it.
    std::optional<Answer> declare();

  private:
    void enter(const std::filesystem::path& path);
    std::filesystem::path& folder() { return folders_[static_cast<std::size_t>(purpose_)]; }
    void set_name(const std::string& name);
    void list_entries(std::string& taken);
    std::optional<std::filesystem::path> take(const std::string& name);

    Purpose purpose_ = Purpose::open;
    bool asked_ = false;                            // the dialog must be opened
    bool asking_ = false;                           // the dialog is open, or must be opened
    std::array<std::filesystem::path, 6> folders_;  // last folder of each purpose, absolute; empty: none yet
    std::vector<FolderEntry> entries_;
    std::string note_;
    bool all_layers_ = false;
    std::string proposed_;  // name that the field shows in each folder
    std::array<char, 4096> name_{};
    std::string problem_;               // why the last name was not taken; empty: it was
    std::filesystem::path to_replace_;  // existing file that is replaced if the user takes its name again; empty: none
};

}  // namespace halflight::view
