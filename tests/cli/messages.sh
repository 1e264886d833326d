# What the commands say: as JSON (as SARIF: tests/editors/sarif.mjs), which warnings there are, colours, and what lies under the caret.
. "$2/lib.sh"
unset NO_COLOR

cat >parts.scn <<'END'
object part = sphere(1).rotate(y: 90);
END
cat >main.scn <<'END'
include "parts.scn";
let x = 3;
part.translate(1, 0, 0);
part.move(x, 0, 0);
END
cp main.scn 'odd näme #1.scn'

# JSON: everything that the text says, and the status is the same.
run 1 "$scn" check --error-format json main.scn
quiet err
json '.scn and .errors == 2 and .warnings == 1 and .failures == []' out
json '.diagnostics | length == 3' out
json '.diagnostics[] | select(.code == "unknown-name") | .severity == "error" and .at == {path: "main.scn", line: 3, column: 6, end_line: 3, end_column: 15}' out
json '.diagnostics[] | select(.code == "unknown-name") | .fixes == [{confidence: "likely", at: .at, replacement: "move"}]' out
json '.diagnostics[] | select(.code == "angle-unit") | .at.path == "parts.scn" and .notes[0].message == "included from here" and .notes[0].at.line == 1' out
json '.diagnostics[] | select(.code == "shadow") | .severity == "warning"' out

# Several scenes are one document, and what cannot be read is in it.
printf 'print "seen";\nsphere(1);\n' >fine.scn
run 0 "$scn" check --error-format json fine.scn
json '.errors == 0 and .diagnostics == [] and .printed == "seen\n"' out
quiet err
run 3 "$scn" check --error-format json main.scn nothere.scn fine.scn
json '.errors == 2 and (.failures | length == 1)' out

# Of other commands it is on standard error, and nothing else is.
run 1 "$scn" render --error-format json main.scn -o main.png
quiet out
json '.errors == 2 and .warnings == 1' err
run 0 "$scn" render --error-format json -s 8x8 fine.scn -o fine.png
json '.printed == "seen\n" and .errors == 0 and .failures == []' err
run 2 "$scn" render --error-format json fine.scn -o fine.txt
json '.failures | length == 1' err
run 2 "$scn" info --error-format json --no-such-option fine.scn
json '.failures | length == 1' err
printf 'sphere( 1 );\n' >untidy.scn
run 1 "$scn" fmt --error-format json --check untidy.scn
json '.diagnostics == []' err
says out untidy.scn

# What is wrong in a frame has a place and a code, of a scene and of its package.
printf 'sphere(1);\nassert time < 1s, "too late";\n' >later.scn
run 1 "$scn" render -s 8x8 -t 2s later.scn -o later.png
says err 'later.scn:2:8: error: too late (at 2s, frame 48) [assert-failed]'
run 1 "$scn" render --error-format json -s 8x8 -t 2s later.scn -o later.png
json '.diagnostics == [{severity: "error", code: "assert-failed", message: "too late", notes: [], fixes: [], at: {path: "later.scn", line: 2, column: 8, end_line: 2, end_column: 17}}]' err
run 0 "$scn" build --source later.scn -o later.scnk
run 1 "$scn" run --error-format json -s 8x8 -t 2s later.scnk -o later.png
json '.diagnostics[0].code == "assert-failed" and .diagnostics[0].at.line == 2' err

# Directions that a handle or the time takes away have a place and a frame too.
printf 'param w: scalar = 1;\ncamera {\n    eye: (w, w, 0);\n    look_at: (0, 0, 0);\n    up: (0, 1 - time / 1s, 0);\n}\nlight {\n    direction: (0, w - 2, 0);\n}\nsphere(0.1);\n' >still.scn
run 0 "$scn" render -q -s 8x8 still.scn -o still.png
run 1 "$scn" render -s 8x8 -D w=0 still.scn -o still.png
says err 'still.scn:3:10: error: the camera looks at where it stands: move eye or look_at (at 0s, frame 0) [out-of-range]'
run 1 "$scn" render -s 8x8 -t 1s still.scn -o still.png
says err 'still.scn:5:9: error: up is a direction: it is longer than 0 (at 1s, frame 24) [out-of-range]'
run 1 "$scn" render -s 8x8 -D w=2 still.scn -o still.png
says err 'still.scn:8:16: error: a direction is longer than 0 (at 0s, frame 0) [out-of-range]'

# Unions of intersections of unions, a thousand deep.
{
    echo 'let a0 = sphere(1);'
    seq 1 1000 | while read -r k; do echo "let a$k = (a$((k - 1)) - sphere(0.1).move($k, 0, 0)) | sphere(0.2).move($k, 0, 0);"; done
    echo 'a1000;'
} >deep.scn
run 1 "$scn" check deep.scn
says err 'error: unions and intersections of many parts are nested more than 64 deep: join what can be one union [too-deep]'

# What a scene prints goes to standard error, unless nobody wants it.
run 0 "$scn" check fine.scn
says err seen
quiet out
run 0 "$scn" check --quiet fine.scn
quiet err

run 2 "$scn" check --error-format xml fine.scn
says err 'text, json or sarif'

# Which warnings there are.
printf 'let x = 3;\nsphere(x);\n' >warns.scn
run 0 "$scn" check warns.scn
says err 'warning:'
run 0 "$scn" check -W no-shadow warns.scn
quiet err
run 0 "$scn" check -Wno-shadow -Wshadow warns.scn
says err '[shadow]'
printf 'let idle = 3;\nobject sphere = box(1);\nscene { sphere; }\n' >both.scn
run 1 "$scn" check -Werror both.scn
says err '[unused]'
says err '[shadow]'
run 1 "$scn" check -Werror warns.scn
says err 'error:'
run 1 "$scn" check -Werror=shadow warns.scn
run 0 "$scn" check -Werror=unused warns.scn
run 0 "$scn" check -Werror -Wno-error=shadow warns.scn
says err 'warning:'
run 2 "$scn" check -W no-shadwo warns.scn
says err 'do you mean shadow?'
run 1 "$scn" render -Werror warns.scn -o warns.png
gone warns.png

# Colours: on a terminal only, and where they are asked for.
plain() { ! grep -q "$(printf '\033')" err || wrong "no colours"; }
run 1 "$scn" check main.scn
plain
run 1 "$scn" check --color always main.scn
says err "$(printf '\033[1;31merror:')"
run 1 env NO_COLOR=1 "$scn" check --color always main.scn
says err "$(printf '\033[1;31merror:')"
run 1 "$scn" check --color never main.scn
plain
if command -v script >/dev/null 2>&1; then
    last='script: a terminal'
    TERM=xterm script -qec "$scn check main.scn" terminal >/dev/null </dev/null
    grep -q "$(printf '\033')" terminal || wrong 'colours on a terminal'
    TERM=xterm NO_COLOR=1 script -qec "$scn check main.scn" terminal >/dev/null </dev/null
    grep -v '^Script' terminal | grep -q "$(printf '\033')" && wrong 'no colours with NO_COLOR'
    TERM=dumb script -qec "$scn check main.scn" terminal >/dev/null </dev/null
    grep -v '^Script' terminal | grep -q "$(printf '\033')" && wrong 'no colours on a dumb terminal'
fi

# What is no text is one message, whatever is in it.
cp "$scn" binary
run 1 "$scn" check binary
same "$(grep -c 'error:' err)" 1
says err 'the file is not a text'

# The caret stands under its word behind tabs, wide and combining characters, and line ends of other systems.
printf '\tlet a = "e\314\201\346\274\242\345\255\227"; wrong_name;\r\n' >wide.scn
run 1 "$scn" check wide.scn
same "$(sed -n 2p err)" "    1 |         let a = \"$(printf 'e\314\201\346\274\242\345\255\227')\"; wrong_name;"
same "$(sed -n 3p err)" '      |                          ^~~~~~~~~~'
says err 'wide.scn:1:18:'

finish
