// The WebAssembly decoder gives the bytes that the compiled library gives.
//   BIN: folder with rilievo and dump_surface; GOLDEN: frozen files; WASM: the module.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { DecoderError, DecoderModule, type Mesh, type Surface } from '../src/decoder/module';

const { BIN = '', GOLDEN = '', WASM = '' } = process.env;
const folder = mkdtempSync(join(tmpdir(), 'rilievo-web-'));
after(() => rmSync(folder, { recursive: true }));

let decoder: DecoderModule;
before(async () => {
  decoder = await DecoderModule.load(readFileSync(WASM));
});

function asBytes(array: ArrayBufferView): Buffer {
  return Buffer.from(array.buffer, array.byteOffset, array.byteLength);
}

function dumped(mesh: Mesh, surface: Surface): Buffer {
  return Buffer.concat(
    [mesh.vertices, mesh.faces, mesh.normals, mesh.flags, mesh.colours, surface.heights()].map(asBytes),
  );
}

/** Every prefix of whole chunks at its finest level, and the whole file at every level. */
function checkFile(path: string): number {
  const bytes = readFileSync(path);
  const whole = decoder.decode(bytes);
  const info = whole.info();
  let compared = 0;
  const compare = (surface: Surface, size: number, level: number) => {
    const native = execFileSync(join(BIN, 'dump_surface'), [path, `${size}`, `${level}`], {
      maxBuffer: 1 << 30,
    });
    const ours = dumped(surface.tessellate(level), surface);
    assert.ok(ours.equals(native), `${path}: first ${size} bytes at level ${level} differ`);
    compared += ours.length;
  };
  for (let level = 0; level <= info.max_level + 1; ++level) compare(whole, bytes.length, level);
  whole.free();
  for (let level = -1; level < info.max_level; ++level) {
    const size = level < 0 ? firstChunk(bytes, info.chunk_bytes) : decoder.wholeBytes(bytes, level);
    const prefix = decoder.decode(bytes.subarray(0, size));
    compare(prefix, size, Math.max(level, 0));
    prefix.free();
  }
  return compared;
}

function firstChunk(bytes: Buffer, chunks: number[]): number {
  return Math.min(bytes.length, chunks[0]!);
}

function reconstructed(shape: string, ...options: string[]): string {
  const scan = join(folder, `${shape}.ply`);
  const surface = join(folder, `${shape}.dss`);
  const run = (...words: string[]) => execFileSync(join(BIN, 'rilievo'), words, { stdio: 'pipe' });
  run('simulate', shape, '-o', scan, '--points', '12000', '--noise', '0.001');
  run('reconstruct', scan, '-o', surface, '--quiet', ...options);
  return surface;
}

for (const name of readdirSync(GOLDEN).filter((file) => file.endsWith('.dss'))) {
  test(`bit-identical on the frozen ${name}`, () => {
    assert.ok(checkFile(join(GOLDEN, name)) > 10_000);
  });
}

// A plane with a border, a closed surface with handles, sharp edges.
for (const shape of ['terrain', 'genus2', 'cutbox']) {
  test(`bit-identical on a new surface of ${shape}`, () => {
    assert.ok(checkFile(reconstructed(shape)) > 100_000);
  });
}

test('a damaged or foreign file is refused with a sentence', () => {
  const bytes = readFileSync(join(GOLDEN, 'sheet_and_octahedron_v2.dss'));
  const damaged = Buffer.from(bytes);
  damaged[damaged.length - 8]! ^= 1;
  assert.throws(() => decoder.decode(damaged), (error: DecoderError) => error.code === 15 && /chunk/.test(error.message));
  assert.throws(() => decoder.decode(Buffer.from('no surface')), (error: DecoderError) => error.code === 3);
  assert.throws(() => decoder.decode(bytes.subarray(0, bytes.length - 3)), DecoderError);
  assert.equal(decoder.wholeBytes(bytes.subarray(0, 20)), 0);
  const surface = decoder.decode(bytes); // usable afterwards
  assert.throws(() => surface.tessellate(99), /level/);
  surface.free();
});

test('scans are read as the command line reads them, and packed without loss', () => {
  const text = '# a comment\n0.5 1e-3 2\n-1 2 3\n4 5 6 255 0 0\n';
  const scan = decoder.readScan(Buffer.from(text), 'scan.xyz');
  assert.deepEqual([...scan.points()], [0.5, 1e-3, 2, -1, 2, 3, 4, 5, 6]);
  assert.equal(scan.packed().coordinateBytes, 8); // 1e-3 is no float
  scan.free();
  const plain = decoder.readScan(Buffer.from('1 2 3\n4 5 6.5\n'), 'scan.xyz');
  const packed = plain.packed();
  assert.equal(packed.coordinateBytes, 4);
  assert.deepEqual([...new Float32Array(packed.bytes.buffer)], [1, 2, 3, 4, 5, 6.5]);
  assert.equal(packed.stations.length, 0);
  assert.equal(packed.normals, false);
  plain.free();
  const seen = decoder.readScan(Buffer.from(
    'x y z nx ny nz sensor_x sensor_y sensor_z\n1 2 3 0 0 1 0.1 8 9\n4 5 6 0 1 0 0.1 8 9\n'), 'scan.xyz');
  const records = seen.packed();
  assert.equal(seen.count(), 2);
  assert.equal(records.bytes.length, 2 * (12 + 2 + 12));
  assert.deepEqual([...new Float64Array(records.stations.buffer)], [0.1, 8, 9]);
  assert.equal(records.normals, true);
  assert.deepEqual([...new Float32Array(records.bytes.buffer.slice(14, 26))], [0, 0, 1]);
  seen.free();
  const mesh = decoder.readScan(Buffer.from('v 1 2 3\nv 4 5 6\nv 7 8 8\nf 1 2 3\n'), 'mesh.obj');
  assert.equal(mesh.format(), 'OBJ without its faces (1)');
  mesh.free();
  const named = decoder.readScan(Buffer.from('"I","X","Y","Z"\n9,1,2,3\n'), 'scan.csv');
  assert.deepEqual([...named.points()], [1, 2, 3]);
  named.free();
  assert.throws(() => decoder.readScan(Buffer.from('1 2 x\n'), 'scan.xyz'), /'x' is not a number/);
  assert.throws(() => decoder.readScan(Buffer.from(''), 'scan.xyz'), DecoderError);
  assert.throws(() => decoder.readScan(Buffer.from('ply\nformat ascii 1.0\nelement vertex 9\n'), 'a.ply'), DecoderError);
});

test('numbers of a text scan are the nearest doubles', () => {
  const numbers = ['4600000.123456789', '0.1', '1.7976931348623157e308', '4.9e-324', '-2.2250738585072011e-308', '123456789012345678'];
  const scan = decoder.readScan(Buffer.from(`${numbers.slice(0, 3).join(' ')}\n${numbers.slice(3).join(' ')}\n`), 'a.xyz');
  assert.deepEqual([...scan.points()], numbers.map(Number));
  scan.free();
  assert.throws(() => decoder.readScan(Buffer.from('1 2 1e999\n'), 'a.xyz'), /beyond the range/);
});

test('the distance of a scan to a surface is that of its points', () => {
  const path = reconstructed('sphere');
  const surface = decoder.decode(readFileSync(path));
  const scan = decoder.readScan(readFileSync(path.replace('.dss', '.ply')), 'sphere.ply');
  const { max_level, frame, certificate } = surface.info();
  const { distances, rms } = surface.distanceToScan(max_level, scan);
  const near = distances.filter((distance) => !Number.isNaN(distance));
  assert.ok(near.length > distances.length / 4);
  // The scan's own noise is 0.001 of the diagonal: most of it is the distance.
  assert.ok(rms / frame.diagonal > 0.0003 && rms / frame.diagonal < 0.0015, `${rms / frame.diagonal}`);
  const stated = certificate.scan_to_surface.rms;
  assert.ok(stated !== null && Math.abs(stated * frame.diagonal / rms - 1) < 0.05, `${stated}`);
  // The command line tells the same figure, to three digits.
  const words = ['view', path, '-o', join(folder, 'error.png'), '--size', '64', '--colors', 'error', '--scan', path.replace('.dss', '.ply'), '--json'];
  const { legend } = JSON.parse(execFileSync(join(BIN, 'rilievo'), words, { encoding: 'utf8' })) as { legend: string };
  const said = Number(/scan to surface: RMS ([\d.e-]+)/.exec(legend)?.[1]);
  assert.ok(Math.abs(said / rms - 1) < 0.006, `${legend}; here ${rms}`);
  scan.free();
  surface.free();
});

test('the place of a surface and of a scan is told', () => {
  const scan = join(folder, 'place.ply');
  const path = join(folder, 'place.dss');
  execFileSync(join(BIN, 'rilievo'), ['simulate', 'sphere', '-o', scan, '--points', '2000'], { stdio: 'ignore' });
  execFileSync(join(BIN, 'rilievo'), ['reconstruct', scan, '-o', path, '--quiet', '--unit', 'mm', '--up', '-y', '--crs', 'EPSG:25832'], { stdio: 'ignore' });
  const surface = decoder.decode(readFileSync(path));
  assert.deepEqual(surface.info().place, { metres_per_unit: 0.001, up: '-y', crs: 'EPSG:25832' });
  surface.free();
  const read = decoder.readScan(readFileSync(scan), 'place.ply');
  assert.deepEqual(read.place(), { metres_per_unit: null, up: null, crs: null });
  read.free();
});

test('the digest is SHA-256', () => {
  for (const size of [0, 1, 55, 64, 1_000_003]) {
    const bytes = Uint8Array.from({ length: size }, (_none, i) => (i * 31) % 251);
    const digest = createHash('sha256').update(bytes).digest();
    assert.ok(asBytes(decoder.digest(bytes)).equals(digest), `${size} bytes`);
  }
});
