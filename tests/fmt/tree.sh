# All scenes of the project are formatted. Called as `sh tree.sh SCN ROOT`.
#
# Left out are the folders whose scenes are about layout itself: tests/parse, tests/fmt, and tests/editors, whose goldens name columns. A
# scene with errors of syntax cannot be formatted; only one that expects an error may be such.
root=$2
. "$root/tests/cli/lib.sh"
cd "$root" || exit 99
find stdlib tests -name '*.scn' ! -path 'tests/parse/*' ! -path 'tests/fmt/*' ! -path 'tests/editors/*' | sort >"$work/all"
[ "$(wc -l <"$work/all")" -gt 250 ] || wrong 'the scenes are found'
xargs "$scn" fmt --check <"$work/all" >"$work/out" 2>"$work/err"
[ "$?" -lt 124 ] || wrong 'scn fmt runs'
while read -r scene; do
    echo "$scene is not formatted: run \`scn fmt $scene\`"
    failures=$((failures + 1))
done <"$work/out"
sed -n 's/^\([^ :]*\.scn\):[0-9]*:[0-9]*: error: .*/\1/p' "$work/err" | sort -u | while read -r scene; do
    grep -q '// error: ' "$scene" || echo "$scene has errors that it does not expect"
done >"$work/unexpected"
[ ! -s "$work/unexpected" ] || { cat "$work/unexpected"; failures=$((failures + 1)); }
finish
