// Error handling of libpng, whose error callbacks must not return: between setjmp and the jump nothing may have a
// destructor.
#pragma once

#include <png.h>

#include <csetjmp>
#include <cstring>

namespace halflight {

/// Base of owners of a png_struct: stores libpng's message and jumps back. The png_struct is created with `errors()` as
/// error pointer, `fail` and `ignore`.
class PngErrors {
  public:
    PngErrors() = default;
    PngErrors(const PngErrors&) = delete;
    PngErrors& operator=(const PngErrors&) = delete;

    /// Returns the reason why the last call failed.
    const char* message() const { return message_; }

  protected:
    ~PngErrors() = default;

    PngErrors* errors() { return this; }
    [[noreturn]] static void fail(png_structp png, png_const_charp message) {
        auto& self = *static_cast<PngErrors*>(png_get_error_ptr(png));
        std::strncpy(self.message_, message, sizeof self.message_ - 1);
        png_longjmp(png, 1);
    }
    static void ignore(png_structp, png_const_charp) {}  // Ignores a warning.

  private:
    char message_[256] = {};
};

}  // namespace halflight
