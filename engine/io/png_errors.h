// libpng reports errors by calls that must not return: nothing between setjmp and the jump may have a destructor.
#pragma once

#include <png.h>

#include <csetjmp>
#include <cstring>

namespace halflight {

/// Base of what owns a png_struct: keeps what libpng says, and jumps back. Made with `errors()` as error pointer,
/// `fail` and `ignore`.
class PngErrors {
  public:
    PngErrors() = default;
    PngErrors(const PngErrors&) = delete;
    PngErrors& operator=(const PngErrors&) = delete;

    /// Why the last call failed.
    const char* message() const { return message_; }

  protected:
    ~PngErrors() = default;

    PngErrors* errors() { return this; }
    [[noreturn]] static void fail(png_structp png, png_const_charp message) {
        auto& self = *static_cast<PngErrors*>(png_get_error_ptr(png));
        std::strncpy(self.message_, message, sizeof self.message_ - 1);
        png_longjmp(png, 1);
    }
    static void ignore(png_structp, png_const_charp) {}  // warnings

  private:
    char message_[256] = {};
};

}  // namespace halflight
