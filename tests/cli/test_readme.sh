#!/usr/bin/env bash
# test_readme.sh CHECKOUT PROGRAM: runs every command of the README's ```sh blocks, with a small size and few samples.
# Also checks that CI runs the set-up that the README shows.
set -euo pipefail
checkout=$1
program=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/bin"
ln -s "$program" "$work/bin/halflight"
ln -s "$checkout/scenes" "$work/scenes"
cd "$work"
PATH=$work/bin:$PATH

block() { sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/{/^\`\`\`/!p}" "$checkout/README.md"; }

commands=$(block sh | sed -E 's/ +#.*//; s/--(samples|time) [0-9]+/--\1 1/; s/--(width|height) [0-9]+/--\1 32/')
count=0
while read -r command; do
    [ -n "$command" ] || continue
    echo "\$ $command"
    [[ $command != *" render "* || $command == *--width* ]] || command+=" --width 32"
    [[ $command != *" render "* || $command == *--samples* || $command == *--time* ]] || command+=" --samples 1"
    bash -c "$command"
    count=$((count + 1))
done <<<"$commands"
[ "$count" -ge 5 ] || { echo "found only $count commands in the README"; exit 1; }

for script in $(block console | awk '{print $1}'); do
    [ -x "$checkout/$script" ] || { echo "$script: the README shows it, and it is not there"; exit 1; }
    grep -q "^$script" "$checkout/.ci/run" || { echo "$script: CI does not run it"; exit 1; }
done
