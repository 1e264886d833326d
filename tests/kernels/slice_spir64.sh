#!/bin/sh
# slice_spir64.sh KERNELS: the kernels of slices must compile as OpenCL C 1.2 for 64-bit SPIR, without an extension.
set -eu
kernels=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for file in shared.h packet.cl tape_shared.h noise.cl tape.cl slice_shared.h slice.cl slice_tiles.cl; do cat "$kernels/$file"; done >"$folder/slice.cl"
clang -x cl -cl-std=CL1.2 --target=spir64 -Xclang -finclude-default-header -Xclang -cl-ext=-all -Wall -Werror -Wno-unused -Wno-pragmas \
    -O1 -c -emit-llvm -DWIDTH=16 -o "$folder/slice.bc" "$folder/slice.cl"
