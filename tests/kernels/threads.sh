#!/bin/sh
# threads.sh SCN SCENE…: one thread and two give the same files, bit for bit, and so does doing it again.
set -eu
scn=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0
for scene in "$@"; do
    for run in 1 2 2b; do
        "$scn" render -q --threads "${run%b}" --size 200x136 --layers all --float -o "$folder/$run.exr" -o "$folder/$run.png" "$scene"
    done
    for other in 2 2b; do
        for suffix in exr png; do
            cmp "$folder/1.$suffix" "$folder/$other.$suffix" || status=1
        done
    done
    [ "$status" = 0 ] || printf '%s: pictures differ\n' "$scene"
done
exit "$status"
