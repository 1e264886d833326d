# installed.sh BUILD FOLDER CMAKE CC LIBDIR: what `cmake --install` puts somewhere is found there by CMake and by pkg-config, also after
# it was moved, and a program can be linked with either library.
set -eu
build=$1 folder=$2 cmake=$3 cc=$4 libdir=$5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$cmake" --install "$build" --prefix "$work/first" >"$work/log"
mv "$work/first" "$work/prefix"

# says PROGRAM: it renders what the example renders.
says() {
    "$@" >"$work/out"
    grep -q 'picture 1 shows the object in [1-9]' "$work/out" || { cat "$work/out"; exit 1; }
}

"$work/prefix/bin/scn" --version
"$cmake" -S "$folder/installed" -B "$work/cmake" -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$work/prefix" >"$work/log" ||
    { cat "$work/log"; exit 1; }
"$cmake" --build "$work/cmake" >"$work/log" || { cat "$work/log"; exit 1; }
says "$work/cmake/renders"

PKG_CONFIG_PATH=$work/prefix/$libdir/pkgconfig
LD_LIBRARY_PATH=$work/prefix/$libdir
export PKG_CONFIG_PATH LD_LIBRARY_PATH
# Several words are wanted from each.
# shellcheck disable=SC2046
"$cc" "$folder/render_example.c" -o "$work/shared" $(pkg-config --cflags --libs scn) -lpthread
says "$work/shared"
# shellcheck disable=SC2046
"$cc" "$folder/render_example.c" -o "$work/static" $(pkg-config --cflags scn) "$work/prefix/$libdir/libscn.a" \
    $(pkg-config --static --libs scn | sed 's/-lscn//') -lpthread
ldd "$work/static" | grep -q libscn && { echo "libscn.a was not taken"; exit 1; }
says "$work/static"
echo "found by CMake and pkg-config"
