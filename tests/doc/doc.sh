# The reference of a library and of what is built in. Called as `sh doc.sh SCN FOLDER`; with UPDATE=1 in the environment shapes.md is written anew.
folder=$2
. "$folder/../cli/lib.sh"
cp "$folder/shapes.scn" .

# A page is valid HTML, all of its links lead somewhere, and it needs nothing beside it.
valid() {
    tidy -q -e "$1" >tidy.out 2>&1 || wrong "$1 is valid HTML: $(head -n 3 tidy.out)"
    tr '"' '\n' <"$1" | grep '^#[a-z]' | grep -v '^#[0-9a-f]*;' | sort -u >links
    tr '>' '\n' <"$1" | sed -n 's/.* id="\(.*\)"$/#\1/p' | sort -u >places
    same "$(comm -23 links places)" ''
    if grep -Eq '(src|href)="(https?:|/)' "$1"; then wrong "$1 needs nothing else"; fi
}
pictures() { grep -c 'src="data:image/png;base64,' "$1"; }

run 0 "$scn" doc shapes.scn -o page/
quiet out
quiet err
there page/shapes.html
valid page/shapes.html
same "$(pictures page/shapes.html)" 6 # plate, bar, beam, pipe, knob, brass
says page/shapes.html '<code>&lt;none&gt;</code> of them &amp; all &quot;useful&quot;'
says page/shapes.html '<li>With pictures.</li>'
says page/shapes.html 'id="plate"'
says page/shapes.html '(shapes.pipe() &amp; box(3)).paint(#c8a06a);'
says page/shapes.html 'freeform(sphere(1)) { shapes.knob(on: surface(from: (2, 1, 3))); }'
if grep -Eq '_half|not_documented' page/shapes.html; then wrong 'only what is documented is in it'; fi

# The pictures are pictures, and the same each time.
sed -n 's/.*base64,\([^"]*\)".*/\1/p' page/shapes.html | head -n 1 | base64 -d >plate.png
same "$(od -An -tx1 -N24 plate.png | tr -d ' \n')" 89504e470d0a1a0a0000000d4948445200000140000000f0
run 0 "$scn" doc shapes.scn -o again.html
cmp -s again.html page/shapes.html || wrong 'the same page each time'

# Markdown, with the pictures beside it.
mkdir md
run 0 "$scn" doc shapes.scn -o md/shapes.md --size 80x60
there md/shapes.md md/shapes-plate-1.png md/shapes-bar-1.png md/shapes-beam-1.png md/shapes-pipe-1.png md/shapes-knob-1.png
gone md/shapes-label-1.png
[ "${UPDATE:-}" != 1 ] || cp md/shapes.md "$folder/shapes.md"
diff -u "$folder/shapes.md" md/shapes.md || wrong 'shapes.md is what scn doc says'
run 0 "$scn" doc shapes.scn --format markdown
if grep -q '!\[' out; then wrong 'no pictures without a place'; fi

# Libraries of scn, and what is built in.
run 0 "$scn" doc brushes -o brushes.html --size 40x30
valid brushes.html
run 0 "$scn" doc --builtins --no-pictures -o builtins.html
valid builtins.html
same "$(pictures builtins.html)" 0
for word in sphere bump union rotate material sin time; do says builtins.html "<h3 id=\"$word\">"; done
says builtins.html 'Not in this version yet.'

# Each example of what is built in is a scene.
run 0 "$scn" doc --builtins --no-pictures --format markdown
mkdir -p examples
awk '/^```scn$/ { name = sprintf("examples/%03d.scn", ++count); next } /^```/ { name = "" } name { print >name }' out
[ "$(ls examples | wc -l)" -gt 50 ] || wrong 'examples of most of what is built in'
run 0 "$scn" check examples/*.scn
quiet err

# Mistakes.
printf '/// ```scn\n/// ball(y: 90deg);\n/// ```\ntag ball() { sphere(1) }\n' >wrong_example.scn
run 1 "$scn" doc wrong_example.scn -o wrong_example.html
says err '[unknown-argument]'
says err 'the example of ball is wrong'
gone wrong_example.html
printf 'tag ball( { sphere(1) }\n' >broken.scn
run 1 "$scn" doc broken.scn
says err 'broken.scn:1'
quiet out
printf 'sphere(1);\n' >plain.scn
run 1 "$scn" doc plain.scn
says err 'no tag'
run 3 "$scn" doc missing.scn
says err brushes
run 2 "$scn" doc
run 2 "$scn" doc shapes.scn -o shapes.pdf
says err '.html'
gone shapes.pdf
run 0 "$scn" doc shapes.scn --format markdown --no-pictures -o shapes.txt
run 2 "$scn" doc brushes --builtins
run 2 "$scn" doc brushes --format pdf
run 3 env OCL_ICD_VENDORS=/nonexistent/ "$scn" doc shapes.scn -o no_device.html
says err 'pocl-opencl-icd'
gone no_device.html
run 0 env OCL_ICD_VENDORS=/nonexistent/ "$scn" doc shapes.scn --no-pictures -o no_device.html
finish
