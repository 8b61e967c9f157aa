#include "tools/halflight/all_cameras.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>

#include "api/halflight/camera.h"
#include "engine/io/gltf/gltf.h"
#include "engine/io/gltf/parts.h"
#include "tools/halflight/render_options.h"

namespace halflight {
namespace {

/// Returns words for file names, one for each camera.
std::vector<std::string> words_for(const std::vector<Camera>& cameras) {
    std::vector<std::string> words;
    std::set<std::string> taken;
    constexpr std::size_t kMost = 150;  // bytes; names of files end at 255, with numbers of frames and endings
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        std::string word = cameras[i].name.substr(0, kMost);
        for (char& c : word)
            if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
        if (word.empty() || !taken.insert(word).second) word += fmt::format("-{}", i);
        taken.insert(word);
        words.push_back(word);
    }
    return words;
}

constexpr std::string_view kPlace = "{camera}";

/// Returns pointers to the names of all files whose names may hold that of the camera.
std::vector<std::filesystem::path*> files_of(RenderArguments& a) {
    std::vector<std::filesystem::path*> files;
    for (std::filesystem::path& output : a.outputs) files.push_back(&output);
    for (auto* file : {&a.movie, &a.stats, &a.graph})
        if (*file) files.push_back(&**file);
    return files;
}

std::filesystem::path named(const std::filesystem::path& path, const std::string& camera) {
    std::string text = path.string();
    const std::size_t at = text.find(kPlace);
    if (at != std::string::npos) return text.replace(at, kPlace.size(), camera);
    std::string name = path.filename().string();
    return path.parent_path() / name.insert(std::min(name.find('.', 1), name.size()), "." + camera);
}

}  // namespace

std::vector<RenderArguments> arguments_by_camera(const RenderArguments& a) {
    RenderArguments chosen = a;
    std::vector<std::filesystem::path*> placed = files_of(chosen);
    std::erase_if(placed, [](const auto* file) { return file->string().find(kPlace) == std::string::npos; });
    const bool free = a.view.look_from || a.view.pose;
    const bool all = !free && a.view.camera == "all";
    if (!all && placed.empty()) return {a};
    if (free) throw Error(placed[0]->string(), "{} stands for a camera of the scene, and the camera is free", kPlace);
    if (is_part_list(a.choice.scene))
        throw Error(all ? "--camera" : placed[0]->string(), "{} needs a single file, not a list of files",
                    all ? "all" : kPlace);
    Scene scene;
    scene.name = a.choice.scene.string();
    scene.cameras = GltfScene(a.choice.scene, gltf_options(a.choice)).cameras_at(0, {});
    const std::vector<Camera>& cameras = scene.cameras;
    if (cameras.empty())
        throw Error(a.choice.scene.string(), "has no cameras, which {} would {}", all ? "--camera all" : kPlace,
                    all ? "render" : "name");
    const std::vector<std::string> words = words_for(cameras);
    if (!all || std::ranges::find(cameras, "all", &Camera::name) != cameras.end()) {
        const std::optional<std::size_t> index = choose_camera(scene, a.view).index;
        chosen.view.replace_blind = false;  // the name says which camera it is
        for (std::filesystem::path* file : placed) *file = named(*file, index ? words[*index] : *a.view.camera);
        check_render_files(chosen);
        return {chosen};
    }
    std::vector<RenderArguments> each;
    std::set<std::filesystem::path> written;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        RenderArguments& one = each.emplace_back(a);
        // A number would find another camera that has it as its name, since names come first.
        const auto first = std::ranges::find(cameras, cameras[i].name, &Camera::name);
        one.view.camera = first == cameras.begin() + std::ptrdiff_t(i) ? cameras[i].name : std::to_string(i);
        for (std::filesystem::path* file : files_of(one)) {
            *file = named(*file, words[i]);
            if (!written.insert(file->lexically_normal()).second)
                throw Error(file->string(), "would be written for two cameras or outputs");
        }
        check_render_files(one);
    }
    return each;
}

}  // namespace halflight
