# Stills, animations, layers, formats, statistics.
. "$2/lib.sh"

run 0 "$scn" render ball.scn -o a.exr -o a.png --size 80x60 --layers color,depth,normal,position,id --stats stats.json
there a.exr a.png
says err 'a.exr, a.png: 80x60'
quiet out
json '.frames == 1 and .width == 80 and .rays >= 4800 and .kernel_builds <= 1 and .frame_ms_median > 0' stats.json
run 0 exrheader a.exr
says out 'Z, 32-bit floating-point'
says out 'N.X, 16-bit floating-point'
says out 'P.X, 32-bit floating-point'
says out 'id, 32-bit unsigned integer'
says out 'CryptoObject00.R, 32-bit floating-point'
says out 'scn/scene (type string): "ball.scn"'
says out '(0 0) - (79 59)'
run 0 "$scn" render ball.scn -o f.exr --size 16x16 --float -q
quiet err
run 0 exrheader f.exr
says out 'R, 32-bit floating-point'

# The same picture twice, whatever the number of threads.
run 0 "$scn" render ball.scn -o one.exr --size 200x150 --threads 1 -q --layers all
run 0 "$scn" render ball.scn -o two.exr --size 200x150 --threads 2 -q --layers all
same "$(cksum <one.exr)" "$(cksum <two.exr)"

# Kernels that were built quickly give the same picture.
run 0 "$scn" render ball.scn -o quick.exr --size 200x150 -q --layers all --kernels quick --no-cache --stats stats.json
json '.kernel_quick' stats.json
run 0 "$scn" render ball.scn -o full.exr --size 200x150 -q --layers all --kernels full --stats stats.json
json '.kernel_quick | not' stats.json
same "$(cksum <quick.exr)" "$(cksum <full.exr)"
run 2 "$scn" render ball.scn --kernels slow
says err 'auto, quick or full'

# Without -o: the scene's name, here.
mkdir elsewhere
cp ball.scn elsewhere/thing.scn
run 0 "$scn" render elsewhere/thing.scn --size 16x16
there thing.png
says err 'thing.png'

# Time, camera, params and samples change the picture.
for change in '--time 0.5s' '--time 4f' '--camera side' '-D right=0.5' '-D turn=45deg' '--samples 2'; do
    # Word splitting is wanted.
    # shellcheck disable=SC2086
    run 0 "$scn" render ball.scn -o changed.exr --size 80x60 -q $change
    [ "$(cksum <changed.exr)" != "$(cksum <a.exr)" ] || wrong "another picture with $change"
    cp changed.exr "changed$(printf %s "$change" | tr -c 'a-z0-9' _).exr"
done
same "$(exrheader changed__time_4f.exr | grep -c 'scn/frame (type int): 4')" 1
same "$(exrheader changed__time_0_5s.exr | grep -c 'scn/time (type double): 0.5')" 1
run 2 "$scn" render ball.scn --time soon -o a.png
says err '1.5s, 300ms or 12f'

# Animations: numbers in the names, all frames with one build of the kernels.
run 0 "$scn" render ball.scn --frames 2..4 -o out.exr -o 'dir.##.png' --size 32x32 --stats stats.json
there out.0002.exr out.0003.exr out.0004.exr dir.02.png dir.04.png
gone out.0001.exr out.0005.exr out.exr
says err '3 frames'
json '.frames == 3 and .kernel_builds <= 1' stats.json
run 0 "$scn" render ball.scn --time 3f -o still.exr --size 32x32 -q
same "$(cksum <still.exr)" "$(cksum <out.0003.exr)"
run 0 "$scn" render ball.scn --frames all -o all.png --size 8x8 -q
there all.0000.png all.0007.png
gone all.0008.png
# Whatever moves, and however: keys of everything, morphs of different topology, curves, random numbers.
cat >moves.scn <<'EOF'
use easing: bounce;
param lift: scalar = 1;
animation { duration: 2s; fps: 4; }
camera { eye: keys(time) { 0s: (0, 1, 8); 2s: (3, 1, 7) smooth; }; }
light key { at: (2, 4, 3); direction: (-1, -2, -1); cone: keys(time) { 0s: 40deg; 2s: 90deg; }; intensity: 0.5 + random(frame); }
object lump = freeform(sphere(1)) { bump(at: spline([(0, 0, 1), (1, 0, 1), (1, 1, 0)], time / 2s), radius: 0.4, height: 0.2); };
keys(time, after: "loop") { 0s: box(1); 0.6s: lump bounce; 1.2s: sphere(0.8) - cylinder(0.3) smooth; 1.8s: box(1); }
    .move(0, lift * noise((time / 1s, 0.5, 0.5)), 0)
    .paint(keys(time) { 0s: material(color: #f00); 2s: material(color: #00f, specular: 1); });
EOF
run 0 "$scn" render moves.scn --frames all -o moves.png --size 32x32 --stats stats.json -q
json '.frames == 8 and .kernel_builds <= 1' stats.json
same "$("$scn" dump --kernel moves.scn -D lift=3 | cksum)" "$("$scn" dump --kernel moves.scn | cksum)"
run 0 "$scn" render ball.scn --frames 5 -o five.png --size 8x8 -q
there five.0005.png

# Rays one by one give the same picture as packets, but for rounding.
run 0 "$scn" render ball.scn -o lanes.exr --size 80x60 --lanes 1 -q --layers id
run 0 "$scn" render ball.scn -o packet.exr --size 80x60 --lanes 16 -q --layers id
there lanes.exr packet.exr

# A full disk leaves nothing and is told with the file's name.
last='render with a limit on file sizes'
(
    ulimit -f 2048 # 1 MB: room for what the driver writes
    status=0
    "$scn" render ball.scn -o big.exr -q --size 1000x800 --layers all --float 2>err || status=$?
    exit $status
)
same $? 3
says err 'big.exr'
gone big.exr
same "$(find . -name '.*part' | wc -l | tr -d ' ')" 0

# A frame that cannot be computed says where, and leaves the frames before it.
printf 'scn 1;\nanimation { duration: 1s; fps: 4; }\nlet r = 1 / (2 - frame);\nscene { sphere(abs(r)); }\n' >late.scn
run 1 "$scn" render late.scn --frames 0..3 -o late.png --size 16x16
says err 'late.scn:3:'
there late.0001.png
gone late.0002.png late.0003.png
finish
