#!/bin/sh
# links.sh ROOT OUT: what the texts of the tree link to is there: files, and headings of other texts and of their own. OUT is a file for what is missing.
set -eu
cd "$1"
status=0
# A heading's anchor, as forges make it: small letters, digits, - and _; spaces are -; all else goes.
anchors() {
    sed -n 's/^##* //p' "$1" | tr '[:upper:]' '[:lower:]' | sed 's/[^a-z0-9 _-]//g; s/ /-/g'
}
for text in *.md */*.md lang/guide/*.md; do
    [ -f "$text" ] || continue
    case $text in build*) continue ;; esac
    awk '/^```/ { inside = !inside } !inside' "$text" | sed 's/`[^`]*`//g' | grep -o '](\([^) ]*\)' | sed 's/^](//' | sort -u |
        while read -r link; do
            case $link in http*:*) continue ;; esac
            file=${link%%#*}
            heading=
            [ "$link" = "$file" ] || heading=${link#*#}
            target=$text
            [ -z "$file" ] || target=$(dirname "$text")/$file
            if [ ! -e "$target" ]; then
                echo "$text: there is no $link"
            elif [ -n "$heading" ] && ! anchors "$target" | grep -qxF "$heading"; then
                echo "$text: $target has no heading #$heading"
            fi
        done
done >"$2"
[ ! -s "$2" ] || { cat "$2"; status=1; }
exit "$status"
