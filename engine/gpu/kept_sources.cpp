#include "engine/gpu/kept_sources.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <system_error>

#include "engine/core/error.h"
#include "engine/core/hash.h"
#include "engine/gpu/shader_source.h"

namespace halflight::gpu {
namespace {

namespace fs = std::filesystem;

/// Writes a file under another name first, because several processes may keep the same source at once.
void write(const fs::path& folder, const std::string& name, std::string_view text) {
    static std::atomic<unsigned> count{0};
    const fs::path temporary = folder / fmt::format(".{}.{}.{}", name, ::getpid(), ++count);
    std::error_code error;
    fs::create_directories(folder, error);
    std::ofstream stream(temporary, std::ios::binary);
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    stream.close();
    if (stream) fs::rename(temporary, folder / name, error);
    if (!stream || error) {
        fs::remove(temporary, error);
        throw Error(folder.string(), "'{}' cannot be written (HALFLIGHT_SHADER_SOURCES)", name);
    }
}

}  // namespace

void keep_sources(std::string_view program,
                  std::initializer_list<std::pair<std::string_view, std::string_view>> stages) {
    const char* const folder = std::getenv("HALFLIGHT_SHADER_SOURCES");
    if (folder == nullptr || *folder == '\0') return;
    std::string name(program);
    std::ranges::replace_if(name, std::not_fn(in_identifier), '-');
    Hash hash;
    for (const auto& [extension, text] : stages) hash.add_bytes(text.data(), text.size());
    for (const auto& [extension, text] : stages)
        write(folder, fmt::format("{}-{:016x}.{}", name, hash.value(), extension), text);
}

}  // namespace halflight::gpu
