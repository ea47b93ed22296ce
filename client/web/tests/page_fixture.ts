// A page in Chromium, with a real rilievod behind a real gateway, for the tests of one file.
//   BIN: folder with rilievod and rilievo; WEB: the built page and gateway; CHROMIUM: the browser.
import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before } from 'node:test';
import { type Browser, chromium, type Download, type Page } from 'playwright-core';
import { PATIENCE } from './pictures';
import { type Program, rilievo, startGateway, startServer } from './programs';

const { CHROMIUM = '/usr/bin/chromium' } = process.env;
export const folder = mkdtempSync(join(tmpdir(), 'rilievo-page-'));
export const scan = join(folder, 'handles.ply');

export let server: Program;
export let gateway: Program;
export let browser: Browser;

before(async () => {
  rilievo('simulate', 'genus2', '-o', scan, '--points', '15000', '--noise', '0.0005');
  server = await startServer(join(folder, 'store'));
  gateway = await startGateway(server.address);
  browser = await chromium.launch({
    executablePath: CHROMIUM,
    args: ['--no-sandbox', '--disable-gpu', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--disable-background-networking', '--disable-component-update', '--disable-dev-shm-usage'],
  });
});

after(async () => {
  await browser?.close();
  await gateway?.stop();
  await server?.stop();
  rmSync(folder, { recursive: true });
});

/** A fresh page of its own; whatever it throws fails the test. */
export async function withPage(address: string, body: (page: Page) => Promise<void>, size = { width: 1280, height: 800 }) {
  const context = await browser.newContext({ viewport: size, acceptDownloads: true, colorScheme: 'light' });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  const thrown: string[] = [];
  page.on('pageerror', (error) => thrown.push(error.message));
  try {
    await page.goto(address);
    await page.locator('#server', { hasText: /rilievod|reached/ }).waitFor();
    await body(page);
    assert.deepEqual(thrown, []);
  } finally {
    await context.close();
  }
}

export const complete = (page: Page) => page.locator('#facts-section').waitFor({ state: 'visible' });
export const error = (page: Page) => page.getByRole('alert');

export async function saved(page: Page, name: string): Promise<Buffer> {
  const [download] = (await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name, exact: true }).click(),
  ])) as [Download, unknown];
  return readFileSync(await download.path());
}
