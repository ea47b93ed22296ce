// TypeScript from the protocol's files, with protoc: generated/ follows proto/.
import { execFileSync } from 'node:child_process';
import { mkdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = join(dirname(fileURLToPath(import.meta.url)), '..');
const proto = join(web, '..', '..', 'proto');
mkdirSync(join(web, 'generated'), { recursive: true });
execFileSync(
  'protoc',
  [
    `--plugin=protoc-gen-es=${join(web, 'node_modules', '.bin', 'protoc-gen-es')}`,
    `--proto_path=${proto}`,
    `--es_out=${join(web, 'generated')}`,
    '--es_opt=target=ts',
    ...['options', 'report', 'reconstruction', 'jobs'].map((name) => `rilievo/v1/${name}.proto`),
    'google/rpc/status.proto',
    'google/rpc/error_details.proto',
  ],
  { stdio: 'inherit' },
);
