" `:make` runs scn check on the file and fills the list of errors.
if exists('current_compiler')
  finish
endif
let current_compiler = 'scn'

CompilerSet makeprg=scn\ check\ %:S
CompilerSet errorformat=%f:%l:%c:\ %trror:\ %m,%f:%l:%c:\ %tarning:\ %m,%-G%.%#
