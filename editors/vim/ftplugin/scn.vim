" What Vim needs to know of SCN: comments, `gq` by scn fmt, `gf` and `:find` on includes, `:make` by scn check.
if exists('b:did_ftplugin')
  finish
endif
let b:did_ftplugin = 1

setlocal commentstring=//\ %s
setlocal comments=s1:/*,mb:*,ex:*/,:///,://
setlocal formatoptions-=t formatoptions+=croql
setlocal suffixesadd=.scn
setlocal include=^\\s*\\%(include\\s*\"\\\|use\\s\\+\\)\\zs[^\";:\ ]\\+
setlocal define=^\\s*\\%(fn\\\|tag\\\|tool\\\|let\\\|param\\)\\>
setlocal expandtab shiftwidth=4 softtabstop=4
if executable('scn')
  setlocal formatprg=scn\ fmt\ -
endif
compiler scn

let b:undo_ftplugin = 'setlocal commentstring< comments< formatoptions< suffixesadd< include< define<'
      \ . ' expandtab< shiftwidth< softtabstop< formatprg< makeprg< errorformat<'
