// The TextMate grammar in the engine of VS Code.
//
//     node textmate.mjs NODE_MODULES EDITORS SCN SCENES STDLIB
//
// Tested: every word of words.json has a scope of its own, and a name that is no word has none; the scenes are highlighted as the
// .textmate files beside them say; no scene of the standard library has anything marked as wrong, and each ends outside of strings and
// comments (only mistakes.scn is wrong, on purpose); what package.json names is there; each snippet, filled in with its own examples, is a scene without an error.
import fs from 'node:fs';
import path from 'node:path';
import {createRequire} from 'node:module';
import {compare, check, expect, finish, listing, scenes, words} from './shared.mjs';

const [modules, editors, scn, sceneFolder, stdlib] = process.argv.slice(2);
const require = createRequire(path.join(modules, 'x.js'));
const oniguruma = require('vscode-oniguruma'), textmate = require('vscode-textmate');
const extension = path.join(editors, 'vscode');
const manifest = JSON.parse(fs.readFileSync(path.join(extension, 'package.json'), 'utf8'));
const grammarFile = path.join(extension, manifest.contributes.grammars[0].path);

const wasm = fs.readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm'));
await oniguruma.loadWASM(wasm.buffer.slice(wasm.byteOffset, wasm.byteOffset + wasm.byteLength));
const registry = new textmate.Registry({
    onigLib: Promise.resolve({
        createOnigScanner: sources => new oniguruma.OnigScanner(sources),
        createOnigString: text => new oniguruma.OnigString(text),
    }),
    loadGrammar: async scope => scope === 'source.scn'
        ? textmate.parseRawGrammar(fs.readFileSync(grammarFile, 'utf8'), grammarFile) : null,
});
const grammar = await registry.loadGrammar('source.scn');

// The pieces of a text with the scopes inside of source.scn, and how deep what is open at the end is nested.
function highlight(text) {
    const pieces = [];
    let state = textmate.INITIAL;
    for (const [line, content] of text.split('\n').entries()) {
        const result = grammar.tokenizeLine(content, state);
        for (const token of result.tokens) {
            const name = token.scopes.slice(1).map(scope => scope.replace(/\.scn$/, '')).join(' ');
            pieces.push({line, column: token.startIndex, text: content.slice(token.startIndex, token.endIndex), name});
        }
        state = result.ruleStack;
    }
    return {pieces, depth: state.depth};
}

function nameAt(text, column) {
    return highlight(text).pieces.findLast(piece => piece.column <= column).name;
}

for (const {text, column, word, list} of words(editors)) {
    const name = nameAt(text, column);
    expect(name && !name.includes('invalid'), `\`${word}\` of ${list} has the scope '${name}'`);
    expect(list !== 'units' || name.includes('unit'), `the unit ${word} has the scope '${name}'`);
    if (list !== 'built_in' && list !== 'types') continue;
    expect(nameAt(`p.${word}`, 2) === 'variable.other.member', `a member that is called ${word} is highlighted as the word`);
    expect(nameAt(`f(${word}: 2)`, 2) === 'variable.parameter', `an argument that is called ${word} is highlighted as the word`);
}
expect(nameAt('pebble', 0) === '', 'a name that is no word has a scope');

for (const file of scenes(sceneFolder)) {
    const {pieces} = highlight(fs.readFileSync(file, 'utf8'));
    compare(file.replace(/scn$/, 'textmate'), listing(pieces));
}
for (const file of [...scenes(stdlib), ...scenes(sceneFolder).filter(name => !name.endsWith('mistakes.scn'))]) {
    const {pieces, depth} = highlight(fs.readFileSync(file, 'utf8'));
    const wrong = pieces.find(piece => piece.name.includes('invalid'));
    expect(!wrong, `${file}:${wrong?.line + 1}: '${wrong?.text}' is marked as wrong`);
    expect(depth === 1, `${file}: at the end something is still open`);
}

const {languages, grammars, snippets, problemMatchers} = manifest.contributes;
for (const named of [languages[0].configuration, ...grammars.map(g => g.path), ...snippets.map(s => s.path)])
    expect(fs.existsSync(path.join(extension, named)), `${named} of package.json is not there`);
const configuration = JSON.parse(fs.readFileSync(path.join(extension, languages[0].configuration), 'utf8'));
for (const pattern of [...Object.values(configuration.indentationRules), configuration.wordPattern, problemMatchers[0].pattern.regexp])
    new RegExp(pattern); // throws for one that is none
const message = 'parts/eye.scn:4:17: error: an angle needs a unit: write 90deg [angle-unit]';
const found = message.match(problemMatchers[0].pattern.regexp);
expect(found && found.slice(1, 5).join() === 'parts/eye.scn,4,17,error' && found[6] === 'angle-unit', 'a message is not understood');

// ${1:example} is its example, $1 what stood there first, $0 nothing. Examples nest, the innermost is replaced first.
function fillIn(body) {
    const examples = {};
    let text = [body].flat().join('\n');
    for (let before; before !== text;) {
        before = text;
        text = text.replace(/\$\{(\d+):([^${}]*)\}/, (_, number, example) => (examples[number] ??= example));
        text = text.replace(/\$\{(\d+)\}/, (all, number) => examples[number] ?? all);
    }
    return text.replace(/\$(\d+)/g, (_, number) => examples[number] ?? '');
}

for (const {path: file} of snippets) {
    for (const [name, {body}] of Object.entries(JSON.parse(fs.readFileSync(path.join(extension, file), 'utf8')))) {
        const text = fillIn(body);
        const shown = name === 'A whole scene' || name === 'Loop' ? '' : '\nsphere(0.5);\n';
        check(scn, text + shown, `the snippet '${name}'`);
    }
}
finish('textmate');
