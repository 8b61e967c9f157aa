// What the reader and the writer of OpenEXR files share: streams over our files, the standard's camera spaces.
#pragma once

#include <ImfIO.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/core/math.h"
#include "engine/io/files.h"

namespace halflight {

/// Number of worker threads, after starting OpenEXR's pool on first use. It never changes what is written.
int exr_threads();

/// The engine's camera space, looking along -Z, to the standard's, looking along +Z; its own inverse.
dmat4 exr_camera_from_camera();
/// OpenGL clip space to the standard's NDC: x and y in [0, 1], y down.
dmat4 exr_ndc_from_clip();

/// Bytes in memory; reading past their end is OpenEXR's usual exception.
class ExrInput : public Imf::IStream {
  public:
    ExrInput(const std::string& name, std::string_view bytes) : IStream(name.c_str()), bytes_(bytes) {}
    bool read(char* out, int count) override;
    std::uint64_t tellg() override { return position_; }
    void seekg(std::uint64_t position) override { position_ = position; }

  private:
    std::string_view bytes_;
    std::uint64_t position_ = 0;
};

/// A file that remembers failed writes: OpenEXR's destructors write too, and swallow what they throw.
class ExrOutput : public Imf::OStream {
  public:
    ExrOutput(const std::filesystem::path& existing, const std::string& subject)
        : OStream(subject.c_str()), file_(existing, subject) {}
    void write(const char* bytes, int count) override { file_.write(bytes, static_cast<std::size_t>(count)); }
    std::uint64_t tellp() override { return file_.tell(); }
    void seekp(std::uint64_t position) override { file_.seek(position); }
    void close() { file_.close(); }

  private:
    CheckedFile file_;
};

}  // namespace halflight
