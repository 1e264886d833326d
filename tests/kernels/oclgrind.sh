#!/bin/sh
# oclgrind.sh SCN SCENE…: renders each scene on Oclgrind's simulated device, which watches every access to memory. Nothing may be reported, and
# the picture must be that of the other device. Without optimisation, since Oclgrind does not know some marks that optimised code holds; with local memory
# as small devices have it: 32 kB.
set -eu
scn=$1
shift
if ! command -v oclgrind >/dev/null 2>&1; then
    echo 'oclgrind is not installed'
    exit 77 # ctest: skipped
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0
for scene in "$@"; do
    : >"$folder/log"
    if ! timeout 300 oclgrind --log "$folder/log" --max-errors 20 --data-races --local-mem-size 32768 --build-options -cl-opt-disable \
        "$scn" render -q --no-cache --lanes 1 --size 24x16 -o "$folder/picture.png" "$scene" >"$folder/out" 2>&1; then
        printf '%s: the command failed\n' "$scene"
        tail -n 20 "$folder/out"
        status=1
    fi
    "$scn" render -q --lanes 1 --size 24x16 -o "$folder/other.png" "$scene"
    cmp "$folder/picture.png" "$folder/other.png" || status=1
    if [ -s "$folder/log" ]; then
        printf '%s:\n' "$scene"
        head -n 40 "$folder/log"
        status=1
    fi
done
exit "$status"
