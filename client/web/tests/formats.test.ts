// Scans in the formats of scanners, compressed ones, and surfaces with updates, on the page in Chromium.
//   CORPUS: the seeds of the fuzz targets, which hold small LAZ files; else as page_fixture.ts.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { validateBytes } from 'gltf-validator';
import type { Page } from 'playwright-core';
import { Box3, Vector3 } from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { DecoderModule } from '../src/decoder/module';
import { unpacked } from '../src/page/unpack';
import { e57File } from './e57_file';
import { complete, error, folder, gateway, saved, scan, withPage } from './page_fixture';
import { PATIENCE, thumbnail, thumbnailAfter } from './pictures';
import { rilievo } from './programs';

const { CORPUS = '', WASM = '' } = process.env;

function written(name: string, bytes: Buffer | string): string {
  const path = join(folder, name);
  writeFileSync(path, bytes);
  return path;
}

/** The .dss that the page saves of a scan is the one that the command line makes of it. */
async function becomesTheSurface(page: Page, path: string, plain = path): Promise<void> {
  await page.setInputFiles('#file', path);
  await complete(page);
  assert.equal(await error(page).isVisible(), false);
  const surface = `${plain}.dss`;
  rilievo('reconstruct', plain, '-o', surface, '--quiet');
  assert.ok((await saved(page, '.dss')).equals(readFileSync(surface)), `${path}: the .dss differs`);
}

function sphere(count: number): Float32Array {
  return Float32Array.from({ length: 3 * count }, (_value, at) => {
    const i = Math.floor(at / 3);
    const z = 1 - (2 * i + 1) / count;
    const turn = i * Math.PI * (3 - Math.sqrt(5));
    const flat = Math.sqrt(1 - z * z);
    return [flat * Math.cos(turn), flat * Math.sin(turn), z][at % 3]!;
  });
}

test('an E57 file dropped on the page becomes a surface', async () => {
  const path = written('sphere.e57', e57File(sphere(2000)));
  await withPage(gateway.address, (page) => becomesTheSurface(page, path));
});

test('a gzip file becomes the surface of what it holds, and a damaged one is refused', async () => {
  const packed = gzipSync(readFileSync(scan));
  await withPage(gateway.address, async (page) => {
    await becomesTheSurface(page, written('packed.ply.gz', packed), scan);
    await page.setInputFiles('#file', written('cut.ply.gz', packed.subarray(0, packed.length / 2)));
    await error(page).filter({ hasText: 'damaged, cut off' }).waitFor();
    await page.setInputFiles('#file', written('a.ply.zst', Buffer.from([0x28, 0xb5, 0x2f, 0xfd, 0, 0])));
    await error(page).filter({ hasText: 'unpack it first (unzstd)' }).waitFor();
  });
});

test('a LAZ file dropped on the page is read, its colours too', async () => {
  await withPage(gateway.address, async (page) => {
    // All that the page says: what comes next may follow at once.
    const said: string[] = [];
    await page.exposeFunction('heard', (text: string) => said.push(text));
    await page.evaluate(() => {
      const status = document.querySelector('#status')!;
      const { heard } = window as unknown as { heard: (text: string) => void };
      new MutationObserver(() => heard(status.textContent ?? '')).observe(status, { childList: true, characterData: true, subtree: true });
    });
    for (const [format, version] of [[3, 2], [7, 4]]) {
      const expected = `100 points, LAZ 1.${version}, point format ${format}.`;
      await page.setInputFiles('#file', join(CORPUS, `las/packed_${format}.laz`));
      for (const end = Date.now() + PATIENCE; !said.includes(expected) && Date.now() < end; ) await page.waitForTimeout(50);
      assert.ok(said.includes(expected), said.join(' | '));
    }
  });
});

test('the points of LAZ and E57 files are those that were written', async () => {
  const decoder = await DecoderModule.load(readFileSync(WASM));
  for (const format of [0, 1, 2, 3, 6, 7, 8]) {
    const laz = decoder.readScan(readFileSync(join(CORPUS, `las/packed_${format}.laz`)), 'scan.laz');
    const points = laz.points();
    assert.equal(points.length, 300);
    for (let i = 0; i < 100; ++i) {
      const x = Math.trunc(1000 * Math.cos(0.7 * i)) * 0.01 + 1;
      const z = ((i * i) % 97) * (i % 13 === 0 ? 50 : 1) * 0.01 + 3;
      assert.deepEqual([points[3 * i], points[3 * i + 2]], [x, z]);
    }
    assert.equal(laz.layers().colours, ![0, 1, 6].includes(format));
    laz.free();
  }
  const written = sphere(3000);
  const e57 = decoder.readScan(e57File(written), 'scan.e57');
  assert.deepEqual([...e57.points()], [...written]);
  assert.deepEqual(e57.place(), { metres_per_unit: 1, up: null, crs: null });
  e57.free();
});

test('the GLB of a terrain stands upright and in metres in three.js', async () => {
  const path = join(folder, 'terrain.ply');
  rilievo('simulate', 'terrain', '-o', path, '--points', '4000');
  const surface = `${path}.dss`;
  rilievo('reconstruct', path, '-o', surface, '--quiet', '--unit', 'mm', '--up', 'z');
  const sizes: number[][] = [];
  for (const unit of ['mm', 'm']) {
    rilievo('export', surface, `${path}.glb`, '--unit', unit);
    const bytes = new Uint8Array(readFileSync(`${path}.glb`));
    const report = await validateBytes(bytes);
    assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, JSON.stringify(report.issues.messages));
    const { scene } = await new GLTFLoader().parseAsync(bytes.buffer, '');
    sizes.push(new Box3().setFromObject(scene).getSize(new Vector3()).toArray());
  }
  rilievo('export', surface, `${path}.obj`);
  const rows = readFileSync(`${path}.obj`, 'utf8').split('\n').filter((line) => line.startsWith('v '));
  const size = (axis: number) => {
    const values = rows.map((row) => Number(row.split(' ')[1 + axis]));
    return Math.max(...values) - Math.min(...values);
  };
  const upright = [size(0), size(2), size(1)]; // y is up, as z is in the scan
  assert.ok(upright[1]! < upright[0]! / 2 && upright[1]! < upright[2]! / 2, 'a terrain is flat');
  for (let axis = 0; axis < 3; ++axis) {
    assert.ok(Math.abs(sizes[1]![axis]! / upright[axis]! - 1) < 1e-5, `${sizes[1]} ${upright}`);
    assert.ok(Math.abs((1000 * sizes[0]![axis]!) / upright[axis]! - 1) < 1e-5, `${sizes[0]} ${upright}`);
  }
});

test('the change by an update is shown', async () => {
  const ball = (name: string, bump: number) => {
    const rows = Array.from({ length: 3000 }, (_row, i) => {
      const z = 1 - (2 * i + 1) / 3000;
      const radius = Math.sqrt(1 - z * z) * (1 + (z > 0.8 ? bump : 0));
      return `${radius * Math.cos(i * 2.399963)} ${radius * Math.sin(i * 2.399963)} ${z * (1 + (z > 0.8 ? bump : 0))}`;
    });
    return written(name, rows.join('\n'));
  };
  const [before, after] = [join(folder, 'before.dss'), join(folder, 'after.dss')];
  rilievo('reconstruct', ball('before.xyz', 0), '-o', before, '--quiet');
  rilievo('update', before, ball('after.xyz', 0.03), '-o', after, '--quiet');
  await withPage(gateway.address, async (page) => {
    const colour = page.getByLabel('Colour', { exact: true });
    const choice = colour.locator('option[value=change]');
    await page.setInputFiles('#file', before);
    await complete(page);
    assert.equal(await choice.isDisabled(), true);
    await page.setInputFiles('#file', after);
    await page.locator('#name', { hasText: 'after.dss' }).waitFor();
    await complete(page);
    const stone = await thumbnail(page);
    await colour.selectOption('change');
    await page.locator('#legend', { hasText: 'Change by the last update' }).waitFor();
    await thumbnailAfter(page, stone, 2);
  });
});

test('a gzip bomb is refused at the limit, with what to do', async () => {
  const bomb = gzipSync(Buffer.alloc(80 << 20));
  const most = (64 << 20) + 100 * bomb.length;
  await assert.rejects(unpacked(new Uint8Array(bomb)), new RegExp(`more than ${most} bytes.*gunzip`));
});
