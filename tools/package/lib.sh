# shellcheck shell=bash
# Functions of the scripts in this folder.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

say() { printf '%s\n' "$*" >&2; }
die() {
    say "${0##*/}: $*"
    exit 1
}

# help_of_comment ARGUMENT...: ends the script with its first comment if the first argument is -h or --help.
help_of_comment() {
    [[ ${1:-} =~ ^(-h|--help)$ ]] || return 0
    sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"
    exit 0
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        die "needs root or sudo to run: $*"
    fi
}

# name_release [FILE]: names the distribution of an os-release file if packages.txt is not written for it.
name_release() (
    ID='' VERSION_ID='' PRETTY_NAME=''
    # shellcheck source=/dev/null
    . "${1:-/etc/os-release}" 2>/dev/null || true
    [[ "$ID $VERSION_ID" =~ ^debian\ (12|13)$ ]] ||
        say "warning: this is ${PRETTY_NAME:-no Debian}; tools/packages.txt is for Debian 12 and 13"
)

# install_packages [test]: installs the missing packages of packages.txt; with `test`, also those that only tests need.
install_packages() {
    local wanted missing package until='/^#! test/,$d'
    if [ "${1:-}" = test ]; then until=; else name_release; fi
    wanted=$(sed "$until; s/#.*//" "$root/tools/packages.txt")
    missing=()
    for package in $wanted; do
        dpkg-query --show --showformat='${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed ||
            missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    command -v apt-get >/dev/null || die "missing packages, and no apt-get to install them: ${missing[*]}"
    say "installing ${missing[*]}"
    as_root apt-get update --quiet=2
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install --quiet=2 --yes --no-install-recommends "${missing[@]}" \
        </dev/null
}

# build_release TARGET...: builds targets of the release preset in build/. Warnings are errors in CI.
build_release() {
    local werror=OFF
    [ -z "${CI:-}" ] || werror=ON
    (
        cd "$root"
        cmake --preset release -DHALFLIGHT_WERROR=$werror
        cmake --build --preset release --target "$@"
    )
}
