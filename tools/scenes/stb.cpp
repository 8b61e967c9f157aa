// Compiles stb's single-header library. Its PNGs have the same bytes whichever zlib a machine has, as committed scenes
// require.
#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
