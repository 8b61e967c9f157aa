#!/usr/bin/env bash
# test_install.sh BUILD_FOLDER: installs the build into a temporary prefix, and renders from there in another folder with
# an empty environment. Then it builds a project that finds the library with find_package().
set -euo pipefail
build=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

cmake --install "$build" --prefix "$work/first" >/dev/null
mv "$work/first" "$work/prefix" # it must not know where it was installed to

cp -r "$here/../cli/room" room
env -i "$work/prefix/bin/halflight" render room/room.gltf a.exr a.png --width 16 --height 16 --samples 1
env -i "$work/prefix/bin/halflight" render --demo d.png --width 16 --samples 1
[ -s a.exr ] && [ -s a.png ] && [ -s d.png ]

cmake -S "$here/consumer" -B consumer -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix"
cmake --build consumer
env -i consumer/consumer room/room.gltf b.exr c.##.exr
[ -s b.exr ] && [ -s c.01.exr ] && [ -s c.02.exr ]
