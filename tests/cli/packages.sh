# scn build and scn run: packages that need no sources and no compiler, the same bytes for the same scene, refused when they are not whole.
. "$2/lib.sh"

mkdir -p src/parts
printf 'object stone = box(0.5).move(1, 0, 0);\n' >src/parts/stone.scn
sed 's|^scene .*|include "parts/stone.scn";\nscene { ball.move(right, 0, 0); stone; }|' ball.scn >src/main.scn
run 0 "$scn" build src/main.scn -o main.scnk
there main.scnk
says err 'main.scnk'
run 0 "$scn" render src/main.scn -o source.exr --size 120x90 --layers all -q
mv src away

# Elsewhere, without sources, without any cache and without a compiler: nothing is built.
mkdir empty
run 0 env XDG_CACHE_HOME="$work/none" POCL_CACHE_DIR="$work/empty" "$scn" run main.scnk -o package.exr --size 120x90 --layers all -q --stats stats.json
same "$(cksum <source.exr)" "$(cksum <package.exr)"
json '.kernel_builds == 0 and .kernel_from == "package"' stats.json
run 0 "$scn" info main.scnk --json
json '.package and (.binaries | length == 1) and .scene == "main.scn" and (.params | length == 3)' out
run 0 "$scn" run main.scnk -D right=1 --frames 0..1 --size 16x16 -o moved.png
there moved.0000.png moved.0001.png
run 2 "$scn" run main.scnk -D level=3 -o a.png
says err 'level'
run 2 "$scn" run ball.scn -o a.png
says err 'scn render'
run 2 "$scn" build main.scnk -o again.scnk
run 2 "$scn" build ball.scn -o ball.zip
says err '.scnk'

# A package for another device, or for none: the source is built.
run 0 "$scn" build ball.scn -o source.scnk --source
run 0 "$scn" run source.scnk -o a.png --size 16x16 -q --no-cache --stats stats.json
json '.kernel_from == "source"' stats.json
run 0 "$scn" run main.scnk --lanes 1 -o b.png --size 16x16 -q --no-cache --stats stats.json
json '.kernel_from == "source"' stats.json
run 0 env OCL_ICD_VENDORS=/nonexistent/ "$scn" build ball.scn -o again.scnk --source

# The same bytes, from wherever it is built.
run 0 "$scn" build ball.scn -o again.scnk --source
same "$(cksum <source.scnk)" "$(cksum <again.scnk)"
mkdir there
cp ball.scn there
run 0 "$scn" build "$work/there/ball.scn" -o again.scnk --source
same "$(cksum <source.scnk)" "$(cksum <again.scnk)"
run 0 "$scn" build ball.scn -o one.scnk
run 0 "$scn" build ball.scn -o two.scnk --no-cache
same "$(cksum <one.scnk)" "$(cksum <two.scnk)"

# Errors of a frame have places without any source.
printf 'scn 1;\nparam r: scalar = 1;\nassert r < 2,\n  "too big";\nscene { sphere(r); }\n' >guard.scn
run 0 "$scn" build guard.scn
there guard.scnk
rm guard.scn
run 0 "$scn" run guard.scnk -o a.png --size 8x8 -q
run 1 "$scn" run guard.scnk -o b.png --size 8x8 -D r=3
says err 'guard.scn:3:'
says err 'too big'

# Without a home, and with one that cannot be written (root can write all but what is no folder).
: >home
run 0 env -u HOME -u XDG_CACHE_HOME "$scn" run one.scnk -o a.png --size 8x8 -q
run 0 env -u XDG_CACHE_HOME HOME="$work/home" "$scn" run one.scnk -o a.png --size 8x8 -q

# Refused, each with its reason.
size=$(wc -c <source.scnk)
head -c $((size / 2)) source.scnk >cut.scnk
run 3 "$scn" run cut.scnk
says err 'cut off'
head -c 20 source.scnk >cut.scnk
run 3 "$scn" run cut.scnk
says err 'cut off'
cp source.scnk damaged.scnk
printf 'x' | dd of=damaged.scnk bs=1 seek=$((size - 40)) conv=notrunc 2>dd.log
run 3 "$scn" run damaged.scnk
says err 'damaged'
cp source.scnk newer.scnk
printf '\377' | dd of=newer.scnk bs=1 seek=8 conv=notrunc 2>dd.log
run 3 "$scn" info newer.scnk
says err 'newer'
sed 's/$/\r/' source.scnk >text.scnk
run 3 "$scn" run text.scnk
run 3 "$scn" run missing.scnk
says err 'missing.scnk'
: >empty.scnk
run 3 "$scn" run empty.scnk
says err 'it is no package of scn'
printf '\211PNG\r\n\032\n\0\0\0\rIHDR' >picture.scnk
for command in run info check; do
    run 3 "$scn" "$command" picture.scnk
    says err 'cannot use picture.scnk: it is no package of scn'
    same 1 "$(wc -l <err)"
done
cp picture.scnk picture.png
run 2 "$scn" run picture.png -o a.png
same 1 "$(wc -l <err)"
cat source.scnk ball.scn >longer.scnk
run 3 "$scn" run longer.scnk
says err 'after its end'
finish
