// node container_arguments.mjs MODULES FILE: what FILE gives to rilievod on its command line, one a line.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [modules, file] = process.argv.slice(2);
const { parseAllDocuments } = createRequire(join(modules, "package.json"))("yaml");
const text = readFileSync(file, "utf8");

function found() {
  if (file.endsWith("Dockerfile")) return JSON.parse(text.match(/^CMD (\[.*\])$/m)[1]);
  const documents = parseAllDocuments(text, { strict: true }).map((one) => {
    if (one.errors.length) throw one.errors[0];
    return one.toJS();
  });
  const deployment = documents.find((one) => one.spec?.template);
  return deployment
    ? deployment.spec.template.spec.containers[0].args
    : documents[0].services.rilievod.command;
}

for (const argument of found()) console.log(argument);
