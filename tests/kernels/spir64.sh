#!/bin/sh
# spir64.sh SCN SCENE…: the kernel of every scene must compile as OpenCL C 1.2 for 64-bit SPIR, without a warning, without an extension, with packets of 1 and
# of 16 rays (one, or two side by side): what a GPU's compiler will see.
set -eu
scn=$1
shift
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
status=0
count=0
seen=' '
for scene in "$@"; do
    kernel=$folder/kernel.cl
    if ! "$scn" dump --kernel "$scene" >"$kernel" 2>"$folder/log"; then
        printf '%s: no kernel\n' "$scene"
        cat "$folder/log"
        status=1
        continue
    fi
    # Scenes of one structure have one kernel.
    sum=$(cksum <"$kernel" | tr ' ' -)
    case $seen in *" $sum "*) continue ;; esac
    seen="$seen$sum "
    # All extensions are off, but fp64 where the source asks for it.
    extensions=-all
    if grep -q 'pragma OPENCL EXTENSION cl_khr_fp64' "$kernel"; then extensions=-all,+cl_khr_fp64; fi
    for options in '-DWIDTH=1' '-DWIDTH=16' '-DWIDTH=16 -DPACKETS_SIDE_BY_SIDE=2'; do
        # Word splitting is wanted: several options.
        # shellcheck disable=SC2086
        if ! clang -x cl -cl-std=CL1.2 --target=spir64 -Xclang -finclude-default-header -Xclang "-cl-ext=$extensions" -Wall -Werror \
            -Wno-unused-function -O1 -c -emit-llvm $options -o "$folder/kernel.bc" "$kernel" 2>"$folder/log"; then
            printf '%s, %s:\n' "$scene" "$options"
            head -n 40 "$folder/log"
            status=1
        fi
        count=$((count + 1))
    done
done
printf '%s kernels\n' "$count"
exit "$status"
