# The formatter from outside. Called as `sh fmt.sh SCN FOLDER`; the goldens of the folder are NAME.scn and what becomes of it, NAME.out. With
# UPDATE=1 in the environment they are written anew.
folder=$2
. "$folder/../cli/lib.sh"

# Goldens, each formatted once more.
for scene in "$folder"/*.scn; do
    golden=${scene%.scn}.out
    last="$scn fmt - <$scene"
    "$scn" fmt - <"$scene" >formatted || wrong "$scene is formatted"
    [ "${UPDATE:-}" != 1 ] || cp formatted "$golden"
    diff -u "$golden" formatted || wrong "$golden is what becomes of $scene"
    "$scn" fmt --check - <formatted || wrong "$golden stays as it is"
done

# In place: only what changes is written, through links, with its permissions.
cp "$folder/blocks.scn" a.scn
chmod 640 a.scn
ln -s a.scn link.scn
run 1 "$scn" fmt --check a.scn
says out a.scn
cmp -s a.scn "$folder/blocks.scn" || wrong 'a.scn untouched by --check'
run 0 "$scn" fmt link.scn
quiet out
quiet err
cmp -s a.scn "$folder/blocks.out" || wrong 'a.scn formatted through the link'
[ -L link.scn ] || wrong 'the link is a link still'
same "$(stat -c %a a.scn)" 640
touch -d '2001-02-03' a.scn
before=$(stat -c %Y a.scn)
run 0 "$scn" fmt a.scn
same "$(stat -c %Y a.scn)" "$before"
run 0 "$scn" fmt --check a.scn
quiet out

# What changes, as a patch.
cp "$folder/lists.scn" b.scn
run 0 "$scn" fmt --diff b.scn
says out '--- b.scn'
says out '-let a=[1,2,'
says out '+let a = [1, 2, 3, 4];'
cmp -s b.scn "$folder/lists.scn" || wrong 'b.scn untouched by --diff'
run 1 "$scn" fmt --check --diff b.scn
says out '+++ b.scn'

# Broken files are refused and stay as they are; the others are formatted.
printf 'object a = (1;\n' >broken.scn
printf 'a  ;\n' >good.scn
cp broken.scn copy.scn
run 1 "$scn" fmt broken.scn good.scn
says err '[unclosed]'
cmp -s broken.scn copy.scn || wrong 'broken.scn untouched'
same "$(cat good.scn)" 'a;'
run 1 sh -c "'$scn' fmt - <broken.scn"
quiet out
# A scene that is wrong in its meaning is one all the same.
printf 'sphere( 1 ).rotate( y:90 );\n' >meaning.scn
run 0 "$scn" fmt meaning.scn
same "$(cat meaning.scn)" 'sphere(1).rotate(y: 90);'

# Lines alone.
printf 'let  a=1;\nlet  b=2;\nlet  c=3;\n' >lines.scn
run 0 "$scn" fmt --lines 2..2 lines.scn
same "$(cat lines.scn)" "$(printf 'let  a=1;\nlet b = 2;\nlet  c=3;')"
run 2 "$scn" fmt --lines 3..2 lines.scn
says err 'counts up'
run 2 "$scn" fmt --lines 0..2 lines.scn
run 2 "$scn" fmt --lines 1..2 lines.scn good.scn
says err 'one file'

run 0 "$scn" fmt --lines 3:3 lines.scn
same "$(sed -n 3p lines.scn)" 'let c = 3;'

# Folders: all scenes below, but nothing hidden and no folder behind a link.
mkdir -p tree/deep/.hidden tree/empty
for file in tree/b.scn tree/a.scn tree/deep/c.scn tree/deep/.hidden/d.scn tree/text.txt; do printf 'a  ;\n' >"$file"; done
ln -s .. tree/deep/loop
run 1 "$scn" fmt --check tree
same "$(cat out)" "$(printf 'tree/a.scn\ntree/b.scn\ntree/deep/c.scn')"
run 0 "$scn" fmt tree/
run 0 "$scn" fmt --check tree
same "$(cat tree/deep/c.scn tree/deep/.hidden/d.scn tree/text.txt)" "$(printf 'a;\na  ;\na  ;')"
run 3 "$scn" fmt tree/empty
says err 'no scene'
run 2 "$scn" fmt --lines 1..2 tree

# A comment behind a word belongs to the line of the word.
printf 'let  a = 1; // one\nlet  b = 2;   // two\nsphere( a + b );\n' >behind.scn
run 0 "$scn" fmt --lines 2..2 behind.scn
printf 'let  a = 1; // one\nlet b = 2;  // two\nsphere( a + b );\n' | cmp -s - behind.scn || wrong 'line 2 alone'

# The world.
run 2 "$scn" fmt
run 3 "$scn" fmt missing.scn
says err 'missing.scn'
printf 'a  ;\n' >locked.scn
chmod 444 locked.scn
if [ ! -w locked.scn ]; then
    run 3 "$scn" fmt locked.scn
    says err 'cannot write'
fi
finish
