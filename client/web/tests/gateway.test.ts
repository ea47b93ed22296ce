// The gateway as a process, without a browser: by itself, before a server that says nothing, and
// before a real one.
//   BIN: folder with rilievod; WEB: the built page and gateway.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { type IncomingHttpHeaders, type IncomingMessage, request } from 'node:http';
import { type AddressInfo, connect, createServer, type Server, type Socket } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { Readable } from 'node:stream';
import { after, before, test } from 'node:test';
import { setTimeout as pause } from 'node:timers/promises';
import { gzipSync } from 'node:zlib';
import { Code, ConnectError, createClient } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';
import { BadRequestSchema, ErrorInfoSchema } from '../generated/google/rpc/error_details_pb';
import { JobsService } from '../generated/rilievo/v1/jobs_pb';
import { CoordinateFormat } from '../generated/rilievo/v1/reconstruction_pb';
import { type Program, rilievo, startGateway, startServer } from './programs';

const NOBODY = '127.0.0.1:9';
const GET_JOB = '/rilievo.v1.JobsService/GetJob';
const folder = mkdtempSync(join(tmpdir(), 'rilievo-gateway-'));
let gateway: Program;

before(async () => {
  gateway = await startGateway(NOBODY);
});
after(async () => {
  await gateway?.stop();
  rmSync(folder, { recursive: true });
});

interface Answer {
  status: number | undefined;
  headers: IncomingHttpHeaders;
  text: string;
}

/** A request whose path and headers are sent as they are; a POST where there is a body. */
function ask(path: string, headers: Record<string, string> = {}, body?: Buffer, to = gateway): Promise<Answer> {
  const { hostname, port } = new URL(to.address);
  const method = body === undefined ? 'GET' : 'POST';
  return new Promise((resolve, reject) => {
    const asked = request({ hostname, port, path, headers, method, agent: false }, (answer) => {
      const parts: Buffer[] = [];
      answer.on('data', (part) => parts.push(part));
      answer.on('close', () => resolve({ status: answer.statusCode, headers: answer.headers, text: Buffer.concat(parts).toString() }));
    });
    asked.on('error', reject).end(body);
  });
}

async function status(path: string, headers: Record<string, string> = {}): Promise<number | undefined> {
  return (await ask(path, headers)).status;
}

/** The most that a process has ever held, in MB. */
function peak({ pid }: Program): number {
  return Number(/VmHWM:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, 'utf8'))![1]) / 1024;
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

function startedWith(...words: string[]) {
  const run = spawnSync('node', [join(process.env.WEB ?? '', 'gateway.mjs'), ...words], { encoding: 'utf8', timeout: 10_000 });
  return { status: run.status, said: run.stderr };
}

test('a host must be named, to listen on and to be called by', () => {
  const everywhere = startedWith('--server', NOBODY, '--listen', ':0');
  assert.equal(everywhere.status, 2);
  assert.match(everywhere.said, /--listen ':0' is not HOST:PORT/);
  const nameless = startedWith('--server', NOBODY, '--listen', '127.0.0.1:0', '--allow-host', '');
  assert.equal(nameless.status, 2);
  assert.match(nameless.said, /--allow-host is empty/);
});

test('plaintext is for this machine, unless it is allowed', async () => {
  const file = join(folder, 'token');
  writeFileSync(file, 'ann.secret\n');
  for (const listen of ['0.0.0.0:0', '[::]:0', '127.example.org:0']) {
    const refused = startedWith('--server', NOBODY, '--listen', listen);
    assert.equal(refused.status, 2, listen);
    assert.match(refused.said, /--allow-plaintext/);
  }
  const away = '192.0.2.1:50051';
  const refused = startedWith('--server', away, '--listen', '127.0.0.1:0', '--token-file', file);
  assert.equal(refused.status, 2);
  assert.match(refused.said, /would travel unencrypted to 192\.0\.2\.1:50051/);
  for (const [server, ...more] of [[NOBODY], [`https://${away}`], [away, '--allow-plaintext', '--listen', '0.0.0.0:0']]) {
    await (await startGateway(server!, '--token-file', file, ...more)).stop();
  }
  // A token that a caller brings does not go there either.
  const remote = await startGateway(away);
  try {
    const token = { authorization: 'Bearer ann.secret' };
    const call = await ask(GET_JOB, { 'content-type': 'application/json', ...token }, Buffer.from('{}'), remote);
    assert.match(call.text, /unencrypted/);
    const scan = await ask('/scans', { 'x-scan-sha256': 'a'.repeat(64), ...token }, Buffer.from('x'), remote);
    assert.equal(scan.status, 400);
    assert.match(scan.text, /failed_precondition.*unencrypted/);
  } finally {
    await remote.stop();
  }
});

test('every answer carries the policy of the page', async () => {
  const answers = {
    page: await ask('/'),
    none: await ask('/none'),
    foreign: await ask('/', { host: 'evil.example' }),
    failed: await ask(GET_JOB, { host: 'localhost:99999' }),
    call: await ask(GET_JOB, { 'content-type': 'application/json' }, Buffer.from('{}')),
    upload: await ask('/scans', {}, Buffer.from('x')),
  };
  assert.deepEqual(Object.values(answers).map((answer) => answer.status), [200, 404, 403, 500, 503, 400]);
  for (const [name, { headers }] of Object.entries(answers)) {
    for (const rule of ["default-src 'self'", "base-uri 'none'", "form-action 'self'", "object-src 'none'", "frame-ancestors 'none'"]) {
      assert.ok(`${headers['content-security-policy']}`.split('; ').includes(rule), `${name}: ${rule}`);
    }
    assert.equal(headers['x-content-type-options'], 'nosniff', name);
    assert.equal(headers['referrer-policy'], 'no-referrer', name);
    assert.equal(headers['cross-origin-resource-policy'], 'same-origin', name);
  }
});

test('a compressed message is refused, and memory does not grow', async () => {
  const bomb = gzipSync(Buffer.alloc(400 << 20));
  const before = peak(gateway);
  const frame = Buffer.concat([Buffer.from([1, 0, 0, 0, 0]), bomb]);
  frame.writeUInt32BE(bomb.length, 1);
  const sent = await Promise.all([
    ...Array.from({ length: 6 }, () => ask(GET_JOB, { 'content-type': 'application/proto', 'content-encoding': 'gzip' }, bomb)),
    ask(GET_JOB, { 'content-type': 'application/grpc-web+proto', 'grpc-encoding': 'gzip' }, frame),
    ask('/rilievo.v1.JobsService/WatchJob', { 'content-type': 'application/connect+proto', 'connect-content-encoding': 'gzip' }, frame),
  ]);
  for (const { status, headers, text } of sent) {
    const said = status === 200 ? `${headers['grpc-status'] ?? ''}${text}` : text;
    assert.match(said, /unimplemented|grpc-status: 12/, `${status} ${said.slice(0, 200)}`);
  }
  assert.equal(await status('/'), 200);
  const grown = peak(gateway) - before;
  assert.ok(grown < 64, `${grown} MB`);
});

test('a message over the limit is refused before it is read, and memory does not grow', async () => {
  const { hostname, port } = new URL(gateway.address);
  const headers = { 'content-type': 'application/proto' };
  const begun = (more: Record<string, string>) =>
    request({ hostname, port, path: GET_JOB, method: 'POST', headers: { ...headers, ...more }, agent: false });
  const announced = begun({ 'content-length': `${600 << 20}` }).on('error', () => undefined);
  const answer = new Promise<number | undefined>((resolve) => announced.on('response', ({ statusCode }) => resolve(statusCode)));
  announced.write(Buffer.alloc(1000));
  assert.equal(await answer, 429);
  announced.destroy();

  const before = peak(gateway);
  const endless = begun({ 'transfer-encoding': 'chunked' });
  const ended = new Promise((resolve) => endless.on('error', resolve).on('close', resolve));
  Readable.from((function* () {
    for (let sent = 0; sent < 600; ++sent) yield Buffer.alloc(1 << 20);
  })()).pipe(endless);
  await ended;
  assert.equal(await status('/'), 200);
  const grown = peak(gateway) - before;
  assert.ok(grown < 64, `${grown} MB`);
});

/** Sockets that connect and say nothing. */
async function silentTo({ address }: Program, count: number): Promise<Socket[]> {
  const { hostname, port } = new URL(address);
  const sockets = Array.from({ length: count }, () => connect(Number(port), hostname).on('error', () => undefined));
  await pause(500);
  return sockets;
}

test('connections are bounded, and those that say nothing are let go', async () => {
  const small = await startGateway(NOBODY, '--max-connections', '20');
  try {
    const sockets = await silentTo(small, 30);
    for (const socket of sockets) socket.resume();
    await pause(500);
    const held = () => sockets.filter((socket) => !socket.closed).length;
    assert.equal(held(), 20);
    const began = Date.now();
    while (held() > 0 && Date.now() - began < 20_000) await pause(200);
    assert.equal(held(), 0, 'they are still there after 20 s');
    assert.equal((await ask('/', {}, undefined, small)).status, 200);
  } finally {
    await small.stop();
  }
});

/** A server that takes connections and never answers. */
function muteServer(): Promise<Server> {
  return new Promise((resolve) => {
    const server: Server = createServer((socket) => socket.on('error', () => undefined).resume()).listen(0, '127.0.0.1', () => resolve(server));
  });
}

test('scans on their way are bounded', async () => {
  const mute = await muteServer();
  const slow = await startGateway(`127.0.0.1:${(mute.address() as AddressInfo).port}`);
  const { hostname, port } = new URL(slow.address);
  const headers = { 'x-upload-id': 'a', 'x-scan-sha256': 'a'.repeat(64), 'content-length': '1000' };
  const held = Array.from({ length: 16 }, () => {
    const upload = request({ hostname, port, path: '/scans', method: 'POST', headers, agent: false }).on('error', () => undefined);
    upload.write('begin');
    return upload;
  });
  try {
    await pause(500);
    const refused = await ask('/scans', { 'x-upload-id': 'a', 'x-scan-sha256': 'a'.repeat(64) }, Buffer.from('x'), slow);
    assert.equal(refused.status, 429);
    assert.equal(JSON.parse(refused.text).code, 'resource_exhausted');
    assert.equal((await ask('/', {}, undefined, slow)).status, 200, 'the rest is served');
    for (const upload of held) upload.destroy();
    await pause(500);
    const again = request({ hostname, port, path: '/scans', method: 'POST', headers, agent: false }).on('error', () => undefined);
    again.on('response', () => assert.fail('there is a place again'));
    again.write('begin');
    await pause(500);
    again.destroy();
  } finally {
    await slow.stop();
    mute.close();
  }
});

async function failure(call: Promise<unknown>): Promise<ConnectError> {
  const error = await call.then(() => assert.fail('it succeeded'), (cause: unknown) => cause);
  assert.ok(error instanceof ConnectError, `${error}`);
  return error;
}

test('errors of the server arrive with code, message and details, and nothing else of it', async () => {
  const server = await startServer(join(folder, 'small'), '--max-points', '1000', '--memory-budget', '1000');
  const front = await startGateway(server.address);
  const jobs = createClient(JobsService, createConnectTransport({ baseUrl: front.address, useBinaryFormat: true }));
  const reason = (error: ConnectError) => error.findDetails(ErrorInfoSchema).map((info) => `${info.domain}/${info.reason}`).join();
  const create = (points: number) => jobs.createJob({
    requestId: 'a', scanId: 'a'.repeat(64),
    header: { pointCount: BigInt(points), coordinateFormat: CoordinateFormat.FLOAT32_LE },
  });
  try {
    const large = await failure(create(2000));
    assert.equal(large.code, Code.InvalidArgument);
    assert.match(large.rawMessage, /at most 1000/);
    assert.equal(reason(large), 'rilievo.dev/LIMIT_EXCEEDED');
    assert.equal(large.findDetails(BadRequestSchema)[0]?.fieldViolations[0]?.field, 'header.point_count');
    const needy = await failure(create(1000));
    assert.equal(needy.code, Code.ResourceExhausted);
    assert.equal(reason(needy), 'rilievo.dev/MEMORY_LIMIT');
    const gone = await failure(jobs.getJob({ jobId: 'x' }));
    assert.equal(gone.code, Code.NotFound);
    assert.equal(reason(gone), 'rilievo.dev/JOB_NOT_FOUND');
    const watched = await failure((async () => {
      for await (const _event of jobs.watchJob({ jobId: 'x' }));
    })());
    assert.equal(watched.code, Code.NotFound);
    assert.equal(reason(watched), 'rilievo.dev/JOB_NOT_FOUND');

    const raw = await ask(GET_JOB, { 'content-type': 'application/json' }, Buffer.from('{"jobId":"x"}'), front);
    assert.equal(raw.status, 404);
    assert.equal(raw.headers['content-type'], 'application/json');
    assert.deepEqual(Object.keys(raw.headers).filter((name) => name.startsWith('grpc')), []);
    assert.equal(JSON.parse(raw.text).code, 'not_found');

    const scan = await ask('/scans', { 'x-upload-id': '/', 'x-scan-sha256': 'a'.repeat(64) }, Buffer.from('x'), front);
    const { code, details } = JSON.parse(scan.text);
    assert.deepEqual([scan.status, code], [400, 'invalid_argument']);
    assert.ok(details.some(({ type }: { type: string }) => type === 'google.rpc.BadRequest'));
  } finally {
    await front.stop();
    await server.stop();
  }
});

/** The commands of docs/http.md on `scan`, in `at`: how they end, and what they say. */
async function followed(front: Program, at: string, scan: number[][]): Promise<{ code: unknown; said: string }> {
  const page = readFileSync(join(process.env.GOLDEN ?? '', '../../docs/http.md'), 'utf8');
  const commands = [...page.matchAll(/^```sh\n(.*?)^```/gms)].map(([, block]) => block).join('');
  assert.match(commands, /GATEWAY=http:\/\/127\.0\.0\.1:8080\n/);
  mkdirSync(at);
  writeFileSync(join(at, 'scan.xyz'), scan.map((point) => point.join(' ')).join('\n'));
  // By Debian's own Python, which has NumPy.
  const run = spawn('bash', ['-euo', 'pipefail', '-c', commands.replace('http://127.0.0.1:8080', front.address.replace(/\/$/, ''))],
    { cwd: at, env: { ...process.env, PATH: `/usr/bin:${process.env.PATH}` }, stdio: ['ignore', 'pipe', 'pipe'], timeout: 60_000 });
  let said = '';
  for (const stream of [run.stdout, run.stderr]) stream.on('data', (text) => (said += text));
  return { code: await new Promise((resolve) => run.on('close', resolve)), said };
}

const SPHERE = Array.from({ length: 2000 }, (_none, i) => {
  const [z, angle] = [1 - (2 * i + 1) / 2000, 2.39996 * i];
  return [Math.sqrt(1 - z * z) * Math.cos(angle), Math.sqrt(1 - z * z) * Math.sin(angle), z];
});

test('the curl commands of docs/http.md make a surface and a GLB', async () => {
  const server = await startServer(join(folder, 'http'));
  const front = await startGateway(server.address);
  const made = join(folder, 'made');
  const at = (name: string) => join(made, name);
  try {
    const { code, said } = await followed(front, made, SPHERE);
    assert.equal(code, 0, said);
    const job = /"jobId":"([\w-]+)"/.exec(said)![1]!;
    // The same file as by the command line, and what that makes of it.
    rilievo('jobs', 'fetch', job, '--server', server.address, '-o', at('fetched.dss'));
    assert.ok(readFileSync(at('surface.dss')).equals(readFileSync(at('fetched.dss'))));
    rilievo('export', at('fetched.dss'), at('exported.glb'), '--level', '2');
    assert.ok(readFileSync(at('surface.glb')).equals(readFileSync(at('exported.glb'))));

    const wrong: [string, number, RegExp][] = [
      ['/jobs/x/surface.dss', 404, /not_found.*job/], [`/jobs/${job}/surface.obj`, 404, /surface\.glb with/],
      [`/jobs/${job}/surface.glb?level=60`, 400, /level/], ['/jobs/%2e%2e/surface.dss', 404, /not_found/],
    ];
    for (const [path, status, text] of wrong) {
      const answer = await ask(path, {}, undefined, front);
      assert.equal(answer.status, status, `${path}: ${answer.text}`);
      assert.match(answer.text, text);
    }
    const both = await Promise.all([0, 1].map(() => ask(`/jobs/${job}/surface.glb`, {}, undefined, front)));
    assert.deepEqual(both.map(({ status }) => status), [200, 200]);
    const fine = rilievo('jobs', 'submit', at('scan.xyz'), '--server', server.address, '--wait', '--max-level', '4');
    await unreadAreBounded(front, `/jobs/${/job ([\w-]+)/.exec(fine)![1]}/surface.glb?level=6`);
  } finally {
    await front.stop();
    await server.stop();
  }
});

/** Callers that take the head of a GLB and no more of it keep others from one, until they go. */
async function unreadAreBounded(front: Program, path: string): Promise<void> {
  const begun = () => new Promise<IncomingMessage>((resolve, reject) => {
    request(new URL(path, front.address), { agent: false }, resolve).on('error', reject).end();
  });
  const unread = await Promise.all([begun(), begun()]);
  assert.deepEqual(unread.map(({ statusCode }) => statusCode), [200, 200]);
  assert.ok(Number(unread[0]!.headers['content-length']) > 12 << 20, 'more than sockets hold');
  const third = (await begun()).resume();
  assert.equal(third.statusCode, 429);
  for (const answer of unread) answer.destroy();
  await pause(500);
  const free = (await begun()).destroy();
  assert.equal(free.statusCode, 200, 'there is a place again');
}

test('the commands of docs/http.md end with the error of a job that fails', async () => {
  const server = await startServer(join(folder, 'failing'));
  const front = await startGateway(server.address);
  try {
    const { code, said } = await followed(front, join(folder, 'failed'), Array.from({ length: 100 }, () => [1, 2, 3]));
    assert.equal(code, 1, said);
    assert.match(said, /JOB_STATE_FAILED/);
  } finally {
    await front.stop();
    await server.stop();
  }
});

test('the trace that a call belongs to goes on', async () => {
  const server = await startServer(join(folder, 'traced'));
  const front = await startGateway(server.address);
  try {
    const points = Buffer.alloc(240, 7);
    const sha256 = createHash('sha256').update(points).digest('hex');
    const stored = await ask('/scans', { 'x-upload-id': 'a', 'x-scan-sha256': sha256.toUpperCase() }, points, front);
    const scanId = JSON.parse(stored.text).scanId;
    assert.equal(scanId, sha256);
    const trace = '4bf92f3577b34da6a3ce929d0e0e4736';
    const body = { requestId: 'a', scanId, header: { pointCount: 20, coordinateFormat: 'COORDINATE_FORMAT_FLOAT32_LE' } };
    const made = await ask('/rilievo.v1.JobsService/CreateJob',
      { 'content-type': 'application/json', traceparent: `00-${trace}-00f067aa0ba902b7-01` }, Buffer.from(JSON.stringify(body)), front);
    assert.equal(JSON.parse(made.text).job.traceId, trace);
  } finally {
    await front.stop();
    await server.stop();
  }
});
