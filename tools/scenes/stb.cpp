// The one place where stb's single-header library is compiled: its PNGs are the same bytes whichever zlib a machine
// has, as the scenes that hold them must be.
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
