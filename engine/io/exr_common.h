// Code that reader and writer of OpenEXR files share: streams over our files, camera spaces of the standard.
#pragma once

#include <ImfIO.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "engine/core/math.h"
#include "engine/io/files.h"

namespace halflight {

/// Returns the number of worker threads; starts OpenEXR's pool on first use. The number does not affect the bytes
/// written. Throws Error in a process that was forked after the first use.
int exr_threads();

/// Returns the matrix from the engine's camera space, looking along -Z, to the standard's, looking along +Z; its own
/// inverse.
dmat4 exr_camera_from_camera();
/// Returns the matrix from OpenGL clip space to the standard's NDC: x and y in [0, 1], y down.
dmat4 exr_ndc_from_clip();

/// Stream over bytes in memory; reading beyond their end throws OpenEXR's usual exception.
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

/// A file that remembers failed writes, because OpenEXR's destructors write, too, and swallow exceptions.
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
