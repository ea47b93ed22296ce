// node container_arguments.mjs MODULES FILE [NAME]: what FILE gives to rilievod, or to the deployment or
// service NAME, on its command line, one a line.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [modules, file, name = "rilievod"] = process.argv.slice(2);
const { parseAllDocuments } = createRequire(join(modules, "package.json"))("yaml");
const text = readFileSync(file, "utf8");

function found() {
  if (file.endsWith("Dockerfile")) return JSON.parse(text.match(/^CMD (\[.*\])$/m)[1]);
  const documents = parseAllDocuments(text, { strict: true }).map((one) => {
    if (one.errors.length) throw one.errors[0];
    return one.toJS();
  });
  const deployment = documents.find((one) => one.spec?.template && (one.metadata?.name ?? name) === name);
  return deployment
    ? deployment.spec.template.spec.containers[0].args
    : documents[0].services[name].command;
}

for (const argument of found()) console.log(argument);
