// node check_manifests.mjs MODULES FILE...: Kubernetes manifests against the API's own schemas, and what
// the schemas cannot say: no field of a manifest is unknown, and names that refer to one another do.
import { existsSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";

const [modules, ...files] = process.argv.slice(2);
const require = createRequire(join(modules, "package.json"));
const { parseAllDocuments } = require("yaml");

const errors = [];
const documents = [];

// "apps/v1", "Deployment" -> the model of kubernetes-models.
function modelOf({ apiVersion, kind }) {
  const path = join(modules, "node_modules/kubernetes-models", apiVersion, `${kind}.js`);
  return require(path)[kind];
}

// The interface of a declaration file: property -> its type's text, and where types come from.
function readDeclaration(file) {
  const text = readFileSync(file, "utf8").replace(/\/\*[^]*?\*\//g, "");
  const sources = new Map();
  for (const [, names, source] of text.matchAll(/import \{([^}]*)\} from "([^"]+)"/g)) {
    for (const name of names.split(",")) sources.set(name.trim(), source);
  }
  const body = text.match(/export interface \w+[^{]*\{\n([^]*?)\n\}/);
  const properties = new Map(
    [...(body?.[1] ?? "").matchAll(/^ {4}"?(\w+)"?\??: ([^]*?);$/gm)].map((m) => [m[1], m[2]]));
  return { properties, sources };
}

// Schemas of the API allow any further field; kubectl does not, and neither do we.
function unknownFields(value, file, path) {
  if (Array.isArray(value)) return value.flatMap((one, i) => unknownFields(one, file, `${path}/${i}`));
  if (value === null || typeof value !== "object") return [];
  const { properties, sources } = readDeclaration(file);
  if (properties.size === 0) return [];
  return Object.entries(value).flatMap(([field, one]) => {
    const type = properties.get(field);
    if (type === undefined) return [`${path}/${field} is not a field of this object`];
    const name = type.match(/\bI\w+/)?.[0];
    const source = sources.get(name);
    if (!source || type.includes("[key: string]")) return [];
    const target = source.startsWith(".")
      ? join(dirname(file), `${source.replace(/\.js$/, "")}.d.ts`)
      : join(modules, "node_modules", `${source}.d.ts`);
    return existsSync(target) ? unknownFields(one, target, `${path}/${field}`) : [];
  });
}

// What refers to something by name must find it among the documents.
function danglingNames(all) {
  const found = [], selected = new Set();
  const names = (kind) => new Set(all.filter((o) => o.kind === kind).map((o) => o.metadata.name));
  for (const { spec } of all.filter((o) => o.kind === "Deployment")) {
    const pod = spec.template.spec;
    const volumes = new Set(pod.volumes.map((v) => v.name));
    const claims = names("PersistentVolumeClaim");
    for (const { persistentVolumeClaim: claim } of pod.volumes) {
      if (claim && !claims.has(claim.claimName)) found.push(`no claim ${claim.claimName}`);
    }
    if (!names("ServiceAccount").has(pod.serviceAccountName)) found.push("no such service account");
    const ports = new Set(pod.containers.flatMap((c) => c.ports.map((p) => p.name)));
    for (const { name } of pod.containers.flatMap((c) => c.volumeMounts)) {
      if (!volumes.has(name)) found.push(`no volume ${name}`);
    }
    const labels = JSON.stringify(spec.template.metadata.labels);
    for (const service of all.filter((o) => o.kind === "Service")) {
      if (JSON.stringify(service.spec.selector) !== labels) continue;
      selected.add(service.metadata.name);
      for (const { targetPort } of service.spec.ports) {
        if (!ports.has(targetPort)) found.push(`no port ${targetPort}`);
      }
    }
    if (JSON.stringify(spec.selector.matchLabels) !== labels) found.push("the deployment selects no pod");
  }
  for (const name of names("Service")) {
    if (!selected.has(name)) found.push(`the service ${name} selects no pod`);
  }
  return found;
}

for (const file of files) {
  for (const document of parseAllDocuments(readFileSync(file, "utf8"))) {
    for (const error of document.errors) errors.push(`${file}: ${error.message}`);
    const object = document.toJS();
    const name = `${file}: ${object?.kind} ${object?.metadata?.name}`;
    try {
      const Model = modelOf(object);
      new Model(object).validate();
      documents.push(object);
      const declaration = join(
        modules, "node_modules/kubernetes-models", object.apiVersion, `${object.kind}.d.ts`);
      const unknown = unknownFields(object, declaration, "data");
      if (unknown.length) throw new Error(unknown.join(", "));
      console.log(`ok      ${name}`);
    } catch (error) {
      errors.push(`${name}: ${error.message}`);
    }
  }
}

if (!errors.length) errors.push(...danglingNames(documents));
for (const error of errors) console.error(`FAILED  ${error}`);
process.exit(errors.length ? 1 : 0);
