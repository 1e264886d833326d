// The Vim files in Vim and in Neovim, without a screen.
//
//     node vim.mjs VIM EDITORS SCN SCENES STDLIB
//
// Tested: every word of words.json has a group of its own that is linked to one that colour schemes know, and a name that is no word has
// none; the scenes are highlighted as the .vim-groups files beside them say; no scene of the standard library has anything marked as
// wrong; the options of the ftplugin; that indenting a formatted scene changes nothing, and from no indentation makes the same; gq; :make.
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import {spawnSync} from 'node:child_process';
import {compare, expect, finish, listing, scenes, words} from './shared.mjs';

const [vim, editors, scn, sceneFolder, stdlib] = process.argv.slice(2);
const here = path.dirname(new URL(import.meta.url).pathname);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'scn-vim-'));
process.on('exit', () => fs.rmSync(folder, {recursive: true}));

function run(script, files) {
    const environment = {...process.env, OUT: path.join(folder, 'out'), PATH: `${path.dirname(scn)}:${process.env.PATH}`, HOME: folder};
    fs.rmSync(environment.OUT, {force: true});
    const done = spawnSync(vim, ['-es', '-u', 'NONE', '-i', 'NONE', '-n', '--cmd', `set rtp+=${path.join(editors, 'vim')}`, '-S', script, ...files],
        {env: environment, encoding: 'utf8', timeout: 60000, stdio: ['ignore', 'pipe', 'pipe']});
    expect(!done.error && fs.existsSync(environment.OUT), `${vim} (Debian package ${vim === 'nvim' ? 'neovim' : 'vim'}): ${done.error ?? done.stdout + done.stderr}`);
    if (done.error || !fs.existsSync(environment.OUT)) finish('vim');
    return fs.readFileSync(environment.OUT, 'utf8').split('\n').filter(line => line);
}

function script(name, text) {
    const file = path.join(folder, name);
    fs.writeFileSync(file, text);
    return file;
}

// {file: [{line, column, text, name}]} with columns from 0.
function highlight(files) {
    const pieces = Object.fromEntries(files.map(file => [file, []]));
    const lines = Object.fromEntries(files.map(file => [file, fs.readFileSync(file, 'utf8').split('\n').map(line => Buffer.from(line))]));
    for (const row of run(path.join(here, 'highlight.vim'), files)) {
        const [, file, line, column, name] = row.match(/^(.*):(\d+):(\d+):([^:]*)$/);
        expect(line !== '0', `${file}: ${name}`);
        pieces[file].push({line: line - 1, column: column - 1, name});
    }
    for (const [file, list] of Object.entries(pieces)) {
        for (const [i, piece] of list.entries()) {
            const next = list[i + 1], line = lines[file][piece.line];
            piece.text = line.subarray(piece.column, next?.line === piece.line ? next.column : undefined).toString();
            piece.column = line.subarray(0, piece.column).toString().length;
        }
    }
    return pieces;
}

// A line for each word, as itself, as a member and as an argument.
const all = words(editors);
const wordFile = script('words.scn', all.map(({text}) => `${text}\n`).join('\n') + '\npebble\n');
const otherWords = all.filter(({list}) => list === 'built_in' || list === 'types');
const otherFile = script('others.scn', otherWords.map(({text}) => `f(p.${text}, ${text}: 2)\n`).join(''));
const shown = highlight([wordFile, otherFile, ...scenes(sceneFolder), ...scenes(stdlib)]);
const at = (file, line, column) => shown[file].findLast(p => p.line === line && p.column <= column)?.name;
for (const [i, {word, list, column}] of all.entries()) {
    const name = at(wordFile, 2 * i, column);
    expect(name && !/Bad|Unknown/.test(name), `\`${word}\` of ${list} has the group '${name}'`);
    expect(list !== 'units' || name === 'scnUnit', `the unit ${word} has the group '${name}'`);
}
expect(at(wordFile, 2 * all.length, 0) === '', 'a name that is no word has a group');
for (const [i, {word}] of otherWords.entries()) {
    expect(at(otherFile, i, 4) === 'scnMember', `a member that is called ${word} has the group ${at(otherFile, i, 4)}`);
    expect(at(otherFile, i, 6 + word.length) === 'scnArgument', `an argument that is called ${word} is highlighted as the word`);
}

// What holds others has no colour of its own.
const containers = ['', 'scnParameterList', 'scnInterpolation', 'scnBraces'];
const groups = new Set(Object.values(shown).flat().map(piece => piece.name).filter(name => !containers.includes(name)));
const links = run(script('links.vim', `
    syntax on
    set filetype=scn
    call writefile(map(${JSON.stringify([...groups])}, {_, name -> name .. ' ' .. synIDattr(synIDtrans(hlID(name)), 'name')}), $OUT)
    qall!`), []);
for (const row of links) {
    const [name, end] = row.split(' ');
    expect(end && !end.startsWith('scn'), `${name} is linked to no group of Vim's`);
}

for (const file of scenes(sceneFolder)) compare(file.replace(/scn$/, 'vim-groups'), listing(shown[file]));
for (const file of [...scenes(stdlib), ...scenes(sceneFolder).filter(name => !name.endsWith('mistakes.scn'))]) {
    const wrong = shown[file].find(({name}) => /Bad|Unknown/.test(name));
    expect(!wrong, `${file}:${wrong?.line + 1}: '${wrong?.text}' is marked as wrong`);
}

// The editing: options, indentation, gq, :make.
const sample = path.join(sceneFolder, 'layout.scn');
const text = fs.readFileSync(sample, 'utf8').trimEnd().split('\n');
const bare = script('bare.scn', text.map(line => line.trimStart()).join('\n') + '\n');
const wrong = script('wrong.scn', 'object a = box(1).rotate(y: 90);\nscene{a;}\n');
const edited = run(script('edit.vim', `
    set nocompatible
    filetype plugin indent on
    syntax on
    edit ${bare}
    let out = [&filetype, &commentstring, &formatprg, &shiftwidth . '']
    normal! gg=G
    let out += getline(1, '$')
    let out += ['--']
    edit! ${wrong}
    silent make!
    let out += [join(map(getqflist(), {_, e -> e.lnum . ':' . e.col . ':' . e.type . ':' . e.text}))]
    normal! 2Ggqq
    let out += getline(2, '$')
    call writefile(out, $OUT)
    qall!`), []);
const middle = edited.indexOf('--');
expect(edited.slice(0, 4).join('|') === 'scn|// %s|scn fmt -|4', `the options are ${edited.slice(0, 4).join(', ')}`);
const indented = edited.slice(4, middle), wanted = text.filter(line => line);
for (const [i, line] of wanted.entries()) expect(indented[i] === line, `indented:\n  ${indented[i]}\nnot\n  ${line}`);
expect(/^1:29:e:.* write 90deg, or 90rad \[angle-unit\]$/.test(edited[middle + 1]), `:make found '${edited[middle + 1]}'`);
expect(edited[middle + 2] === 'scene { a; }', `gq made '${edited[middle + 2]}'`);
finish('vim');
