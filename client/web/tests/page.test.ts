// The page in Chromium: what people do there, and what they are shown.
//   GOLDEN, REFERENCE: frozen files; else as page_fixture.ts. With RILIEVO_WRITE_REFERENCE the reference
//   pictures are written.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { test } from 'node:test';
import { validateBytes } from 'gltf-validator';
import type { Page } from 'playwright-core';
import { browser, complete, error, folder, gateway, saved, scan, server, withPage } from './page_fixture';
import { difference, PATIENCE, seen, thumbnail, thumbnailAfter } from './pictures';
import { arraysOfPly } from './ply_arrays';
import { pythonLacks, reconstructInPython } from './python';
import { makeToken, rilievo, startGateway, startServer, startViewer } from './programs';

const { GOLDEN = '', REFERENCE = '', RILIEVO_WRITE_REFERENCE } = process.env;
const golden = join(GOLDEN, 'sheet_and_octahedron_v2.dss');

/** As a person drops a file on the page. */
async function drop(page: Page, path: string, name: string): Promise<void> {
  const transfer = await page.evaluateHandle(([text, called]) => {
    const bytes = Uint8Array.from(atob(text!), (letter) => letter.charCodeAt(0));
    const data = new DataTransfer();
    data.items.add(new File([bytes], called!));
    return data;
  }, [readFileSync(path).toString('base64'), name]);
  await page.dispatchEvent('#canvas', 'drop', { dataTransfer: transfer });
}

test('a scan dropped on the page becomes a picture, and the same files as on the command line', async () => {
  await withPage(gateway.address, async (page) => {
    await drop(page, scan, 'handles.ply');
    await page.locator('#stages li[data-state=running]').first().waitFor();
    await complete(page);
    assert.equal(await error(page).isVisible(), false);
    assert.equal(await page.locator('#work').isVisible(), false);
    const shown = await seen(page);
    // The unit box from the first view; shaded, so neither flat nor noise; stone: red > green > blue.
    assert.ok(shown.covered > 0.08 && shown.covered < 0.6, JSON.stringify(shown));
    assert.ok(shown.contrast > 10 && shown.red > shown.green && shown.green > shown.blue, JSON.stringify(shown));

    const surface = join(folder, 'handles.dss');
    rilievo('reconstruct', scan, '-o', surface, '--quiet');
    assert.ok((await saved(page, '.dss')).equals(readFileSync(surface)), 'the .dss differs');
    const mesh = join(folder, 'handles_mesh.ply');
    rilievo('export', surface, mesh);
    assert.ok((await saved(page, 'PLY')).equals(readFileSync(mesh)), 'the PLY differs');
    const glb = join(folder, 'handles_mesh.glb');
    rilievo('export', surface, glb);
    const savedGlb = await saved(page, 'GLB');
    assert.ok(savedGlb.equals(readFileSync(glb)), 'the GLB differs');
    const report = await validateBytes(new Uint8Array(savedGlb));
    assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, JSON.stringify(report.issues.messages));
    assert.ok(report.info.totalTriangleCount > 10_000);

  });
});

test('the same surface through the C++, the Python and the browser client, bit for bit', async (context) => {
  // Open terrain on a map grid: far from the origin, so that mesh files hold doubles.
  const rows = Array.from({ length: 4000 }, (_row, i) => {
    const x = (i * 0.754877666246693) % 1;
    const y = (i * 0.569840290998053) % 1;
    return `${500_000 + 50 * x} ${4_600_000 + 50 * y} ${120 + 3 * Math.sin(9 * x) * Math.cos(7 * y)}`;
  });
  const terrain = join(folder, 'terrain.xyz');
  writeFileSync(terrain, rows.join('\n'));

  const made = join(folder, 'terrain.dss');
  rilievo('reconstruct', terrain, '-o', made, '--server', server.address, '--quiet');
  const mesh = join(folder, 'terrain.ply');
  rilievo('export', made, mesh);
  const compiled = arraysOfPly(readFileSync(mesh));
  assert.ok(compiled.vertices.length > 24 * 2000 && compiled.faces.length > 12 * 4000);

  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', terrain);
    await complete(page);
    const shown = arraysOfPly(await saved(page, 'PLY'));
    assert.ok(shown.vertices.equals(compiled.vertices), 'vertices of the page differ');
    assert.ok(shown.faces.equals(compiled.faces), 'faces of the page differ');
  });

  const lacking = pythonLacks();
  if (lacking) return context.diagnostic(`not compared with Python: ${lacking}`);
  const { vertices, faces } = reconstructInPython(terrain, server.address, join(folder, 'python.bin'));
  assert.ok(vertices.equals(compiled.vertices), 'vertices in Python differ');
  assert.ok(faces.equals(compiled.faces), 'faces in Python differ');
});

test('colours, control mesh and points each change the picture', async () => {
  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', scan);
    await complete(page);
    const plain = await thumbnail(page);
    const colour = page.getByLabel('Colour', { exact: true });
    await colour.selectOption('displacement');
    const displaced = await thumbnailAfter(page, plain, 4);
    await page.locator('#legend', { hasText: 'Displacement' }).waitFor();
    await colour.selectOption('error');
    await page.locator('#legend', { hasText: 'Distance of the scan' }).waitFor();
    const distance = await thumbnailAfter(page, displaced, 4);
    await colour.selectOption('source');
    await page.locator('#legend', { hasText: 'measured' }).waitFor();
    const source = await thumbnailAfter(page, distance, 4);
    await page.getByLabel('Control mesh').check();
    const control = await thumbnailAfter(page, source, 1);
    // Over stone: measured parts are as blue as the points.
    await colour.selectOption('stone');
    const stone = await thumbnailAfter(page, control, 1);
    await page.getByLabel('Scan points').check();
    await thumbnailAfter(page, stone, 4);
  });
});

test('colours and intensity of a scan are shown, and carried into files when asked', async () => {
  // A ball, red above and blue below, with an intensity.
  const rows = Array.from({ length: 4000 }, (_row, i) => {
    const z = 1 - (2 * i + 1) / 4000;
    const [turn, radius] = [i * 2.399963, Math.sqrt(1 - z * z)];
    return `${radius * Math.cos(turn)} ${radius * Math.sin(turn)} ${z} ${z > 0 ? '250 20 20' : '20 20 250'} ${i}`;
  });
  const ball = join(folder, 'ball.ply');
  writeFileSync(ball, `ply\nformat ascii 1.0\nelement vertex 4000\n${['x', 'y', 'z'].map((axis) => `property float ${axis}\n`).join('')}${
    ['red', 'green', 'blue'].map((name) => `property uchar ${name}\n`).join('')}property float intensity\nend_header\n${rows.join('\n')}\n`);
  const surface = join(folder, 'ball.dss');
  rilievo('reconstruct', ball, '-o', surface, '--server', server.address, '--quiet');
  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', ball);
    await complete(page);
    const colour = page.getByLabel('Colour', { exact: true });
    assert.equal(await colour.inputValue(), 'surface', 'a surface with colours shows them');
    const own = await seen(page);
    const after = async (choice: string) => {
      const before = await thumbnail(page);
      await colour.selectOption(choice);
      await thumbnailAfter(page, before, 4);
      return seen(page);
    };
    const plain = await after('stone');
    for (const coloured of [own, await after('scan')]) {
      assert.ok(coloured.green < plain.green / 2 && coloured.red > 50 && coloured.blue > 30, JSON.stringify(coloured));
    }
    const own_ply = join(folder, 'ball_own.ply');
    rilievo('export', surface, own_ply);
    assert.ok((await saved(page, 'PLY')).equals(readFileSync(own_ply)), 'the PLY with colours of the surface differs');
    await page.getByLabel('Colours and intensity of the scan').check();
    for (const [button, kind] of [['PLY', 'ply'], ['GLB', 'glb']] as const) {
      const file = join(folder, `ball_mesh.${kind}`);
      rilievo('export', surface, file, '--carry', ball);
      assert.ok((await saved(page, button)).equals(readFileSync(file)), `the ${button} differs`);
    }
    const report = await validateBytes(new Uint8Array(readFileSync(join(folder, 'ball_mesh.glb'))));
    assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, JSON.stringify(report.issues.messages));
    // A scan without layers offers none.
    await page.setInputFiles('#file', scan);
    await page.locator('#name', { hasText: 'handles.ply' }).waitFor();
    assert.equal(await page.getByLabel('Colours and intensity of the scan').isVisible(), false);
    assert.equal(await page.getByLabel('Colour', { exact: true }).inputValue(), 'stone');
  });
});

test('cancel ends the job, here and at the server', async () => {
  const large = join(folder, 'large.ply');
  rilievo('simulate', 'genus2', '-o', large, '--points', '250000', '--noise', '0.001');
  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', large);
    await page.locator('#stages li[data-state=running]', { hasText: /neighbours|Normals|Control|Fitting|Displacement/ }).waitFor();
    await page.locator('#work').getByRole('button', { name: 'Cancel', exact: true }).click();
    await page.getByText('Cancelled.', { exact: true }).first().waitFor();
    await page.locator('#stages li[data-state=failed]').waitFor();
    const began = Date.now();
    const line = page.locator('#jobs li', { hasText: 'large.ply' });
    while (!(await line.textContent())?.includes('cancelled')) {
      assert.ok(Date.now() - began < 20_000, 'the job went on');
      await page.waitForTimeout(500);
      await page.reload();
      await line.waitFor();
    }
  });
});

test('errors are told in words', async () => {
  await withPage(gateway.address, async (page) => {
    const write = (name: string, text: string) => {
      writeFileSync(join(folder, name), text);
      return join(folder, name);
    };
    await page.setInputFiles('#file', write('bad.xyz', '1 2 3\n1 2 three\n'));
    await error(page).filter({ hasText: "'three' is not a number" }).waitFor();
    const line = Array.from({ length: 100 }, (_value, i) => `${i} ${2 * i} ${3 * i}`).join('\n');
    await page.setInputFiles('#file', write('line.xyz', line));
    await error(page).filter({ hasText: /line|collinear/i }).waitFor();
    await page.setInputFiles('#file', write('broken.dss', 'no surface at all'));
    await error(page).filter({ hasText: 'broken.dss' }).waitFor();
    const text = (await error(page).textContent())!;
    assert.doesNotMatch(text, /undefined|\[object|Error:|code/);
    // And the page goes on.
    await page.setInputFiles('#file', golden);
    await complete(page);
    assert.equal(await error(page).isVisible(), false);
  });
});

test('a surface that is not what its SHA-256 says is refused', async () => {
  const right = join(folder, 'right.dss');
  rilievo('reconstruct', scan, '-o', right, '--quiet');
  const bytes = readFileSync(right);
  const digest = createHash('sha256').update(bytes).digest();
  // The digest alone, with which all that is in the file still agrees; and the last bytes of the file.
  for (const wrong of [digest, bytes.subarray(-8)]) {
    await withPage(gateway.address, async (page) => {
      let changed = 0;
      await page.route('**/StreamSurface', async (route) => {
        const answer = await route.fetch();
        const body = await answer.body();
        const at = body.lastIndexOf(wrong);
        if (at >= 0) changed += 1;
        body[at] = body[at]! ^ 1;
        await route.fulfill({ response: answer, body });
      });
      await page.setInputFiles('#file', scan);
      await error(page).filter({ hasText: 'The surface was damaged on its way' }).waitFor();
      assert.equal(changed, 1);
      assert.equal(await page.locator('#facts-section').isVisible(), false);
      assert.equal(await page.getByRole('button', { name: '.dss', exact: true }).isVisible(), false);
      assert.equal(await page.locator('#view').isVisible(), false, 'it is still shown');
      await page.unroute('**/StreamSurface');
      await page.getByRole('button', { name: /^Open job/ }).first().click();
      await complete(page);
      assert.equal(await error(page).isVisible(), false);
      assert.ok((await saved(page, '.dss')).equals(bytes));
    });
  }
});

test('a server that refuses a scan says why', async () => {
  const small = await startServer(join(folder, 'small'), '--max-points', '1000');
  const door = await startGateway(small.address);
  try {
    await withPage(door.address, async (page) => {
      await page.setInputFiles('#file', scan);
      await error(page).filter({ hasText: 'this server takes at most 1000' }).waitFor();
      assert.doesNotMatch((await error(page).textContent())!, /wrong|HTTP|header/);
    });
  } finally {
    await door.stop();
    await small.stop();
  }
});

test('a surface opens without a server, and looks as it did', async () => {
  const alone = await startGateway('127.0.0.1:1');
  try {
    await withPage(alone.address, async (page) => {
      await page.locator('#server', { hasText: 'The server cannot be reached' }).waitFor();
      await page.setInputFiles('#file', golden);
      await complete(page);
      const stone = await thumbnail(page);
      await page.getByLabel('Colour', { exact: true }).selectOption('displacement');
      const displaced = await thumbnailAfter(page, stone, 1);
      await page.getByLabel('Control mesh').check();
      const picture = await thumbnailAfter(page, displaced, 1);
      const reference = join(REFERENCE, 'sheet_and_octahedron.png');
      if (RILIEVO_WRITE_REFERENCE) writeFileSync(reference, Buffer.from(picture, 'base64'));
      const apart = await difference(page, picture, readFileSync(reference).toString('base64'));
      console.log(`# difference from the reference picture: ${apart.toFixed(2)} of 255`);
      // Another version of the software renderer moves edges by part of a pixel.
      assert.ok(apart < 6, `${apart}`);
      assert.equal(await page.getByLabel('Scan points').isDisabled(), true);
      await page.setInputFiles('#file', scan);
      await error(page).filter({ hasText: 'The server cannot be reached' }).waitFor();
    }, { width: 1000, height: 648 });
  } finally {
    await alone.stop();
  }
});

test('the keyboard turns, comes nearer and chooses the level', async () => {
  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', golden);
    await complete(page);
    const canvas = page.getByRole('img');
    await canvas.focus();
    let picture = await thumbnail(page);
    for (const key of ['ArrowRight', 'ArrowUp', '+', '[', 'w']) {
      await page.keyboard.press(key);
      picture = await thumbnailAfter(page, picture, 0.5);
    }
    assert.match((await canvas.getAttribute('aria-label'))!, /surface of [\d,]+ triangles, level 2/);
    // Everything that can be used has a name and can be reached.
    const nameless = await page.locator('button, input, select, canvas').evaluateAll((all) =>
      all.filter((one) => {
        const field = one as HTMLInputElement;
        const label = field.labels?.[0]?.textContent ?? field.getAttribute('aria-label') ?? field.textContent;
        return !label?.trim() || field.tabIndex < 0;
      }).map((one) => one.outerHTML));
    assert.deepEqual(nameless, []);
  });
});

test('a page 360 pixels wide has everything, and nothing sticks out', async () => {
  await withPage(gateway.address, async (page) => {
    await page.setInputFiles('#file', scan);
    await complete(page);
    await page.getByLabel('Colour', { exact: true }).selectOption('displacement');
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= 360, `${width}`);
    const outside = await page.locator('body *:visible').evaluateAll((all) =>
      all.filter((one) => {
        const { left, right } = one.getBoundingClientRect();
        return right > left + 2 && (left < -1 || right > 361);
      }).map((one) => one.outerHTML.slice(0, 80)));
    assert.deepEqual(outside, []);
    const small = await page.locator('button:visible, select:visible, label.button:visible').evaluateAll((all) =>
      all.filter((one) => one.getBoundingClientRect().height < 40).map((one) => one.textContent));
    assert.deepEqual(small, []);
    assert.ok((await seen(page)).covered > 0.05);
  }, { width: 360, height: 740 });
});

test('a server that asks for a token gets it from the page, which keeps it in memory only', async () => {
  const tokens = join(folder, 'tokens');
  const token = makeToken('anna', tokens);
  const closed = await startServer(join(folder, 'closed'), '--tokens', tokens);
  const door = await startGateway(closed.address);
  const context = await browser.newContext();
  try {
    const page = await context.newPage();
    page.setDefaultTimeout(PATIENCE);
    await page.goto(door.address);
    const field = page.getByLabel('Token for this server');
    await field.waitFor();
    await page.locator('#server', { hasText: 'who you are' }).waitFor();
    assert.doesNotMatch((await page.locator('#server').textContent())!, /HTTP/);
    await field.fill('anna.wrong');
    await field.press('Enter');
    await page.locator('#server', { hasText: 'who you are' }).waitFor();
    await field.fill(token);
    await page.getByRole('button', { name: 'Use it' }).click();
    await page.locator('#server', { hasText: 'rilievod' }).waitFor();
    assert.equal(await field.isVisible(), false);
    await page.setInputFiles('#file', scan);
    await complete(page);
    const kept = await page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }, document.cookie]));
    assert.ok(!kept.includes(token) && kept.includes('handles.ply'));
    await page.reload();
    await field.waitFor();
  } finally {
    await context.close();
    await door.stop();
    await closed.stop();
  }
});

test('rilievo view --open shows a surface or a scan, and ends with all that it started', async () => {
  for (const file of [golden, scan]) {
    const viewer = await startViewer(file);
    await withPage(viewer.address, async (page) => {
      await complete(page);
      await page.locator('#name', { hasText: basename(file) }).waitFor();
      assert.ok((await seen(page)).covered > 0.05);
    });
    await viewer.stop();
    await assert.rejects(fetch(viewer.address));
  }
});

test('pages of other names and other origins are turned away', async () => {
  const host = new URL(gateway.address).host;
  const status = async (headers: Record<string, string>) => {
    const { request } = await import('node:http');
    return new Promise((resolve, reject) =>
      request(gateway.address, { headers }, (answer) => resolve(answer.resume().statusCode)).on('error', reject).end());
  };
  assert.equal(await status({ host }), 200);
  assert.equal(await status({ host: 'evil.example:80' }), 403);
  assert.equal(await status({ host, origin: 'http://evil.example' }), 403);
  assert.equal((await fetch(`${gateway.address}../../../../etc/passwd`)).status, 404);
  assert.equal((await fetch(`${gateway.address}%2e%2e/gateway.mjs`)).status, 404);
});
