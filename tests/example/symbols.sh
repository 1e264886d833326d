# symbols.sh LIBRARY HEADER: the functions that the library exports are those that the header declares, no more and no less.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
case $1 in
*.a) kind=-g ;; # of an archive all that a linker sees
*) kind=-D ;;
esac
nm $kind --defined-only "$1" | awk 'NF == 3 && $3 !~ /^__(asan|odr_asan|ubsan)/ { print $3 }' | sort >"$work/exported"
grep -o '^SCN_API [^(]*(' "$2" | sed 's/.*[ *]\(scn_[a-z_]*\)($/\1/' | sort >"$work/declared"
diff "$work/declared" "$work/exported"
echo "$(wc -l <"$work/exported") functions"
