" A level for each line that leaves a bracket open; a closing mark stands below the line that opened it.
if exists('b:did_indent')
  finish
endif
let b:did_indent = 1

setlocal indentexpr=ScnIndent(v:lnum)
setlocal indentkeys=0{,0},0),0],!^F,o,O
let b:undo_indent = 'setlocal indentexpr< indentkeys<'

if exists('*ScnIndent')
  finish
endif

" How many brackets the line leaves open, or closes more than it opens (negative); those in front of the first word do not count, since
" they have already moved this line. Comments and strings are left out, by what the syntax says they are.
function s:Opened(line) abort
  let text = getline(a:line)
  let open = 0
  let column = match(text, '[^ \t})\]]')
  while column >= 0 && column < len(text)
    if text[column] =~# '[(){}[\]]' && synIDattr(synID(a:line, column + 1, 0), 'name') !~# 'Comment\|Doc\|String\|Brace'
      let open += text[column] =~# '[({[]' ? 1 : -1
    endif
    let column += 1
  endwhile
  return open
endfunction

function ScnIndent(line) abort
  let before = prevnonblank(a:line - 1)
  if before == 0
    return 0
  endif
  let opened = s:Opened(before)
  let columns = indent(before) + shiftwidth() * (opened > 0 ? 1 : opened)
  if getline(a:line) =~# '^\s*[})\]]'
    let columns -= shiftwidth()
  endif
  return max([columns, 0])
endfunction
