# What scn tree says. Called as `sh tree.sh SCN FOLDER`; of each NAME.scn there is NAME.out. With UPDATE=1 in the environment they are written anew.
folder=$2
. "$folder/../cli/lib.sh"

for scene in "$folder"/*.scn; do
    golden=${scene%.scn}.out
    run 0 "$scn" tree "$scene"
    [ "${UPDATE:-}" != 1 ] || cp out "$golden"
    diff -u "$golden" out || wrong "$golden is what scn tree says"
done

# The same as JSON, with places; costs add up.
run 0 "$scn" tree --json "$folder/sets.scn"
json '.tree.parts | map(.kind) == ["difference", "intersection", "intersection"]' out
json '.tree.parts[0] | .name == "nut" and .material == "clay" and .class == "set" and .exact and .quadrics == 6' out
json '.tree.parts[0].parts[2] | .word == "box" and .subtracted and (.at.line == 3)' out
json '[.. | objects | select(.parts) | (.cost - ([.parts[].cost] | add)) | fabs < 1e-9] | all' out
json '.tree.parts[1].bounds[0] | map(. * 1000 | round) == [4000, -1000, -1000]' out
run 0 "$scn" tree --json --depth 2 "$folder/sets.scn"
json '.tree.parts[0] | has("parts") | not' out
run 0 "$scn" tree --json "$folder/moving.scn"
json '.tree.moved_by == ["time", "frame", "gap", "open"] and .tree.rate == "frame"' out
json '[.. | objects | select(.hidden) | .kind] == ["quadric", "intersection", "quadric"]' out
run 0 "$scn" tree --depth 1 "$folder/moving.scn"
same "$(grep -c . out)" 3

# At another moment and with other params.
run 0 "$scn" tree --json "$folder/moving.scn" -t 12f -D open=1 -D gap=2
json '[.. | objects | select(.hidden) | .kind] == ["intersection"]' out
json '[.. | objects | select(.kind == "quadric" and .conditional) | .bounds[1][0] | round] == [1, 3]' out

# A package has no scene to tell of, but the same objects, bounds and movers.
run 0 "$scn" build --source "$folder/moving.scn" -o moving.scnk
run 0 "$scn" tree moving.scnk
says out wheel
says out 'time, gap'
run 0 "$scn" tree --json moving.scnk
json '.package and .tree.moved_by == ["time", "frame", "gap", "open"]' out
json '.tree.bounds | map(map(. * 10 | round)) == [[-40, -20, -2], [20, 20, 2]]' out

# General fields have the class "field"; in a package they have bounds too.
printf 'param a: scalar = 1;\nscene { field(a - x^2 - y^4 - z^2).named("egg"); sphere(1).move(5, 0, 0); }\n' >field.scn
run 0 "$scn" tree --json field.scn
json '.tree.parts[0] | .name == "egg" and .class == "field" and (.exact | not) and .moved_by == ["a"]' out
run 0 "$scn" build --source field.scn -o field.scnk
run 0 "$scn" tree --json field.scnk
json '.tree.class == "field" and .tree.parts[0].moved_by == ["a"] and .tree.parts[0].bounds[1][0] < 2' out

# What moves a field moves what stands on it.
cat >standing.scn <<'END'
param swell: scalar = 0.2 in 0 .. 1;
param apart: scalar = 3;
object wavy = field(1 + swell - x^2 - y^2 - z^2 - 0.2 * sin(1rad * 3 * x)) & box(3);
let top = surface(wavy, from: (0, 0, 5));
scene {
    wavy;
    freeform(sphere(1)) { bump(on: top, radius: 0.4, height: 0.1); }.named("ball");
    sphere(1).move(apart, 0, 0).named("far");
}
END
run 0 "$scn" build --source standing.scn -o standing.scnk
run 0 "$scn" tree --json standing.scnk
json '[.. | objects | select(.name == "ball") | .moved_by] == [["swell"]]' out
json '[.. | objects | select(.name == "far") | .moved_by] == [["apart"]]' out

# Colours are those of messages.
run 0 "$scn" tree --color always "$folder/moving.scn"
says out "$(printf '\033[1mscene')"
run 0 "$scn" tree "$folder/moving.scn"
if grep -q "$(printf '\033')" out; then wrong 'no colour in a file'; fi

# Mistakes.
run 1 "$scn" tree wrong.scn
says err '[angle-unit]'
quiet out
printf 'param r: scalar = 1;\nsphere(1 / r);\n' >zero.scn
run 1 "$scn" tree zero.scn -D r=0
says err 'zero.scn:2'
run 3 "$scn" tree missing.scn
run 2 "$scn" tree --depth 0 ball.scn
run 2 "$scn" tree
finish
