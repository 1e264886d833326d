#!/bin/sh
# The pictures of texts, made of the very examples that stand before them.
#
#     pictures.sh SCN GALLERY EXAMPLES OUT TEXT.md ...
#
# A line `![…](pictures/NAME.png)` behind an example (with others, or empty lines, between them at most) is the picture of that example;
# `![…](pictures/NAME.png "1.5s")` at that time, `![…](pictures/NAME.png "plane z=0.5")` its slice there. The examples are where check_examples has written them, in EXAMPLES/TEXT. Each is rendered to OUT
# and compared with the picture that was looked at (tests/gallery/gallery.c says how); UPDATE=1 writes that anew. A picture that no text
# shows is a failure, and so is a text whose pictures are too many to be kept with it.
set -eu
scn=$1 gallery=$2 examples=$3 out=$4
shift 4
status=0
mode=--compare
[ -z "${UPDATE:-}" ] || mode=--update
rm -rf "$out"
mkdir -p "$out"

# list TEXT: a line EXAMPLE NAME TIME for each picture.
list() {
    awk -v stem="$(basename "$1" .md)" '
        /^```/ && inside { inside = 0; next }
        /^```/ {
            inside = 1; example = ""
            if ($0 == "```scn") example = stem "-" (NR + 1) ".scn"
            else if ($0 ~ /^```scn [^ ]+\.scn$/) example = $2
            next
        }
        inside { next }
        match($0, /^!\[[^]]*\]\(pictures\/[^ )]*\.png/) {
            name = $0; sub(/^.*\(pictures\//, "", name); sub(/\.png.*$/, "", name)
            time = "0s"; if ($0 ~ /"[0-9.]+m?s"\)/) { time = $0; sub(/^[^"]*\.png "/, "", time); sub(/".*$/, "", time) }
            if ($0 ~ /"plane [xyz]=[-0-9.]+"\)/) { time = $0; sub(/^[^"]*\.png "plane /, "", time); sub(/".*$/, "", time) }
            if (example == "") { print "? " name " 0s"; next }
            print example " " name " " time; next
        }
        NF { example = "" }' "$1"
}

# slice EXAMPLE PLANE PICTURE: slices are exact, so the pixels are compared as files.
slice() {
    "$scn" slice "$1" --plane "$2" --size 240 -o "$out/$(basename "$3")" -q || return 1
    if [ -n "${UPDATE:-}" ]; then
        cp "$out/$(basename "$3")" "$3"
    else
        cmp "$out/$(basename "$3")" "$3"
    fi
}

for text in "$@"; do
    pictures=$(dirname "$text")/pictures
    folder=$examples/$(basename "$text" .md)
    list "$text" >"$out/list"
    while read -r example name time; do
        [ "$example" != '?' ] || { echo "$text: pictures/$name.png stands behind no example"; status=1; continue; }
        [ "$example" = "$name.scn" ] || cp "$folder/$example" "$folder/$name.scn"
        case $time in
            [xyz]=*)
                slice "$folder/$name.scn" "$time" "$pictures/$name.png" || status=1
                echo "$pictures/$name.png" >>"$out/shown"
                continue
                ;;
        esac
        "$gallery" --scn "$scn" --out "$out" --size 240 --time "$time" $mode "$pictures" "$folder/$name.scn" || status=1
        echo "$pictures/$name.png" >>"$out/shown"
    done <"$out/list"
done

size=0
for folder in $(for text in "$@"; do dirname "$text"; done | sort -u); do
    for picture in "$folder"/pictures/*.png; do
        grep -qxF "$picture" "$out/shown" || { echo "$picture: no text shows it: remove it"; status=1; }
        size=$((size + $(wc -c <"$picture")))
    done
done
[ "$size" -le 500000 ] || { echo "the pictures of the texts take $size bytes: render fewer"; status=1; }
exit "$status"
