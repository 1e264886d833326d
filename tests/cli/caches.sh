# The caches of kernels, scn's and the driver's: shared, damaged, on a full disk.
. "$2/lib.sh"

# picture FOLDER OPTION …: of the ball, with its caches in FOLDER.
picture() {
    home=$1
    shift
    run 0 env XDG_CACHE_HOME="$home" "$scn" render ball.scn -o out.png --size 40x30 -q "$@"
}

# Two processes that meet in an empty cache.
last='two processes with one empty cache'
XDG_CACHE_HOME=$work/both "$scn" render ball.scn -o one.png --size 40x30 -q 2>err &
XDG_CACHE_HOME=$work/both "$scn" render ball.scn -o two.png --size 40x30 -q 2>err || wrong 'the second ends well'
wait $! || wrong 'the first ends well'
quiet err
same "$(cksum <one.png)" "$(cksum <two.png)"

# scn's own entries are tested before they are used.
cp -r both own
run 0 env XDG_CACHE_HOME="$work/own" "$scn" build ball.scn -o ball.scnk
for entry in own/scn/*; do head -c 3000 /dev/zero >"$entry"; done
picture "$work/own"
same "$(cksum <one.png)" "$(cksum <out.png)"

# The driver's are not. Those that a machine left empty when it went down are told, with what to delete.
cp -r both damaged
find damaged/pocl -type f -name '*.bc' -exec cp /dev/null {} \;
run 3 env XDG_CACHE_HOME="$work/damaged" "$scn" render ball.scn -o damaged.png --size 40x30 -q
says err "delete the folder $work/damaged/pocl"
gone damaged.png

# On a full disk kernels are compiled elsewhere. Only root can make one.
mkdir full
if mount -t tmpfs -o size=64k tmpfs full 2>err; then
    picture "$work/full"
    same "$(cksum <one.png)" "$(cksum <out.png)"
    run 3 "$scn" render ball.scn -o full/a.exr --size 400x300 --layers all --float
    says err 'full/a.exr: No space left'
    run 3 "$scn" build ball.scn -o full/a.scnk
    says err 'full/a.scnk: No space left'
    same "$(find full -type f | wc -l | tr -d ' ')" 0
    umount full
fi
finish
