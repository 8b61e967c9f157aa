#!/usr/bin/env bash
# test_source_hash.sh CMAKE SOURCE: the hash of the sources changes with every source of pictures, its name included, and with
# nothing else.
set -euo pipefail

cmake=$1
source=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder"/tree/{engine/core,engine/reference,api/python,shaders/lib,tools,tests}
cd "$folder/tree"
for file in engine/core/a.cpp engine/core/a.h shaders/lib/b.glsl shaders/c.comp engine/reference/r.cpp api/python/p.cpp \
    engine/core/c.cpp.in engine/core/e.cmake engine/core/CMakeLists.txt tools/t.cpp tests/t.cpp; do
    echo "// $file" >$file
done
hash() {
    "$cmake" "-DROOT=$PWD" "-DOUTPUT=$folder/hash.cpp" "-DBUILD=$build" -P "$source/api/sequence/source_hash.cmake"
    sed -n 's/.*return "\([0-9a-f]\{16\}\)".*/\1/p' "$folder/hash.cpp"
}
build="a library 1.0"
first=$(hash)
[ ${#first} -eq 16 ] || { cat "$folder/hash.cpp"; exit 1; }
for file in engine/core/a.cpp engine/core/a.h shaders/lib/b.glsl shaders/c.comp engine/core/c.cpp.in engine/core/e.cmake \
    engine/core/CMakeLists.txt; do
    echo more >>$file
    now=$(hash)
    [ "$now" != "$first" ] || { echo "$file changes nothing"; exit 1; }
    first=$now
done
build="a library 1.1"
[ "$(hash)" != "$first" ] || { echo "a version changes nothing"; exit 1; }
first=$(hash)
mv shaders/c.comp shaders/d.comp
[ "$(hash)" != "$first" ] || { echo "a name changes nothing"; exit 1; }
first=$(hash)
for file in engine/reference/r.cpp api/python/p.cpp tools/t.cpp tests/t.cpp; do echo more >>$file; done
[ "$(hash)" = "$first" ] || { echo "a source without an effect on pictures changes the hash"; exit 1; }
