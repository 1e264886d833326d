" Writes, for each file that the command line names, a line FILE:LINE:COLUMN:GROUP wherever the group of syntax changes, to $OUT.
" Columns are bytes, from 1. Run by vim.mjs: vim -es -u NONE -i NONE --cmd 'set rtp+=…' -S highlight.vim FILE …
set nocompatible
filetype plugin indent on
syntax on

let s:out = []
for s:file in argv()
  execute 'edit' fnameescape(s:file)
  if &filetype !=# 'scn'
    call add(s:out, s:file . ':0:0:not detected as scn')
  endif
  for s:line in range(1, line('$'))
    let s:last = ''
    for s:column in range(1, col([s:line, '$']) - 1)
      let s:group = synIDattr(synID(s:line, s:column, 1), 'name')
      if s:column == 1 || s:group !=# s:last
        call add(s:out, join([s:file, s:line, s:column, s:group], ':'))
      endif
      let s:last = s:group
    endfor
  endfor
endfor
call writefile(s:out, $OUT)
qall!
