// Drops a scan on the page, waits for its surface, and looks at what the screen shows.
//   node first_hour.mjs ADDRESS SCAN PICTURE     in a clone whose client/web has its packages
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, resolve } from 'node:path';

const { chromium } = createRequire(resolve('client/web/package.json'))('playwright-core');
const [address, scan, picture] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM,
  args: ['--no-sandbox', '--disable-gpu', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
    '--disable-background-networking', '--disable-component-update', '--disable-dev-shm-usage'],
});
const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, colorScheme: 'light' });
const page = await context.newPage();
page.setDefaultTimeout(120_000);
await page.goto(address);
await page.getByText('Drop a scan here').waitFor();
const empty = await page.screenshot();

const transfer = await page.evaluateHandle(([text, name]) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const data = new DataTransfer();
  data.items.add(new File([bytes], name));
  return data;
}, [readFileSync(scan).toString('base64'), basename(scan)]);
await page.dispatchEvent('#canvas', 'drop', { dataTransfer: transfer });
await page.getByRole('button', { name: '.dss', exact: true }).waitFor();
const shown = await page.screenshot({ path: picture });

/** Of the middle of both screenshots, where the picture is. */
const eye = await context.newPage(); // the page itself fetches from its own address only
const seen = await eye.evaluate(async (pictures) => {
  const [before, after] = await Promise.all(pictures.map(async (text) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${text}`)).blob());
    const copy = new OffscreenCanvas(600, 500).getContext('2d');
    copy.drawImage(image, -500, -150);
    return copy.getImageData(0, 0, 600, 500).data;
  }));
  const ground = after.slice(0, 3);
  const shades = new Set();
  let surface = 0;
  let changed = 0;
  for (let i = 0; i < after.length; i += 4) {
    const apart = (from) => [0, 1, 2].some((k) => Math.abs(after[i + k] - from[k]) > 8);
    changed += apart(before.slice(i, i + 3));
    if (!apart(ground)) continue;
    ++surface;
    shades.add(after[i]);
  }
  return { surface: surface / 300_000, changed: changed / 300_000, shades: shades.size };
}, [empty, shown].map((bytes) => bytes.toString('base64')));
console.log(`on the screen: ${JSON.stringify(seen)}; ${picture}`);
// A shaded body in the middle of the page, where nothing was before.
assert.ok(seen.surface > 0.15 && seen.surface < 0.95 && seen.changed > 0.15, 'no surface in the picture');
assert.ok(seen.shades > 40, 'what is in the picture is not shaded');
await browser.close();
