// The one place where stb's single-header libraries are compiled. Memory only: files are read and written by files.h.
// Decoders for what glTF allows, PNG and JPEG, and none that files from elsewhere could reach besides.
#define STBI_NO_STDIO
#define STBI_ONLY_JPEG
#define STBI_ONLY_PNG
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>
