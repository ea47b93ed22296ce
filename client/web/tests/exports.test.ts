// What `rilievo export` writes for programs in browsers, read by theirs: three.js, the decoder of
// meshoptimizer, and the 3D Tiles renderer.
import assert from 'node:assert/strict';
import { createReadStream, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer, type Server } from 'node:http';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { validateBytes } from 'gltf-validator';
import { Box3, type BufferGeometry, Mesh, type Object3D, PerspectiveCamera, Raycaster, Vector3 } from 'three';
import { MeshoptDecoder } from 'three/examples/jsm/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { TilesRenderer } from '3d-tiles-renderer/three';
import { rilievo } from './programs';

const folder = mkdtempSync(join(tmpdir(), 'rilievo-exports-'));
const surface = join(folder, 'star.dss');
let files: Server;
let address = '';

// What the 3D Tiles renderer takes from a browser.
Object.assign(globalThis, {
  window: globalThis,
  self: globalThis,
  location: { href: 'http://files/' },
  requestAnimationFrame: (call: () => void) => setTimeout(call, 0),
  cancelAnimationFrame: (timer: NodeJS.Timeout) => clearTimeout(timer),
});

before(async () => {
  rilievo('simulate', 'star', '-o', `${surface}.ply`, '--points', '20000');
  rilievo('reconstruct', `${surface}.ply`, '-o', surface, '--quiet', '--unit', 'm', '--up', 'z');
  // The folder, as a web server shows it.
  files = createServer((request, response) => {
    const path = join(folder, new URL(request.url!, 'http://files').pathname);
    response.writeHead(existsSync(path) ? 200 : 404);
    if (existsSync(path)) createReadStream(path).pipe(response);
    else response.end();
  });
  await new Promise<void>((resolve) => files.listen(0, '127.0.0.1', resolve));
  const bound = files.address();
  address = typeof bound === 'object' && bound !== null ? `http://127.0.0.1:${bound.port}` : '';
});

after(() => {
  files?.close();
  rmSync(folder, { recursive: true });
});

function meshOf(scene: Object3D): Mesh<BufferGeometry> {
  let found: Mesh | undefined;
  scene.updateMatrixWorld(true);
  scene.traverse((node) => {
    if (node instanceof Mesh) found = node as Mesh;
  });
  assert.ok(found);
  return found as Mesh<BufferGeometry>;
}

/** Of the vertices, in the scene. */
function placesOf(mesh: Mesh<BufferGeometry>): Vector3[] {
  const position = mesh.geometry.getAttribute('position');
  return Array.from({ length: position.count }, (_value, i) => new Vector3().fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld));
}

async function loaded(name: string): Promise<Mesh<BufferGeometry>> {
  const bytes = new Uint8Array(readFileSync(join(folder, name)));
  const report = await validateBytes(bytes);
  assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, `${name}: ${JSON.stringify(report.issues.messages)}`);
  const { scene } = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes.buffer, '');
  return meshOf(scene);
}

test('a compressed GLB has the places of the plain one within 2^-16 of the diagonal', async () => {
  rilievo('export', surface, join(folder, 'plain.glb'));
  rilievo('export', surface, join(folder, 'small.glb'), '--compress');
  const plain = await loaded('plain.glb');
  const small = await loaded('small.glb');
  assert.ok(6 * readFileSync(join(folder, 'small.glb')).length < readFileSync(join(folder, 'plain.glb')).length);
  assert.equal(small.geometry.index!.count, plain.geometry.index!.count);
  const given = placesOf(plain);
  const diagonal = new Box3().setFromPoints(given).getSize(new Vector3()).length();
  const most = diagonal * 2 ** -16;
  // By cells of four times the distance: a place that is near lies in one of 27.
  const cells = new Map<string, Vector3[]>();
  const cellOf = (place: Vector3) => place.toArray().map((value) => Math.floor(value / (4 * most)));
  for (const place of given) cells.set(cellOf(place).join(), [...(cells.get(cellOf(place).join()) ?? []), place]);
  const held = placesOf(small);
  assert.equal(held.length, given.length);
  for (const place of held) {
    const [x, y, z] = cellOf(place) as [number, number, number];
    const near = [-1, 0, 1].flatMap((i) => [-1, 0, 1].flatMap((j) => [-1, 0, 1].flatMap((k) => cells.get(`${x + i},${y + j},${z + k}`) ?? [])));
    assert.ok(near.some((other) => other.distanceTo(place) <= most), `${place.toArray()}`);
  }
  assert.deepEqual(Object.keys(small.geometry.attributes).sort(), Object.keys(plain.geometry.attributes).sort());
});

test('a compressed GLB keeps its texture', async () => {
  // Not in Node, which has no pictures: the validator alone.
  const cloud = join(folder, 'colors.xyz');
  rilievo('export', surface, join(folder, 'points.obj'), '--level', '3');
  const rows = readFileSync(join(folder, 'points.obj'), 'utf8').split('\n').filter((line) => line.startsWith('v '));
  writeFileSync(cloud, rows.map((row, i) => `${row.slice(2)} ${i % 256} ${(3 * i) % 256} 90`).join('\n'));
  rilievo('reconstruct', cloud, '-o', `${cloud}.dss`, '--quiet');
  rilievo('export', `${cloud}.dss`, join(folder, 'textured.glb'), '--compress', '--texture', '256', '--level', '1');
  const report = await validateBytes(new Uint8Array(readFileSync(join(folder, 'textured.glb'))));
  assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, JSON.stringify(report.issues.messages));
  assert.equal(report.info.hasTextures, true);
});

/** Looks at the tiles from a place until nothing more is loaded; the levels that are then shown. */
async function shownFrom(tiles: TilesRenderer, camera: PerspectiveCamera): Promise<number[]> {
  camera.updateMatrixWorld(true);
  // Counts of tiles, not `isLoading`: that is false while the body of a response is on its way.
  const loads = tiles as unknown as { stats: Record<'queued' | 'downloading' | 'parsing', number>; processNodeQueue: { running: boolean } };
  for (let quiet = 0; quiet < 5; ) {
    tiles.update();
    await new Promise((resolve) => setTimeout(resolve, 20));
    const { queued, downloading, parsing } = loads.stats;
    quiet = queued + downloading + parsing > 0 || loads.processNodeQueue.running ? 0 : quiet + 1;
  }
  return [...tiles.visibleTiles].map((tile) => (tile as unknown as { internal: { depth: number } }).internal.depth);
}

test('the 3D Tiles renderer shows all levels, finer ones from nearer', async () => {
  for (const more of [[], ['--compress']]) {
    const name = ['tiles', ...more].join('');
    rilievo('export', surface, join(folder, `${name}/`), ...more);
    const tileset = JSON.parse(readFileSync(join(folder, name, 'tileset.json'), 'utf8'));
    const tiles = new TilesRenderer(`${address}/${name}/tileset.json`);
    tiles.errorTarget = 1;
    const failures: unknown[] = [];
    tiles.addEventListener('load-error', (event: unknown) => failures.push(event));
    tiles.manager.addHandler(/\.glb$/, new GLTFLoader(tiles.manager).setMeshoptDecoder(MeshoptDecoder));
    const camera = new PerspectiveCamera(50, 1, 0.001, 1e5);
    tiles.setCamera(camera);
    tiles.setResolution(camera, 800, 800);
    // The tileset itself is in no queue while it is on its way.
    await new Promise<void>((resolve) => {
      for (const ended of ['load-root-tileset', 'load-error'] as const) tiles.addEventListener(ended, () => resolve());
      tiles.update();
    });
    const depths: number[] = [];
    for (const distance of [30000, 3000, 300, 30, 3]) {
      camera.position.set(distance, 0, 0);
      camera.lookAt(0, 0, 0);
      const shown = await shownFrom(tiles, camera);
      assert.deepEqual(failures, []);
      assert.ok(shown.length > 0, `nothing is seen from ${distance}`);
      depths.push(Math.max(...shown));
    }
    assert.deepEqual(depths, [...depths].sort((a, b) => a - b));
    const levels = (tile: { children?: [] }): number => 1 + Math.max(0, ...(tile.children ?? []).map(levels));
    assert.equal(depths[0], Math.min(...depths));
    assert.equal(Math.max(...depths), levels(tileset.root) - 1);
    // What is shown from near is the surface: a ray that comes from outside meets it where it meets the GLB.
    const whole = await loaded('plain.glb');
    const ray = new Raycaster(new Vector3(0, 0, 3), new Vector3(0, 0, -1));
    tiles.group.updateMatrixWorld(true);
    const seen = ray.intersectObject(tiles.group, true)[0]!;
    const y_up = new Raycaster(new Vector3(0, 3, 0), new Vector3(0, -1, 0)).intersectObject(whole)[0]!;
    assert.ok(Math.abs(seen.distance - y_up.distance) < 1e-3, `${seen.distance} ${y_up.distance}`);
    tiles.dispose();
  }
});
