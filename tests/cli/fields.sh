# General fields: models of another format, and what of a picture is certain.
. "$2/lib.sh"

# A model of one operation a line becomes a scene that can be checked, laid out and rendered.
cat >ball.vm <<'EOF'
# a ball with a wave on it

_0 var-x
_1 var-y
_2 var-z
_3 square _0
_4 square _1
_5 square _2
_6 add _3 _4
_7 add _6 _5
_8 sqrt _7
_9 const -0.75
a add _8 _9
b const 9e0
c mul _1 b
d sin c
e const 0.05
f mul d e
g add a f
EOF
run 0 "$scn" import ball.vm -o model.scn
quiet err
run 0 "$scn" import ball.vm
cmp -s out model.scn || wrong 'the same scene on standard output'
says out 'let v11 = v9 + v10;'
says out 'field(-v17);'
run 0 "$scn" check model.scn
run 0 "$scn" render model.scn -o model.exr --size 32x32 --layers all --stats stats.json
json '.uncertain_pixels == 0' stats.json
run 0 exrheader model.exr
says out 'certificate, 16-bit floating-point'
run 0 sh -c "'$scn' import - -o - <ball.vm"
cmp -s out model.scn || wrong 'the same from standard input'
sed 's/$/\r/' ball.vm >returns.vm
run 0 "$scn" import returns.vm
cmp -s out model.scn || wrong 'the same of lines that end as on Windows'

# What makes no sense is said with its line, and nothing is written.
bad() {
    printf '%b' "$1" >bad.vm
    run 1 "$scn" import bad.vm -o bad.scn
    says err "bad.vm: $2"
    gone bad.scn
}
bad '_0 var-x\n_1 add _0 _7\n' "line 2: no value above has the name '_7'"
bad '_0 var-x\n_1 add _0\n' "line 2: add wants 2 values, and there is 1"
bad '# a comment\n\n_0 twirl\n' "line 3: there is no operation 'twirl'"
bad '_0\n' "line 1: an operation is missing behind the name"
bad '_0 const\n' "line 1: const wants a number"
bad '_0 const half\n' "line 1: not a number: 'half'"
bad '_0 const 1e999\n' "line 1: not a number: '1e999'"
bad '_0 var-x\n_0 var-y\n' "line 2: there is a value above with the name '_0'"
bad '_0 var-x _0\n' "line 1: nothing is to follow, and there is '_0'"
bad '# nothing\n' 'there is no operation in it'
bad '' 'there is no operation in it'
run 3 "$scn" import none.vm
says err 'cannot read none.vm'
run 2 "$scn" import ball.vm -o a.scn -o b.scn

# A skin of 5e-8 is finer than floats can tell: it is counted, said, and shown.
cat >touch.scn <<'EOF'
camera { eye: (0, 0, 5); look_at: (0, 0, 0); fov: 40deg; }
field((1e-14 - (x^2 + y^2 + z^2 - 1)^2) * (x^2 + y^2 + z^2 - 0.25));
EOF
run 0 "$scn" render touch.scn -o touch.png --size 32x32 --stats stats.json
says err 'rays meet a general field where it is finer than floats can tell'
says err '--layers color,certificate'
json '.uncertain_pixels > 100 and .uncertain_pixels < 1024' stats.json
run 0 "$scn" render touch.scn -o touch.exr --size 32x32 --layers certificate -q
quiet err
run 0 exrheader touch.exr
says out 'certificate, 16-bit floating-point'

# A surface that crosses a ray is certain, also where rounding, a cut or a pole is near: what is not is what touches, of some thousand rays a few.
certain() {
  printf 'camera { eye: (2.2, 1.6, 3.2); look_at: (0, 0, 0); fov: 36deg; }\n%s\n' "$2" >certain.scn
  run 0 "$scn" render certain.scn -o certain.png --size 64x64 --stats stats.json -q
  json ".uncertain_pixels <= $1" stats.json
}
certain 4 'field(-y - 0.9 + 0.3 * fbm((x, 0, z), 3)) & box(8, 3, 8);'
certain 4 'box(0.4, 0.4, 1.6).twist(rate: 30deg).taper(z: -1 .. 1, to: 0.6);'
certain 4 'field(sin(8rad * x) * cos(8rad * y) + sin(8rad * y) * cos(8rad * z) + sin(8rad * z) * cos(8rad * x)) & box(1.2);'
certain 40 'field(z - tan(3rad * x)) & box(2);'

# A field without an end is rendered without a camera, when its kernel is built too, and one that another cuts to size.
echo 'field(z - x^2 - y^2);' >endless.scn
run 0 "$scn" render endless.scn -o endless.png --size 32x32 -q
echo 'field(1 - x^2 - y^2) & slab(z: -1 .. 1);' >cut.scn
run 0 "$scn" render cut.scn -o cut.png --size 32x32 -q
finish
