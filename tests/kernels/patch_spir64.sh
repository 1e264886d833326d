#!/bin/sh
# patch_spir64.sh KERNELS: the kernels of deformable patches must compile as OpenCL C 1.2 for 64-bit SPIR, without a
# warning and without an extension, as CPUs see them (16 columns a work-item) and as graphics cards do (one, 256
# work-items a group).
set -eu
kernels=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat "$kernels/patch_shared.h" "$kernels/patch.cl" >"$folder/patch.cl"
for options in '-DWIDTH=16 -DGROUP=1' '-DWIDTH=1 -DGROUP=1' '-DWIDTH=1 -DGROUP=256'; do
    # Word splitting is wanted: several options.
    # shellcheck disable=SC2086
    clang -x cl -cl-std=CL1.2 --target=spir64 -Xclang -finclude-default-header -Xclang -cl-ext=-all -Wall -Werror -Wno-unused \
        -O1 -c -emit-llvm $options -o "$folder/patch.bc" "$folder/patch.cl"
done
