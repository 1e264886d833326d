# Help, versions, exit statuses, messages, and the commands that make no picture.
. "$2/lib.sh"

run 0 "$scn"
says out 'Use: scn COMMAND'
run 0 "$scn" help render
says out '--frames A..B'
says out 'Exit status: 0 done; 1 the scene is wrong; 2 the command line is wrong; 3 the world failed'
run 0 "$scn" render --help
says out '--samples N'
run 0 "$scn" --version
says out 'scn '
run 2 "$scn" rendr ball.scn
says err 'do you mean render?'
run 2 "$scn" help rendr
says err 'do you mean render?'
run 2 "$scn" render ball.scn --sice 3x3
says err 'do you mean --size?'
run 2 "$scn" ball.scn
says err 'scn render ball.scn'
run 2 "$scn" check ball.scn --size 3x3
says err 'it is one of render'
run 2 "$scn" render ball.scn -o ball.jpg
says err '.exr or .png'
run 2 "$scn" render ball.scn -o a.png -o a.png
says err 'twice'
run 2 "$scn" render ball.scn -o a.png --layers depth
says err 'PNG'

# A wrong scene: the message has place, code and source line; standard output is empty.
run 1 "$scn" check wrong.scn
says err 'wrong.scn:2:'
says err '[angle-unit]'
says err 'scene { sphere(1).rotate(y: 90); }'
quiet out
run 1 "$scn" render wrong.scn -o wrong.png
gone wrong.png
run 1 "$scn" build wrong.scn
gone wrong.scnk
run 0 "$scn" check ball.scn
quiet out
quiet err
run 1 "$scn" check ball.scn wrong.scn # the worst of both
run 1 "$scn" check --color always wrong.scn
says err "$(printf '\033[')"

# A failing world.
run 3 "$scn" check missing.scn
says err 'missing.scn'
run 3 "$scn" render missing.scn
run 3 "$scn" check .
run 3 "$scn" render ball.scn -o none/a.png --size 8x8
says err 'none/a.png'
run 3 env OCL_ICD_VENDORS=/nonexistent/ "$scn" render ball.scn -o a.png --size 8x8
says err 'pocl-opencl-icd'
gone a.png
run 3 env OCL_ICD_VENDORS=/nonexistent/ "$scn" devices
says err 'pocl-opencl-icd'
run 0 env OCL_ICD_VENDORS=/nonexistent/ "$scn" devices --json
json '. == []' out
run 0 env OCL_ICD_VENDORS=/nonexistent/ "$scn" check ball.scn # needs no device

# Params.
run 2 "$scn" render ball.scn -D rihgt=1 -o a.png
says err 'do you mean right?'
run 2 "$scn" render ball.scn -D turn=90 -o a.png
says err 'turn'
run 2 "$scn" render ball.scn -D right=7 -o a.png
says err 'right'
run 2 "$scn" render ball.scn --camera sied -o a.png
says err 'side'

# A part alone.
printf 'object block = box(4) - cylinder(1).named("drill");\nobject _spare = sphere(1);\nscene { block.move(5, 0, 0).hide(); sphere(9); }\n' > parts.scn
run 0 "$scn" info parts.scn --only drill --json
json '.objects[-1] == "drill"' out
run 0 "$scn" info parts.scn --only _spare --json
json '.objects[-1] == "_spare"' out
run 0 "$scn" render parts.scn --only block --size 64x64 -o a.png
run 2 "$scn" render parts.scn --only dril -o a.png
says err 'do you mean drill?'
run 2 "$scn" render parts.scn --only zebra -o a.png
says err 'scn tree'
run 0 "$scn" build parts.scn --source --only block -o parts.scnk
run 2 "$scn" info parts.scnk --only block
says err 'scn build --only block'

# Information.
run 0 "$scn" info ball.scn
says out 'How far it is to the right.'
says out '1 s, 8 frames at 8 a second'
run 0 "$scn" info ball.scn --json
json '.params | length == 3' out
json '.params[0].name == "right" and .params[0].high == 2 and (.params[0].structure | not)' out
json '.params[2].structure' out
json '.frames == 8 and .fps == 8 and .duration_s == 1' out
json '.objects | index("ball") != null' out
json '.quadrics == 2 and .lights == 1 and (.package | not) and (.camera.automatic | not)' out
run 0 "$scn" info ball.scn -D right=1.5 --json
json '.params[0].value == 1.5' out
run 0 "$scn" devices --json
json 'length >= 1 and .[0].number == 0 and (.[0].compute_units >= 1)' out
run 0 "$scn" explain angle-unit
says out 'angle'
run 0 "$scn" explain
says out 'angle-unit'
run 2 "$scn" explain angel-unit
says err 'do you mean angle-unit?'

# What the compiler makes of it.
run 0 "$scn" dump --kernel ball.scn
says out 'kernel'
cp out first
run 0 "$scn" dump --kernel ball.scn
same "$(cksum <first)" "$(cksum <out)"
run 0 "$scn" dump --ir ball.scn
says out 'quadric'
run 0 "$scn" dump --ast ball.scn
run 2 "$scn" dump --after nonsense ball.scn
run 2 "$scn" dump ball.scn
run 0 "$scn" dump --after list ball.scn

# Measuring.
run 0 "$scn" bench ball.scn --size 64x64 --repeat 3 --threads 1 --json
json '.cpu_ms > 0 and .wall_ms > 0 and .rays_per_s > 0 and .kernel_builds <= 1 and .peak_memory_bytes > 0 and .start_up_ms > 0' out
json '.rays_per_frame >= 4096' out
run 0 "$scn" bench ball.scn --size 64x64 --repeat 2
says out 'ms CPU'

# A scene from standard input.
last='scn check -'
printf 'scn 1;\nscene { sphere(1).rotat(y: 9deg); }\n' | "$scn" check - 2>err
says err 'do you mean rotate'

# A scene from a pipe: what is read is not lost, and what the OpenCL compiler thinks of a kernel is nobody's business.
last='a pipe'
printf 'scn 1;\nscene { sphere(1).rotat(y: 9deg); }\n' | "$scn" check /dev/stdin 2>err
says err 'do you mean rotate'
printf 'scn 1;\nscene { field(1 - x^2 - y^2 - z^2); }\n' | "$scn" render -q --size 32x32 -o field.png - 2>err
there field.png
quiet err

# Standard output that is full is told.
if [ -c /dev/full ]; then
    status=0
    "$scn" help >/dev/full 2>err || status=$?
    same "$status" 3
    says err 'standard output'
    status=0
    "$scn" check --error-format json wrong.scn >/dev/full 2>err || status=$?
    same "$status" 1
    says err 'standard output'
fi

# A model is imported first.
printf '_0 var-x\n' >model.vm
run 2 "$scn" render model.vm
says err 'scn import model.vm'
run 0 "$scn" import model.vm

# Standard input has a name in messages.
run 0 "$scn" check -
says err '<stdin>:1'

# --help of a command speaks of that command.
run 0 "$scn" build --help
says out '.scnk'
if grep -q '####' out; then wrong 'build makes no frames'; fi
run 0 "$scn" doc --help
says out '.html'
run 0 "$scn" version --help
same "$(head -n 1 out)" 'scn version'
finish
