# What SARIF 2.1.0 asks of the objects that scn writes (the sections of the standard in brackets): names that must be there, names that
# may be there and no others, and the types of what they hold. Gives true, or fails with the first place that is wrong.
def want(holds; what): if holds then . else error("not SARIF: \(what): \(tojson[0:200])") end;
def keys_of(needed; others):
    want(type == "object"; "an object")
    | want((needed - keys) == []; "needs \(needed)")
    | want((keys - needed - others) == []; "has no other names than \(needed + others)");
def text: keys_of(["text"]; ["markdown", "id", "arguments"]) | want(.text | type == "string"; "text");
def counts: want(type == "number" and . == floor and . >= 1; "counts from 1");
def region:                                                                        # 3.30
    keys_of(["startLine"]; ["startColumn", "endLine", "endColumn"])
    | (.[] |= counts)
    | want(.endLine > .startLine or .endColumn >= .startColumn; "ends behind its beginning");
def artifact: keys_of(["uri"]; ["uriBaseId", "index"])                             # 3.4
    | want(.uri | test("^(file://)?([A-Za-z0-9._~/-]|%[0-9A-F]{2})*$"); "a URI reference");
def location:                                                                      # 3.28
    keys_of(["physicalLocation"]; ["id", "message"])
    | .physicalLocation |= (keys_of(["artifactLocation", "region"]; []) | .artifactLocation |= artifact | .region |= region)
    | if has("message") then .message |= text else . end;
def unique(what): want((unique | length) == length; "each of \(what) once");
def fix:                                                                           # 3.55 to 3.57
    keys_of(["artifactChanges"]; ["description"]) | .description |= text
    | want(.artifactChanges | length > 0; "changes something")
    | .artifactChanges[] |= (keys_of(["artifactLocation", "replacements"]; []) | .artifactLocation |= artifact
        | want(.replacements | length > 0; "replaces something")
        | .replacements[] |= (keys_of(["deletedRegion"]; ["insertedContent"]) | .deletedRegion |= region | .insertedContent |= keys_of(["text"]; [])));
def level: want(IN("none", "note", "warning", "error"); "a level");
def rule:                                                                          # 3.49
    keys_of(["id"]; ["shortDescription", "fullDescription", "help", "defaultConfiguration"])
    | .shortDescription |= text | .fullDescription |= text | .defaultConfiguration |= (keys_of([]; ["level"]) | .level |= level);
def result($rules):                                                                # 3.27
    keys_of(["message"]; ["ruleId", "ruleIndex", "level", "locations", "relatedLocations", "fixes"])
    | .message |= text | .level |= level
    | want($rules[.ruleIndex].id == .ruleId; "the rule of its index")
    | .locations[] |= location | .relatedLocations[] |= location | .fixes[] |= fix
    | .locations |= unique("locations") | .relatedLocations |= unique("related locations") | .fixes |= unique("fixes");
def notification: keys_of(["message"]; ["level"]) | .message |= text | .level |= level;    # 3.58
def invocation:                                                                    # 3.20
    keys_of(["executionSuccessful"]; ["exitCode", "toolExecutionNotifications"])
    | want(.executionSuccessful | type == "boolean"; "true or false") | want(.exitCode | type == "number"; "a number")
    | .toolExecutionNotifications[] |= notification;
def run:                                                                           # 3.14
    keys_of(["tool"]; ["results", "invocations", "columnKind"])
    | want(.columnKind | IN("utf16CodeUnits", "unicodeCodePoints"); "a kind of columns")
    | .tool |= (keys_of(["driver"]; []) | .driver |= (keys_of(["name"]; ["version", "rules"]) | .rules[] |= rule | .rules |= unique("rules")))
    | .tool.driver.rules as $rules | .results[] |= result($rules) | .invocations[] |= invocation;
keys_of(["version", "runs"]; ["$schema"]) | want(.version == "2.1.0"; "version 2.1.0") | .runs[] |= run | true
