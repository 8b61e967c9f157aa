# shellcheck shell=bash
# Functions of tools/bundle and tools/package/wheel, which take the libraries of a program along. Sourced after lib.sh.

# Libraries that come from the machine: the C library and the GL driver with its front ends.
of_the_machine='^(linux-vdso|ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|GL|GLX|EGL|OpenGL|GLdispatch|gbm|drm)(-[0-9.]*)?)\.so'
# Libraries that the GL driver uses, too. Two copies in one process would clash, and the driver may need a newer one than
# ours. The machine's copy is used if there is one: it is no older than ours unless its C library is.
shared_with_driver='^lib(stdc\+\+|gcc_s|z|expat|X11|xcb|Xau|Xdmcp|bsd|md)\.so'
system_folders=/usr/lib/$(g++ -print-multiarch):/usr/lib64:/lib64

declare -A path_of taken

# take_libraries FILE FOLDER: copies the libraries that FILE needs, directly and indirectly, into FOLDER and FOLDER/fallback.
take_libraries() {
    local name path
    while read -r name path; do path_of[$name]=$path; done < <(ldd "$1" | sed -n 's/^\t\(.*\) => \(\/.*\) (.*/\1 \2/p')
    mkdir -p "$2/fallback"
    take "$1" "$2"
}

take() {
    local name target
    for name in $(objdump -p "$1" | sed -n 's/^ *NEEDED *//p'); do
        [[ ! $name =~ $of_the_machine ]] || continue
        [ -z "${taken[$name]:-}" ] || continue
        [ -n "${path_of[$name]:-}" ] || die "$name: not found, needed by $1"
        target=$2
        [[ ! $name =~ $shared_with_driver ]] || target=$2/fallback
        cp -L "${path_of[$name]}" "$target/$name"
        chmod 644 "$target/$name"
        strip --strip-unneeded "$target/$name"
        taken[$name]=1
        take "${path_of[$name]}" "$2"
    done
}

# find_libraries FILE FOLDER: lets FILE, which is a copy, find its libraries in FOLDER, relative to its own.
find_libraries() {
    strip --strip-unneeded "$1"
    # RPATH, unlike RUNPATH, also applies to the dependencies of the libraries.
    patchelf --force-rpath --set-rpath "\$ORIGIN/$2:$system_folders:\$ORIGIN/$2/fallback" "$1"
}

# copy_licences FOLDER: copies the licences of the libraries' Debian packages; -dev packages cover the code that is
# compiled in.
copy_licences() {
    local name path package
    mkdir -p "$1"
    {
        for name in "${!taken[@]}"; do
            path=$(readlink -f "${path_of[$name]}") # without /usr, it may be known under another path
            dpkg-query --search "*/$(basename "${path%/*}")/${path##*/}" | sed -n '1s/:.*//p'
        done
        sed -n 's/ *#.*//; /^libglfw3-dev$/d; /^libimgui-dev$/d; /^dpkg-dev$/d; /^libgtest-dev$/d; /^libexpat1-dev$/d; /-dev$/p' "$root/tools/packages.txt" # without those of viewer, tests and packaging
    } | sort -u | while read -r package; do
        cp "/usr/share/doc/$package/copyright" "$1/$package.txt"
    done
    cp "$root/LICENSE" "$1/halflight.txt"
}
