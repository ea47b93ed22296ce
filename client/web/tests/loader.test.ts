// The npm package on a page of twenty lines, in Chromium: three.js draws a surface level by level while
// its file arrives.   WEB: with npm/, the package; CHROMIUM; BIN.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { once } from 'node:events';
import { createReadStream, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createServer, type Server, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import { tmpdir } from 'node:os';
import { extname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { type Browser, chromium, type Page } from 'playwright-core';
import { DecoderModule } from '../src/decoder/module';
import { difference, seen, thumbnail } from './pictures';

const { BIN = '', WASM = '', WEB = '', CHROMIUM = '/usr/bin/chromium' } = process.env;
const TYPES: Record<string, string> = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const folder = mkdtempSync(join(tmpdir(), 'rilievo-loader-'));
const web = process.cwd();
/** Who waits for the surface. */
let asked: Promise<ServerResponse>;
let server: Server;
let browser: Browser;
let bytes: Buffer;
let decoder: DecoderModule;

before(async () => {
  const [scan, path] = [join(folder, 'scan.ply'), join(folder, 'surface.dss')];
  execFileSync(join(BIN, 'rilievo'), ['simulate', 'star', '-o', scan, '--points', '4000'], { stdio: 'ignore' });
  execFileSync(join(BIN, 'rilievo'), ['reconstruct', scan, '-o', path, '--quiet'], { stdio: 'ignore' });
  bytes = readFileSync(path);
  decoder = await DecoderModule.load(readFileSync(WASM));
  let found: (response: ServerResponse) => void;
  asked = new Promise((resolve) => (found = resolve));
  server = createServer((request, response) => {
    const path = request.url ?? '/';
    if (path === '/surface.dss') return found(response);
    const file = path === '/' ? join(web, 'tests/loader/page.html')
      : path.startsWith('/three/') ? join(web, 'node_modules/three/build', path.slice(7))
      : join(WEB, 'npm', path.replace('/decoder/', ''));
    response.setHeader('content-type', TYPES[extname(file)] ?? 'application/octet-stream');
    createReadStream(file).on('error', () => response.writeHead(404).end()).pipe(response);
  }).listen(0, '127.0.0.1');
  await once(server, 'listening');
  browser = await chromium.launch({
    executablePath: CHROMIUM,
    args: ['--no-sandbox', '--disable-gpu', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--disable-background-networking', '--disable-component-update', '--disable-dev-shm-usage'],
  });
});

after(async () => {
  await browser?.close();
  server?.close();
  rmSync(folder, { recursive: true });
});

const drawn = (page: Page) => page.evaluate(() => (window as unknown as { drawn: number[] }).drawn);

test('three.js draws a surface level by level while its file arrives', async () => {
  const { levels, chunk_bytes } = decoder.decode(bytes).info();

  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`, { waitUntil: 'commit' });
  const response = await asked;
  const pictures: string[] = [];
  const piece = async (begin: number, end: number) => {
    const before = (await drawn(page)).length;
    response.write(bytes.subarray(begin, end));
    await page.waitForFunction((count) => (window as unknown as { drawn: number[] }).drawn.length > count, before);
    pictures.push(await thumbnail(page));
    const { covered, contrast } = await seen(page);
    assert.ok(covered > 0.1 && contrast > 5, `${covered} of the picture, contrast ${contrast}`);
  };
  const half = Math.floor((chunk_bytes[0]! + bytes.length) / 2);
  const middle = decoder.wholeBytes(bytes.subarray(0, half));
  assert.ok(middle > chunk_bytes[0]! && middle < bytes.length);
  await piece(0, chunk_bytes[0]!);
  await piece(chunk_bytes[0]!, middle);
  await piece(middle, bytes.length);
  response.end();
  await page.waitForFunction(() => document.title !== '');
  assert.equal(await page.title(), 'complete');
  const triangles = await drawn(page);
  assert.equal(triangles.at(-1), levels.at(-1)!.faces);
  assert.ok(triangles[0]! <= triangles[1]! && triangles[1]! < triangles[2]!, `${triangles}`);
  // The smooth surface first, then its relief; the finest level moves a pixel here and there.
  assert.ok((await difference(page, pictures[0]!, pictures[2]!)) > 0.5);
  assert.ok((await difference(page, pictures[0]!, pictures[2]!)) > (await difference(page, pictures[1]!, pictures[2]!)));
});

test('a file of another kind is refused with a sentence', async () => {
  const page = await browser.newPage();
  await page.route('**/surface.dss', (route) => route.fulfill({ body: Buffer.from('no surface at all, but text') }));
  await page.goto(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`);
  await page.waitForFunction(() => document.title !== '');
  assert.match(await page.title(), /not a \.dss stream/);
});

/** What a loader says of `body`: by load(), then by loadLevels(). */
async function saidOf(body: Buffer): Promise<{ title: string; events: string[] }> {
  const page = await browser.newPage();
  await page.route('**/surface.dss', (route) => route.fulfill({ body }));
  await page.goto(`http://127.0.0.1:${(server.address() as AddressInfo).port}/`);
  await page.waitForFunction(() => document.title !== '');
  const events = await page.evaluate(`(async () => {
    const { LoadingManager } = await import('three');
    const { DSSLoader } = await import('@rilievo/decoder/three');
    const events = [];
    let end;
    const manager = new LoadingManager(() => end(events.push('end')), undefined, () => events.push('item error'));
    const loader = new DSSLoader(manager);
    await new Promise((resolve) => {
      end = resolve;
      loader.load('/surface.dss', () => events.push('load'), undefined, () => events.push('error'));
    });
    await loader.loadLevels('/surface.dss', () => undefined).then(() => events.push('load'), () => events.push('error'));
    return events;
  })()`) as string[];
  return { title: await page.title(), events };
}

test('a file that ends before its last level is an error, and the manager learns it first', async () => {
  assert.deepEqual(await saidOf(bytes), { title: 'complete', events: ['load', 'end', 'end', 'load'] });
  const cut = bytes.subarray(0, decoder.wholeBytes(bytes.subarray(0, bytes.length - 1)));
  const { max_level, declared_max_level } = decoder.decode(cut).info();
  for (const [body, sentence] of [[cut, `ends at level ${max_level} of ${declared_max_level}`], [Buffer.alloc(0), 'dss']] as const) {
    const { title, events } = await saidOf(body);
    assert.ok(title.includes(sentence), title);
    assert.deepEqual(events, ['item error', 'error', 'end', 'item error', 'end', 'error']);
  }
});
