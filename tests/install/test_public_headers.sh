#!/usr/bin/env bash
# test_public_headers.sh COMPILER SOURCE_FOLDER: fails if <halflight/halflight.h> includes a header of OpenGL.
set -euo pipefail
headers=$(echo '#include <halflight/halflight.h>' |
    "$1" -std=c++20 -I "$2" -I "$2/api" $(pkg-config --cflags epoxy egl) -x c++ -E -M -)
grep -q 'api/halflight/frame_renderer\.h' <<<"$headers" # the list is that of our headers
if grep -E -o '[^ ]*(epoxy|/GL/|/EGL/|/GLES)[^ ]*' <<<"$headers"; then
    echo "halflight.h reaches headers of OpenGL" >&2
    exit 1
fi
