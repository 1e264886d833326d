// node sarif.mjs NODE_MODULES SCN
//
// What `--error-format sarif` writes is valid by the schema of SARIF 2.1.0, whatever command writes it, and true in what no schema says: rules
// stand where results point, and places are those of the file. A schema that lets everything pass would show: broken documents are refused.
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { createRequire } from "node:module";
import path from "node:path";

const [modules, scn] = process.argv.slice(2).map((name) => path.resolve(name));
const require = createRequire(path.join(modules, "of-the-tests.js"));
const Ajv = require("ajv");
const read = (name) => JSON.parse(readFileSync(require.resolve(name), "utf8"));
const ajv = new Ajv({ schemaId: "id", meta: false, unknownFormats: ["uri", "uri-reference", "date-time"], allErrors: true });
ajv.addMetaSchema(read("ajv/lib/refs/json-schema-draft-04.json"));
const valid = ajv.compile(read("@microsoft/jest-sarif/lib/schemas/sarif-2.1.0-rtm.5.json"));

let failures = 0;
function expect(holds, what) {
    if (holds) return;
    failures++;
    console.log(`NOT MET: ${what}`);
}

const folder = mkdtempSync(path.join(tmpdir(), "scn-sarif-"));
process.chdir(folder);
writeFileSync("parts.scn", "object part = sphere(1).rotate(y: 90);\n");
writeFileSync("main.scn", 'include "parts.scn";\nlet x = 3;\npart.translate(1, 0, 0);\npart.move(x, 0, 0);\n');
writeFileSync("odd näme #1.scn", "spere(1);\n");
writeFileSync("broken.scn", 'let words = "never closed;\nsphere(1);\n');
writeFileSync("fine.scn", 'print "seen";\nsphere(1);\n');
writeFileSync("later.scn", 'assert time < 1s, "too late";\nsphere(1);\n');

// One run: the document is the only text on its stream.
function run(stream, status, ...args) {
    const done = spawnSync(scn, [...args, "--error-format", "sarif"], { encoding: "utf8", env: { ...process.env, XDG_CACHE_HOME: path.join(folder, "cache") } });
    const name = `scn ${args.join(" ")}`;
    expect(done.status === status, `${name} exits with ${status}, not ${done.status}: ${done.stderr}`);
    let document = {};
    try {
        document = JSON.parse(done[stream]);
    } catch (error) {
        expect(false, `${name} writes a document: ${error.message}: ${done[stream]}`);
        return document;
    }
    expect(valid(document), `${name} is valid: ${ajv.errorsText(valid.errors)}`);
    const { results, tool } = document.runs[0];
    for (const result of results) expect(tool.driver.rules[result.ruleIndex].id === result.ruleId, `${name}: the rule of ${result.ruleId}`);
    return document;
}
const results = (document) => document.runs?.[0].results ?? [];
const notes = (document) => document.runs?.[0].invocations[0].toolExecutionNotifications ?? [];

const main = run("stdout", 1, "check", "main.scn");
expect(results(main).length === 3, "three results");
const angle = results(main).find((r) => r.ruleId === "angle-unit");
expect(angle?.relatedLocations[0].message.text === "included from here", "the way through the include");
const name = results(main).find((r) => r.ruleId === "unknown-name");
expect(name?.fixes[0].artifactChanges[0].replacements[0].insertedContent.text === "move", "the fix");
expect(name?.locations[0].physicalLocation.region.startColumn === 6, "its column");

const several = run("stdout", 3, "check", "odd näme #1.scn", path.join(folder, "main.scn"), "nothere.scn");
const uris = results(several).map((r) => r.locations[0].physicalLocation.artifactLocation.uri);
expect(uris.includes("odd%20n%C3%A4me%20%231.scn"), "a path as a URI");
expect(uris.some((uri) => uri.startsWith("file:///")), "an absolute path as a URI");
expect(notes(several).length === 1 && !several.runs[0].invocations[0].executionSuccessful, "what cannot be read is a notification");

const fine = run("stdout", 0, "check", "fine.scn");
expect(results(fine).length === 0 && notes(fine)[0]?.message.text === "seen\n" && notes(fine)[0]?.level === "note", "what is printed is a note");

// Every command that reads a scene.
for (const command of ["render", "build", "info", "tree", "flatten", "patch"]) {
    expect(results(run("stderr", 1, command, "main.scn")).length === 3, `${command} has the results of check`);
}
for (const args of [["fmt"], ["dump", "--ast"], ["doc"], ["bench"]]) {
    expect(results(run("stderr", 1, ...args, "broken.scn"))[0]?.ruleId === "unterminated-string", `${args[0]} says what is wrong`);
}
expect(results(run("stderr", 0, "render", "fine.scn", "-s", "8x8", "-o", "a.png")).length === 0, "a picture and an empty document");
const late = results(run("stderr", 1, "render", "later.scn", "-s", "8x8", "-t", "2s", "-o", "b.png"));
expect(late.length === 1 && late[0].ruleId === "assert-failed" && late[0].locations[0].physicalLocation.region.startColumn === 8, "what is wrong in a frame");
run("stderr", 0, "build", "--source", "later.scn", "-o", "later.scnk");
expect(results(run("stderr", 1, "run", "later.scnk", "-s", "8x8", "-t", "2s", "-o", "c.png"))[0]?.ruleId === "assert-failed", "the same of a package");

// The schema bites.
function breaks(change, what) {
    const copy = structuredClone(main);
    change(copy.runs[0]);
    expect(!valid(copy), `${what} is refused`);
}
breaks((run) => delete run.tool, "a run without a tool");
breaks((run) => (run.extra = 1), "a name that SARIF does not have");
breaks((run) => (run.results[0].level = "fatal"), "an unknown level");
breaks((run) => delete run.results[0].message.text, "a message without a text");
breaks((run) => (run.results[0].locations[0].physicalLocation.region.startLine = 0), "a line 0");
breaks((run) => (run.results[0].fixes = [{}]), "a fix that changes nothing");

process.chdir("/");
rmSync(folder, { recursive: true });
console.log(failures ? `${failures} not met` : "all expectations met");
process.exit(failures ? 1 : 0);
