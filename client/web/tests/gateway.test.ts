// The gateway by itself, as a process: nothing answers behind it, and no browser is before it.
//   WEB: the built page and gateway.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { request } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { type Program, startGateway } from './programs';

const NOBODY = '127.0.0.1:9';
let gateway: Program;

before(async () => {
  gateway = await startGateway(NOBODY);
});
after(() => gateway?.stop());

/** The status of a request whose path and headers are sent as they are. */
function status(path: string, headers: Record<string, string> = {}): Promise<number | undefined> {
  const { hostname, port } = new URL(gateway.address);
  return new Promise((resolve, reject) =>
    request({ hostname, port, path, headers, agent: false }, (answer) => resolve(answer.resume().statusCode))
      .on('error', reject).end());
}

test('names that no file can have are not found, and the gateway lives on', async () => {
  for (const path of ['/index.html/x', `/${'x'.repeat(300)}`, '/%00', '/%', '//', '/assets']) {
    assert.equal(await status(path), 404, path.slice(0, 20));
    assert.equal(await status('/'), 200);
  }
});

test('a request that the gateway fails at is answered, and so is the next one', async () => {
  // No address has such a port: the name of the call is read as part of one.
  const call = '/rilievo.v1.ReconstructionService/GetCapabilities';
  assert.equal(await status(call, { host: 'localhost:99999' }), 500);
  assert.equal(await status('/'), 200);
});

test('a host must be named, to listen on and to be called by', () => {
  const started = (...more: string[]) => spawnSync('node', [join(process.env.WEB ?? '', 'gateway.mjs'), '--server', NOBODY, ...more],
    { encoding: 'utf8', timeout: 10_000 });
  const everywhere = started('--listen', ':0');
  assert.equal(everywhere.status, 2);
  assert.match(everywhere.stderr, /--listen ':0' is no HOST:PORT/);
  const nameless = started('--listen', '127.0.0.1:0', '--allow-host', '');
  assert.equal(nameless.status, 2);
  assert.match(nameless.stderr, /--allow-host is empty/);
});
