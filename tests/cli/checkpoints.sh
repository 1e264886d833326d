# Checkpoints of patches: parts of an animation, rendered apart, are those of running through, bit by bit.
. "$2/lib.sh"

cat >flag.scn <<'END'
scn 1;
param wind: scalar = 200 in 0..1000;
camera { eye: (0.5, -2.2, 1.6); look_at: (0.5, 0.5, 0); up: (0, 0, 1); fov: 40deg; }
light { direction: (0.3, 0.5, -1); }
animation { duration: 1s; fps: 10; }
patch flag { grid: 17; force: (0, 0, wind * sin(360deg * u + 720deg * time / 1s)); }
flag.paint(#a0b070);
END
film="--size 48x48 -q"

# The whole film, without any checkpoint: the truth. --no-cache leaves nothing in the cache, of kernels or of patches.
run 0 "$scn" render flag.scn -o "whole-##.png" --frames 0..9 $film --no-cache
gone cache/scn

# One machine fills the folder; others, which have a copy of it and nothing else, render their parts.
run 0 "$scn" render flag.scn -o filled.png --time 900ms $film --checkpoints farm --no-cache
run 0 cmp filled.png whole-09.png
gone cache/scn
same "$(ls farm | wc -l)" 3
cp -r farm shard
run 0 "$scn" render flag.scn -o "part-##.png" --frames 7..8 $film --checkpoints shard --no-cache
quiet err
run 0 cmp part-07.png whole-07.png
run 0 cmp part-08.png whole-08.png
same "$(ls shard)" "$(ls farm)"

# A package finds what its scene has left, and the solver alone fills the folder as well.
run 0 "$scn" build flag.scn -o flag.scnk --source -q
run 0 "$scn" patch flag.scn --solver device --times 900ms --checkpoints solved
same "$(ls solved)" "$(ls farm)"
run 0 "$scn" run flag.scnk -o run.png --time 800ms $film --checkpoints solved --no-cache
run 0 cmp run.png whole-08.png
same "$(ls solved)" "$(ls farm)"

# Other params and another solver have checkpoints of their own.
run 0 "$scn" patch flag.scn --solver device --times 300ms -D wind=100 --checkpoints solved
same "$(ls solved | wc -l)" 4
run 0 "$scn" patch flag.scn --solver direct --times 300ms --checkpoints solved
same "$(ls solved | wc -l)" 5

# What is cut or changed is refused with its file and the reason; the picture is the same, and the file is whole again.
spoil() { printf '\377' | dd of="$1" bs=1 seek=2000 conv=notrunc 2>dd.err; }
newest=$(ls shard/*-768)
spoil "$newest"
run 0 "$scn" render flag.scn -o again.png --time 900ms $film --checkpoints shard --no-cache
says err "1 checkpoint of patches could not be used: $newest: the checkpoint of the patch is damaged"
run 0 cmp again.png whole-09.png
run 0 "$scn" render flag.scn -o again.png --time 900ms $film --checkpoints shard --no-cache
quiet err
spoil "$newest"
truncate -s 100 "$(ls shard/*-512)"
run 0 "$scn" render flag.scn -o again.png --time 900ms $film --checkpoints shard --no-cache
says err "2 checkpoints of patches could not be used"
says err "-512: the checkpoint of the patch is damaged"
run 0 cmp again.png whole-09.png
for file in shard/*; do truncate -s 3 "$file"; done
run 0 "$scn" patch flag.scn --solver device --times 900ms --checkpoints shard
says err "3 checkpoints of patches could not be used"
says err "it is too short"

# A folder that cannot be one is said so; one that cannot be written is read.
touch file
run 3 "$scn" render flag.scn -o no.png $film --checkpoints file/inside
says err "cannot make the folder for checkpoints file/inside: Not a directory"
run 3 "$scn" patch flag.scn --checkpoints file/inside
says err "cannot make the folder for checkpoints"
chmod a-w farm
run 0 "$scn" render flag.scn -o read.png --time 900ms $film --checkpoints farm --no-cache
run 0 cmp read.png whole-09.png
finish
