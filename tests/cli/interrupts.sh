# Ctrl-C ends the command at once and leaves no partial file; a broken pipe and a missing terminal are no trouble.
. "$2/lib.sh"

# stops SIGNAL STATUS SECONDS OPTION …: within 100 ms. A machine that is busy may take longer to notice, so it has ten tries.
stops() {
    for try in 1 2 3 4 5 6 7 8 9 10; do
        interrupted "$@"
        [ "$took" -le 100 ] && return
    done
    wrong "end within 100 ms, not $took ms, in $try tries"
}

# interrupted SIGNAL STATUS SECONDS OPTION …: starts a long rendering, sends the signal after SECONDS, measures how long it takes to end.
interrupted() {
    signal=$1
    wanted=$2
    pause=$3
    shift 3
    last="$* interrupted by $signal after $pause s"
    # A shell makes background commands ignore SIGINT, so the command is started by env, which can take that back.
    env --default-signal=INT "$scn" "$@" >out 2>err &
    process=$!
    sleep "$pause"
    begin=$(date +%s%N)
    kill -s "$signal" $process 2>err || wrong "still running when it is to be stopped"
    status=0
    wait $process || status=$?
    took=$((($(date +%s%N) - begin) / 1000000))
    same "$status" "$wanted"
    same "$(find . -name '.*part' | wc -l | tr -d ' ')" 0
}

# Kernels of both kinds are in a cache from here on.
run 0 "$scn" render ball.scn -o warm.exr --size 64x64 -q --kernels quick
run 0 "$scn" render ball.scn -o warm.exr --size 64x64 -q --kernels full

stops INT 130 0.7 render ball.scn -o large.exr --size 8192x8192 --samples 16 -q
gone large.exr
stops TERM 143 0.7 render ball.scn -o large.exr --size 8192x8192 --samples 16 -q
gone large.exr
# While a large file is written: many layers that take long to compress.
stops INT 130 1.5 render ball.scn -o large.exr --size 3000x3000 --layers all --float -q
gone large.exr
# In an animation the frames that are done stay.
stops INT 130 2 render ball.scn -o frame.exr --frames 0..100000 --size 640x480 -q
there frame.0000.exr
# While kernels are built.
stops INT 130 0.3 render ball.scn -o cold.exr --size 64x64 -q --no-cache --lanes 1

# Messages for a reader that has gone end it quietly.
last='info | true'
"$scn" info ball.scn --json | true

# In a pipe there is no progress line.
run 0 "$scn" render ball.scn --frames 0..3 -o a.png --size 32x32
same "$(grep -c "$(printf '\r')" err)" 0
finish
