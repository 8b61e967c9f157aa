#include "tests/fuzz/memory_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "tests/fuzz/targets.h"

namespace halflight::fuzz {

MemoryFile::MemoryFile(std::string_view bytes) : descriptor_(memfd_create("input", MFD_CLOEXEC)) {
    if (descriptor_ < 0 || write(descriptor_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
        throw std::system_error(errno, std::generic_category(), "memory file");
    path_ = fmt::format("/proc/self/fd/{}", descriptor_);
}

MemoryFile::~MemoryFile() {
    close(descriptor_);
}

void check_message(const Error& error, std::string_view subject) {
    const std::string_view message = error.what();
    const auto control = [](unsigned char c) { return c < ' ' || c == 0x7f; };
    if (!message.starts_with(subject) || message.size() == subject.size() || std::ranges::any_of(message, control))
        throw Broken(fmt::format("not one line about {}: '{}'", subject, message));
}

}  // namespace halflight::fuzz
