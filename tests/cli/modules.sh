# Scenes of several files: one file of many (flatten), and what make needs to know of them (-MD).
. "$2/lib.sh"
tests=$2/..

# Flattened, a scene has the same IR: every scene that includes or uses something, and every scene of the gallery. Only handles of libraries
# are called otherwise then.
ir() { "$scn" dump --ir "$1" 2>>err | sed 's/^param "[a-z_]*\./param "/'; }
flattened=0
for scene in "$tests"/check/*.scn "$tests"/eval/*.scn "$tests"/render/*.scn "$tests"/../stdlib/gallery/*.scn; do
    case $scene in
    */gallery/*) ;;
    *) grep -qE '^(use|include) ' "$scene" || continue ;;
    esac
    grep -qE '// error|// frame-error' "$scene" && continue
    run 0 "$scn" flatten "$scene" -o flat.scn
    ir "$scene" >whole.ir
    ir flat.scn >flat.ir
    last="flatten $scene"
    [ -s whole.ir ] || wrong 'an IR'
    cmp -s whole.ir flat.ir || wrong 'the same IR'
    grep -qE '^ *(use|include) ' flat.scn && wrong 'one file'
    run 0 "$scn" fmt --check flat.scn
    flattened=$((flattened + 1))
done
[ "$flattened" -ge 28 ] || wrong "28 scenes and more, not $flattened"

mkdir -p parts
cat >parts/eye.scn <<'END'
scn 1;
// An eye that looks forward.
object eye { sphere(0.2); }        // white
END
cat >parts/clay.scn <<'END'
scn 1;
let size = 0.5;
light lamp { direction: (0, 0, -1); }
tag head() { sphere(size) }
END
cat >face.scn <<'END'
scn 1;
include "parts/eye.scn"; // two of them
use "parts/clay.scn" as clay;
let size = 1;
clay.head(); eye.move(x: size);
END
run 0 "$scn" flatten face.scn
says out '// An eye that looks forward.'
says out 'let clay_size = 0.5;'
says out '{ sphere(clay_size) }'
says out 'eye.move(x: size);'
same "$(grep -c 'scn 1;' out)" 1
printf 'use "parts/clay.scn" as clay;\nclay.lamp;\nsphere(1);\n' >lit.scn
run 1 "$scn" flatten lit.scn
says err '[misplaced]'
run 1 "$scn" flatten wrong.scn
says err '[angle-unit]'
quiet out

# The rule names all that was read, as make reads it.
cp face.scn 'a $face #1.scn'
run 0 "$scn" check -MD 'a $face #1.scn'
says 'a $face #1.d' 'a\ $$face\ \#1.d:'
says 'a $face #1.d' 'a\ $$face\ \#1.scn'
says 'a $face #1.d' 'parts/eye.scn'
says 'a $face #1.d' 'parts/clay.scn'
run 0 "$scn" build --source -q face.scn -o face.scnk -MD
says face.d 'face.scnk:'
run 0 "$scn" check face.scn -MF here.d -MT stamp
says here.d 'stamp:'
run 1 "$scn" check wrong.scn -MD
gone wrong.d
run 2 "$scn" check face.scn ball.scn -MF here.d
run 2 "$scn" check -MD -
says err '-MF'
run 0 "$scn" check -MF stdin.d -
if grep -q '<stdin>' stdin.d; then wrong 'no file is called <stdin>'; fi
if command -v make >/dev/null; then
    printf 'all: face.scnk\nface.scnk:\n\techo again\ninclude face.d\n' >Makefile
    run 0 make -q all
    touch -d '1 minute' parts/clay.scn
    run 1 make -q all
fi
finish
