// The programs' allocator is jemalloc, which serves the driver, too.
#include <jemalloc/jemalloc.h>

// A picture's buffers are large, and drivers that render on the processor clear them. Page faults of 4 KiB took half of
// the time to the first picture, hence pages of 2 MiB (thp). Blocks of any size are kept for the next picture
// (oversize_threshold). Few arenas keep less memory.
const char* malloc_conf = "thp:always,oversize_threshold:0,narenas:4";
