#!/usr/bin/env bash
# test_release_name.sh: tools/package/lib.sh names each distribution but those of packages.txt, in one line.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
. "$here/../../tools/package/lib.sh"

# said ID VERSION_ID NAME: prints what name_release says on a distribution.
said() {
    printf 'ID=%s\nVERSION_ID=%s\nPRETTY_NAME="%s"\n' "$@" >"$work/os-release"
    name_release "$work/os-release" 2>&1
}
for version in 12 13; do
    [ -z "$(said debian $version "Debian GNU/Linux $version")" ] || die "names Debian $version"
done
for other in "debian '' Debian/sid" "debian 11 Debian/11" "ubuntu 24.04 Ubuntu/24.04" "fedora 13 Fedora/13"; do
    read -r id version name <<<"$other"
    line=$(said "$id" "$version" "$name")
    [[ $line == *"$name"* && $line != *$'\n'* ]] || die "says '$line' on $name"
done
[[ $(name_release "$work/none" 2>&1) == *"no Debian"* ]] || die "is silent where there is no os-release"
