#include "tools/view/fonts.h"

#include <string>
#include <system_error>

namespace halflight::view {
namespace {

// Places below a folder of fonts, as distributions choose them.
constexpr const char* kFiles[] = {
    "truetype/dejavu/DejaVuSans.ttf", "dejavu-sans-fonts/DejaVuSans.ttf",   "TTF/DejaVuSans.ttf",
    "dejavu/DejaVuSans.ttf",          "truetype/noto/NotoSans-Regular.ttf", "google-noto/NotoSans-Regular.ttf",
    "noto/NotoSans-Regular.ttf",
};

}  // namespace

std::optional<std::filesystem::path> find_font(std::string_view data_dirs) {
    const std::string_view all = data_dirs.empty() ? "/usr/local/share:/usr/share" : data_dirs;
    for (const char* file : kFiles) {
        for (std::size_t from = 0; from <= all.size();) {
            const std::size_t to = std::min(all.find(':', from), all.size());
            const std::filesystem::path path = std::filesystem::path(all.substr(from, to - from)) / "fonts" / file;
            std::error_code none;
            if (std::filesystem::is_regular_file(path, none)) return path;
            from = to + 1;
        }
    }
    return std::nullopt;
}

}  // namespace halflight::view
