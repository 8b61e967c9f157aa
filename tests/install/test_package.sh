#!/usr/bin/env bash
# test_package.sh BUILD_FOLDER: makes the Debian package of a build, and checks its dependencies against the libraries that
# its programs name. Then it renders from the unpacked package, with an empty environment.
set -euo pipefail
build=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() {
    echo "$*" >&2
    exit 1
}

cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip >log || fail "$(cat log)"
package=$(echo halflight_*.deb)
dpkg-deb --extract "$package" root
depends=$(dpkg-deb --field "$package" Depends | sed 's/([^)]*)//g' | tr -s ' ,|' '\n')

for file in bin/halflight lib/libhalflight.a include/halflight/api/halflight/halflight.h lib/cmake/halflight/halflight-config.cmake \
    share/man/man1/halflight-render.1 share/bash-completion/completions/halflight share/zsh/vendor-completions/_halflight \
    share/fish/vendor_completions.d/halflight.fish share/applications/halflight.desktop \
    share/icons/hicolor/scalable/apps/halflight.svg share/thumbnailers/halflight.thumbnailer share/halflight/demo.glb \
    share/doc/halflight/copyright share/doc/halflight/docs/rendering.md; do
    [ -s "root/usr/$file" ] || fail "$file is missing"
done

programs=$(find root/usr/bin root/usr/lib -type f \( -perm -100 -o -name '*.so' \) -exec sh -c 'objdump -p "$1" >/dev/null 2>&1' - {} \; -print)
checked=0
for program in $programs; do
    for library in $(objdump -p "$program" | sed -n 's/^ *NEEDED *//p'); do
        path=$(ldd "$program" | sed -n "s|^\t$library => \(/[^ ]*\) .*|\1|p")
        [ -n "$path" ] || continue # the dynamic linker itself
        path=$(readlink -f "$path") # without /usr, it may be known under another path
        owner=$(dpkg-query --search "*/$(basename "${path%/*}")/${path##*/}" | sed -n '1s/:.*//p')
        grep -Fqx "$owner" <<<"$depends" || fail "$program needs $library of $owner, which is not among:" $depends
        checked=$((checked + 1))
    done
done
[ "$checked" -gt 20 ] || fail "only $checked libraries were found in: $programs"

# The command of the entry makes a thumbnail, as file managers run it.
if command -v desktop-file-validate >/dev/null; then desktop-file-validate root/usr/share/applications/halflight.desktop; fi
cp -r "$here/../cli/room" room
entry=$(sed -n 's/^Exec=//p' root/usr/share/thumbnailers/halflight.thumbnailer | sed 's|%s|16|; s|%i|room/room.gltf|; s|%o|t.png|')
env -i PATH="$work/root/usr/bin" /bin/sh -c "$entry"
env -i "$work/root/usr/bin/halflight" render --demo a.exr --width 16 --samples 1
[ -s t.png ] && [ -s a.exr ]
