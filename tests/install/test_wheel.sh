#!/usr/bin/env bash
# test_wheel.sh PYTHON MODULE: installs a wheel of the module in fresh virtual environments, and runs the Python lines of
# README.md there. The environment without numpy is told so.
set -euo pipefail
python=$1
module=$2
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() {
    echo "$*" >&2
    exit 1
}

if ! "$python" -c 'import wheel, venv, ensurepip' 2>/dev/null; then
    echo "left out: the Debian packages python3-wheel and python3-venv are missing"
    exit 77
fi
"$root/tools/package/wheel" --module "$module" .

# The packages of the system have numpy. Nothing is downloaded.
"$python" -m venv --system-site-packages with
with/bin/pip install --quiet --no-index ./halflight-*.whl
ln -s "$root/scenes" scenes
sed -n '/^```python$/,/^```$/{/^```/!p}' "$root/README.md" | sed 's/samples=64/samples=1, width=32, height=32/' >lines.py
echo 'assert picture["albedo"].shape == (32, 32, 3) and hl.__file__.startswith("'"$work"'")' >>lines.py
[ "$(wc -l <lines.py)" -eq 5 ] || fail "README.md has other lines: $(cat lines.py)"
env -i HOME="$work" LIBGL_ALWAYS_SOFTWARE=1 with/bin/python lines.py

"$python" -m venv without
without/bin/pip install --quiet --no-index --no-deps ./halflight-*.whl
if without/bin/python -c 'import halflight' 2>error; then fail "was imported without numpy"; fi
[ "$(tail -n 1 error | grep -c 'ImportError: halflight needs the package numpy')" -eq 1 ] || fail "$(cat error)"

# Libraries come from the wheel, except for the C library, the GL driver, and libraries shared with that driver.
outside=$(env -i ldd with/lib/python3*/site-packages/halflight/_native.*.so | grep -v site-packages | awk '{print $1}' |
    grep -Ev '^(linux-vdso|.*/ld-linux|lib(c|m|dl|rt|pthread|EGL|GLdispatch|stdc\+\+|gcc_s|z|expat|X11|xcb|Xau|Xdmcp|bsd|md)\.so)' || true)
[ -z "$outside" ] || fail "not in the wheel: $outside"
