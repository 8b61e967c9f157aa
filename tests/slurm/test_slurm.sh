#!/usr/bin/env bash
# test_slurm.sh PROGRAM SOURCE: renders 24 frames by a job array of six tasks and kills one of the workers. All frames
# must be complete afterwards, and equal to those without Slurm. Exit status 77: skipped.
set -euo pipefail

program=$(realpath "$1")
source=$2
folder=$(mktemp -d /tmp/halflight-slurm.XXXXXX)
chmod 755 "$folder"  # munged runs as another user
trap 'rm -rf "$folder" || true' EXIT

inside() {
    cd "$folder"
    cp "$source/scenes/cornell.glb" walk.glb
    local settings=(--width 64 --height 36 --samples 32 --reproducible)
    local render=(walk.glb out/walk.####.exr --frames 1-24 "${settings[@]}")
    mkdir out logs
    "$source/tools/slurm/submit" --halflight "$program" --tasks 6 --logs logs --memory 1000 --wait "${render[@]}" &
    local submitted=$!

    # The first worker found is killed, as if it had crashed.
    local worker= deadline=$((SECONDS + 90))
    until worker=$(pgrep --full --oldest -- "/halflight render walk.glb .*--part") && kill -9 "$worker" 2>/dev/null; do
        kill -0 $submitted || { cat logs/*; echo "submit has ended before a worker was seen"; return 1; }
        if [ $SECONDS -ge $deadline ]; then
            kill $submitted || true
            echo "no worker was seen in 90 s"
            return 1
        fi
        sleep 0.01
    done

    local status=0
    wait $submitted || status=$?
    [ $status -eq 0 ] || { cat logs/*; echo "the check says $status"; return 1; }
    grep --quiet "queued again" logs/*.log || { cat logs/*; echo "no task was queued again"; return 1; }
    [ "$(ls out | wc -l)" -eq 24 ] || { ls out; echo "there should be 24 frames"; return 1; }

    mkdir alone
    "$program" render walk.glb alone/walk.####.exr --frames 3,24 "${settings[@]}" --quiet
    for frame in 0003 0024; do cmp out/walk.$frame.exr alone/walk.$frame.exr; done

    # The check names a frame that is truncated or missing.
    truncate --size=-1 out/walk.0007.exr
    rm out/walk.0012.exr
    if "$program" render "${render[@]}" --check >said 2>&1; then echo "nothing was missed"; return 1; fi
    grep --quiet 7 said && grep --quiet 12 said || { cat said; echo "7 and 12 are not named"; return 1; }
    # The requested memory depends on the picture.
    mkdir fake
    printf '#!/bin/sh\necho 1\n' >fake/sbatch
    chmod +x fake/sbatch
    told() {
        PATH=$folder/fake:$PATH "$source/tools/slurm/submit" --halflight "$program" walk.glb none/x.####.exr "$@" --frames 1-2 |
            sed -n 's/.* tasks of \([0-9]*\) MiB$/\1/p'
    }
    local small large name
    small=$(told --width 64 --height 36)
    large=$(told --width=3840 --height 2160 --aov all --half)
    [ "$small" -gt 100 ] && [ "$large" -gt $((small + 2000)) ] || { echo "memory: $small, $large MiB"; return 1; }
    small=$(told --width 3840 --height 2160)
    for name in png jpg tif; do
        large=$(told "none/x.####.$name" --width 3840 --height 2160)
        [ "$large" -gt $((small + 100)) ] || { echo "memory with .$name: $small, $large MiB"; return 1; }
    done
    [ -n "$(told --width 64 --keep glossy)" ] || { echo "--keep is refused"; return 1; }
    # sbatch prints NUMBER;CLUSTER if there are several clusters, and the check depends on the number.
    printf '#!/bin/sh\necho "$*" >>"%s/asked"\necho "7;north"\n' "$folder" >fake/sbatch
    PATH=$folder/fake:$PATH "$source/tools/slurm/submit" --halflight "$program" --logs logs "${render[@]}" >said
    grep --quiet '^array 7: 8 tasks' said && grep --quiet '^check 7$' said || { cat said; return 1; }
    grep --quiet -e '--dependency=afterany:7 ' asked || { cat asked; return 1; }
    # submit refuses invalid input before it queues a job.
    if "$source/tools/slurm/submit" --halflight "$program" none.glb out/x.####.exr --frames 1-2 2>said; then return 1; fi
    grep --quiet none.glb said || { cat said; return 1; }
    if "$source/tools/slurm/submit" --halflight "$program" --logs walk.glb/logs "${render[@]}" 2>said; then return 1; fi
    [ "$(cat said)" = "submit: --logs: 'walk.glb/logs' is not a writable folder" ] || { cat said; return 1; }
}

export -f inside
export program source folder
"$(dirname "$0")/with_cluster" "$folder/slurm" bash -euo pipefail -c inside
