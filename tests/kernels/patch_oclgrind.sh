#!/bin/sh
# patch_oclgrind.sh TEST: steps a small patch on Oclgrind's simulated device, with the work-groups of 256 that graphics
# cards get. Its shape must be the host's, and no access to memory may be wrong or race with another.
set -eu
if ! command -v oclgrind >/dev/null 2>&1; then
    echo 'oclgrind is not installed'
    exit 77 # ctest: skipped
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
oclgrind --log "$log" --max-errors 20 --data-races "$1" small
if [ -s "$log" ]; then
    head -n 40 "$log"
    exit 1
fi
