# Slices: what a plane cuts out of scenes, packages and models.
. "$2/lib.sh"

# A ball of radius 1: 0.785 of the window -1..1, and a plane at 0.8 cuts a disc of 0.6.
printf 'scn 1;\nsphere(1);\n' >sphere.scn
run 0 "$scn" slice sphere.scn -o sphere.png --window -1..1,-1..1 --size 100 --json
json '.inside == 7860 and .inside + .outside == 10000 and .axis == "z" and .at == 0 and .kernel_builds <= 1' out
there sphere.png
same "$(od -A n -t x1 -N 8 sphere.png)" " 89 50 4e 47 0d 0a 1a 0a"
run 0 "$scn" slice sphere.scn --plane x=0.8 --window -1..1,-1..1 --size 1000x1000 --json
json '(.area - 3.14159265 * 0.36 | fabs) < 0.001 and .drawn_by == "program"' out

# Without a window the picture has the bounds of what has an end, and pixels are squares.
run 0 "$scn" slice sphere.scn --size 300x200
says out 'z = 0, x -1.65 .. 1.65, y -1.1 .. 1.1: '
run 0 "$scn" slice sphere.scn --size 50 -q
quiet out
quiet err

# The parts of a picture are those of the scene: time and params move them.
run 0 "$scn" slice ball.scn --plane x=0 --window -2..2,-2..2 --size 200 --json -D right=1.5
json '.inside == 0' out
run 0 "$scn" slice ball.scn --plane y=0 --window -2..2,-2..2 --size 200 --json -t 0.5s
json '.inside > 5000' out

# A package, and a model of one operation a line.
run 0 "$scn" build ball.scn -o ball.scnk --source -q
run 0 "$scn" slice ball.scnk --plane y=0 --window -2..2,-2..2 --size 200 --json -t 0.5s
cp out package.json
run 0 "$scn" slice ball.scn --plane y=0 --window -2..2,-2..2 --size 200 --json -t 0.5s
same "$(jq .inside out)" "$(jq .inside package.json)"
printf '_0 var-x\n_1 var-y\n_2 square _0\n_3 square _1\n_4 add _2 _3\n_5 sqrt _4\n_6 const 0.5\n_7 sub _5 _6\n' >disc.vm
run 0 "$scn" slice disc.vm -o disc.png --size 64 --json
json '.inside == 812 and .across == [-1, 1] and .numbers == 3 and .comparisons == 1' out

printf 'scn 1;\nfield(sqrt(x));\n' >root.scn

# A package with code for a plane draws the same there, with it, and elsewhere without.
run 0 "$scn" build sphere.scn -o code.scnk --slice z=0 -q
run 0 "$scn" slice code.scnk --plane z=0 --window -1..1,-1..1 --size 100 --json -o code.png
json '.inside == 7860 and .drawn_by == "package" and .kernel_builds == 0' out
run 0 cmp code.png sphere.png
run 0 "$scn" slice code.scnk --plane x=0.1 --window -1..1,-1..1 --size 64 --json
json '.drawn_by == "program"' out
run 2 "$scn" build disc.vm -o code.scnk --slice z=0 --source
says err '--slice is code for this machine, which --source leaves out'
run 2 "$scn" build disc.vm -o code.scnk --slice 0
says err '--slice wants an axis and where on it'
run 1 "$scn" build root.scn -o root.scnk --slice z=0
says err 'there is no code for what may be undefined'
gone root.scnk

# What is undefined is outside, and nothing is everything.
run 0 "$scn" slice root.scn --size 32 --json
json '.inside == 512' out
printf 'scn 1;\nscene { ~sphere(0.5) & sphere(0.25); }\n' >nothing.scn
run 0 "$scn" slice nothing.scn --size 32 --json --window -1..1,-1..1
json '.inside == 0' out
run 0 "$scn" slice nothing.scn --size 32 --json --window -1..1,-1..1 --plane z=60000
json '.inside == 0' out

# Coincident faces of a difference leave nothing behind, and paint is seen.
printf 'scn 1;\nmaterial red { color: (1, 0, 0); }\nscene { (box(1) - box(0.5).move(0.25, 0, 0)).paint(red); }\n' >box.scn
run 0 "$scn" slice box.scn --window -1..1,-1..1 --size 200 -o box.png --json
json '.inside == 7500' out

# What cannot be sliced is said with its name.
printf 'scn 1;\npatch skin { }\nscene { sphere(1); skin; }\n' >patch.scn
run 1 "$scn" slice patch.scn -o patch.png
says err 'skin cannot be sliced: a patch is a surface without an inside'
gone patch.png
printf 'scn 1;\npatch skin { }\nobject plate = skin.thicken(0.1) - sphere(0.2);\nscene { plate; }\n' >thick.scn
run 1 "$scn" slice thick.scn
says err 'the object plate cannot be sliced: it is a patch made thick'

# Mistakes of the command line.
run 2 "$scn" slice sphere.scn --plane w=1
says err '--plane wants an axis and where on it, at most 65536 from the origin, as z=0.5, not "w=1"'
run 2 "$scn" slice sphere.scn --plane z=nan
run 2 "$scn" slice sphere.scn --window 1..-1,0..1
says err '--window wants what is across and up, each from less to more'
run 2 "$scn" slice sphere.scn --window 0..1
run 2 "$scn" slice sphere.scn -o sphere.exr
says err 'a slice is a picture whose name ends in .png'
run 2 "$scn" slice sphere.scn --size 0
run 3 "$scn" slice missing.scn
run 3 "$scn" slice missing.vm
says err 'cannot read missing.vm'
printf '_0 twirl\n' >bad.vm
run 1 "$scn" slice bad.vm
says err "bad.vm: line 1: there is no operation 'twirl'"
run 1 "$scn" slice wrong.scn
says err 'angle-unit'
finish
