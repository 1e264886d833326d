// What both tests of highlighting have in common: places of failure, the words of the language, and pictures of highlighted text.
import fs from 'node:fs';
import path from 'node:path';
import {spawnSync} from 'node:child_process';

let failures = 0;

export function expect(condition, message) {
    if (condition) return;
    failures++;
    console.log(`FAILED: ${message}`);
}

export function finish(what) {
    console.log(`${what}: ${failures} failures`);
    process.exit(failures ? 1 : 0);
}

// Every word of words.json as [text to highlight, column of the word, kind]. A unit is one behind a number only.
export function words(folder) {
    const json = JSON.parse(fs.readFileSync(path.join(folder, 'words.json'), 'utf8'));
    return Object.entries(json).flatMap(([list, entries]) => entries.map(({word, kind}) =>
        ({text: list === 'units' ? `1${word}` : word, column: list === 'units' ? 1 : 0, word, list, kind})));
}

export function scenes(folder) {
    return fs.readdirSync(folder, {recursive: true}).filter(name => name.endsWith('.scn')).sort().map(name => path.join(folder, name));
}

// Compares highlighted text with the file that was looked at; UPDATE=1 writes the file anew.
export function compare(file, text) {
    if (process.env.UPDATE) return fs.writeFileSync(file, text);
    const wanted = fs.existsSync(file) ? fs.readFileSync(file, 'utf8') : '';
    if (wanted === text) return;
    const have = text.split('\n'), want = wanted.split('\n');
    const line = have.findIndex((t, i) => t !== want[i]);
    expect(false, `${file}:${line + 1}: is\n  ${have[line]}\nnot\n  ${want[line]}\n(UPDATE=1 writes it anew)`);
}

// One line for each piece that has a scope or group: place, text, name. Pieces: [{line, column, text, name}], columns from 0.
export function listing(pieces) {
    const rows = pieces.filter(p => p.name && p.text.trim())
        .map(p => [`${p.line + 1}:${p.column + 1}`.padEnd(6), p.text.trim().padEnd(24), p.name].join(' '));
    return rows.join('\n') + '\n';
}

export function check(scn, text, name) {
    const file = path.join(fs.mkdtempSync(path.join(process.cwd(), 'snippet-')), 'a.scn');
    fs.writeFileSync(file, text);
    const run = spawnSync(scn, ['check', file], {encoding: 'utf8'});
    fs.rmSync(path.dirname(file), {recursive: true});
    expect(run.status === 0, `${name}: scn check says\n${run.stderr}${run.stdout}`);
}
