// The one place where stb's single-header library is compiled. Memory only: files are written by files.h.
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
