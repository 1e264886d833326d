# What the scripts share. Each is called as `sh PART.sh SCN FOLDER`, works in an empty folder of its own and ends with the number of
# expectations that were not met.
#
#     run STATUS COMMAND …      the command must exit with STATUS; its output is in ./out and ./err
#     says out|err TEXT         the text must be in it
#     same TEXT TEXT            both must be equal
#     there FILE …, gone FILE … must exist, must not
scn=$1
set -u
work=$(mktemp -d "${TMPDIR:-/tmp}/scn-cli-XXXXXX")
trap 'chmod -R u+w "$work"; rm -rf "$work"' EXIT
cd "$work" || exit 99
XDG_CACHE_HOME=$work/cache
NO_COLOR=1
export XDG_CACHE_HOME NO_COLOR
failures=0
last=

wrong() {
    failures=$((failures + 1))
    printf 'NOT MET: %s\n  after: %s\n' "$1" "$last"
    sed 's/^/  err: /' err | head -n 5
}

run() {
    wanted=$1
    shift
    last=$*
    status=0
    "$@" >out 2>err </dev/null || status=$?
    [ "$status" = "$wanted" ] || wrong "exit status $wanted, not $status"
}

says() { grep -qF -- "$2" "$1" || wrong "\"$2\" in $1"; }
quiet() { [ ! -s "$1" ] || wrong "nothing in $1"; }
same() { [ "$1" = "$2" ] || wrong "\"$1\" equal to \"$2\""; }
there() { for file; do [ -e "$file" ] || wrong "$file is there"; done; }
gone() { for file; do [ ! -e "$file" ] || wrong "$file is not there"; done; }
json() { jq -e "$1" "$2" >/dev/null 2>&1 || wrong "$1 of $2"; }
finish() {
    [ "$failures" = 0 ] && echo "all expectations met"
    exit "$failures"
}

cat >ball.scn <<'END'
scn 1;
/// How far it is to the right.
param right: scalar = 0 in -2..2;
param turn: angle = 0deg;
param level: int = 1;
camera { eye: (0, 1, 5); look_at: (0, 0, 0); fov: 40deg; }
camera side { eye: (5, 0, 0); look_at: (0, 0, 0); fov: 40deg; }
light { direction: (-1, -1, -1); }
animation { duration: 1s; fps: 8; }
assert level >= 0;
object ball = sphere(1) - cylinder(radius: 0.4).rotate(x: turn + 90deg * (time / 1s));
scene { ball.move(right, 0, 0); }
END
printf 'scn 1;\nscene { sphere(1).rotate(y: 90); }\n' >wrong.scn
