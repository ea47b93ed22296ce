// node script_of.mjs MODULES FILE: the commands of an action of GitHub, or of the first job of a GitLab
// file, one a line.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [modules, file] = process.argv.slice(2);
const { parse } = createRequire(join(modules, "package.json"))("yaml");
const recipe = parse(readFileSync(file, "utf8"), { strict: true });
const script = recipe.runs?.steps.map((step) => step.run) ?? Object.values(recipe)[0].script;
console.log(script.join("\n"));
