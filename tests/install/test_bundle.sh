#!/usr/bin/env bash
# test_bundle.sh PROGRAM: bundles the program, moves the bundle from its archive, and renders with an empty environment.
set -euo pipefail
program=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() {
    echo "$*" >&2
    exit 1
}

XZ_OPT=-0 "$here/../../tools/bundle" --program "$program" --archive first
rm -r first
sha256sum --check first.tar.xz.sha256
tar -xf first.tar.xz
mv first "bundle, moved"
halflight="$work/bundle, moved/bin/halflight"

megabytes=$(du -sm "bundle, moved" | cut -f1)
[ "$megabytes" -lt 76 ] || fail "the bundle has $megabytes MiB"

# All libraries come from the bundle, except for the C library, the GL driver, and libraries shared with that driver.
allowed='^(linux-vdso|.*/ld-linux|lib(c|m|dl|rt|pthread|EGL|GLdispatch|stdc\+\+|gcc_s|z|expat|X11|xcb|Xau|Xdmcp|bsd|md)\.so)'
outside=$(env -i LD_TRACE_LOADED_OBJECTS=1 "$halflight" | grep -v 'bundle, moved' | awk '{print $1}' |
    grep -Ev "$allowed" || true)
[ -z "$outside" ] || fail "not in the bundle: $outside"
for library in lib/fallback/libstdc++.so.6 lib/fallback/libgcc_s.so.1 licences/halflight.txt; do
    [ -s "bundle, moved/$library" ] || fail "$library is missing"
done

cp -r "$here/../cli/room" room
env -i "$halflight" render room/room.gltf a.exr a.png --width 16 --height 16 --samples 1
env -i "$halflight" render --demo b.png --width 16 --samples 1
[ -s a.exr ] && [ -s a.png ] && [ -s b.png ] && [ -s "bundle, moved/share/man/man1/halflight-render.1" ]

# bundle leaves a folder that is not empty unchanged.
! "$here/../../tools/bundle" --program "$program" room 2>/dev/null || fail "overwrote a folder"
