// Frees the cells that no picture has used for long.
#include "shaders/shared/cache_cells.h"

layout(local_size_x = 64) in;

layout(std430) buffer Cells { CacheCell cells[]; };

uniform uint picture;  // number of the picture that begins, as in CacheCell::used
uniform uint oldest;   // greatest age of a cell that is kept, pictures

void main() {
    uint cell = gl_GlobalInvocationID.x;
    uint age = picture - cells[cell].used;
    bool old = cells[cell].key != 0u && (cells[cell].count == 0u || age > oldest);
    // A loop without iterations costs nothing, unlike a branch not taken.
    for (uint turn = 0u; turn < (old ? 1u : 0u); ++turn)
        cells[cell] = CacheCell(0u, 0u, 0u, uint[](0u, 0u, 0u), uint[](0u, 0u, 0u));
}
