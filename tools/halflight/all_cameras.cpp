#include "tools/halflight/all_cameras.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>

#include "engine/io/gltf/gltf.h"
#include "engine/io/gltf/parts.h"
#include "tools/halflight/render_options.h"

namespace halflight {
namespace {

/// Returns words for file names, one for each camera.
std::vector<std::string> words_for(const std::vector<Camera>& cameras) {
    std::vector<std::string> words;
    std::set<std::string> taken;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        std::string word = cameras[i].name;
        for (char& c : word)
            if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
        if (word.empty() || !taken.insert(word).second) word += fmt::format("-{}", i);
        taken.insert(word);
        words.push_back(word);
    }
    return words;
}

std::filesystem::path named(const std::filesystem::path& path, const std::string& camera) {
    constexpr std::string_view kPlace = "{camera}";
    std::string text = path.string();
    const std::size_t at = text.find(kPlace);
    if (at != std::string::npos) return text.replace(at, kPlace.size(), camera);
    std::string name = path.filename().string();
    return path.parent_path() / name.insert(std::min(name.find('.', 1), name.size()), "." + camera);
}

}  // namespace

std::vector<RenderArguments> arguments_by_camera(const RenderArguments& a) {
    if (a.look_from || a.pose || a.camera != "all") return {a};
    if (is_part_list(a.scene)) throw Error("--camera", "all needs a single file, not a list of files");
    const std::vector<Camera> cameras = GltfScene(a.scene, gltf_options(a)).cameras_at(0, {});
    if (std::ranges::find(cameras, "all", &Camera::name) != cameras.end()) return {a};
    if (cameras.empty()) throw Error(a.scene.string(), "has no cameras, which --camera all would render");
    const std::vector<std::string> words = words_for(cameras);
    std::vector<RenderArguments> each;
    std::set<std::filesystem::path> written;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        RenderArguments& one = each.emplace_back(a);
        // A number would find another camera that has it as its name, since names come first.
        const auto first = std::ranges::find(cameras, cameras[i].name, &Camera::name);
        one.camera = first == cameras.begin() + std::ptrdiff_t(i) ? cameras[i].name : std::to_string(i);
        const auto take = [&](std::filesystem::path& path) {
            path = named(path, words[i]);
            if (!written.insert(path.lexically_normal()).second)
                throw Error(path.string(), "would be written for two cameras or outputs");
        };
        for (std::filesystem::path& output : one.outputs) take(output);
        for (auto* file : {&one.movie, &one.stats, &one.graph})
            if (*file) take(**file);
        check_render_files(one);
    }
    return each;
}

}  // namespace halflight
