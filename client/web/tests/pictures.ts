// What is in the picture, by its pixels; asked in the page, which can read images.
import assert from 'node:assert/strict';
import type { Page } from 'playwright-core';

/** For what is reconstructed or drawn on a machine that is busy with other tests, ms. */
export const PATIENCE = 120_000;

export interface Seen {
  /** Share of the canvas that shows something. */
  covered: number;
  /** Of what is shown: mean of each channel, 0 to 255, and the standard deviation of the brightness. */
  red: number;
  green: number;
  blue: number;
  contrast: number;
}

export function seen(page: Page): Promise<Seen> {
  return page.evaluate(() => {
    const picture = document.querySelector('canvas')!;
    const copy = new OffscreenCanvas(picture.width, picture.height).getContext('2d')!;
    copy.drawImage(picture, 0, 0);
    const { data } = copy.getImageData(0, 0, picture.width, picture.height);
    let count = 0;
    const sums = [0, 0, 0];
    let bright = 0;
    let squares = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3]! < 128) continue;
      ++count;
      for (let k = 0; k < 3; ++k) sums[k]! += data[i + k]!;
      const light = (data[i]! + data[i + 1]! + data[i + 2]!) / 3;
      bright += light;
      squares += light * light;
    }
    const all = Math.max(count, 1);
    const [red, green, blue] = sums.map((sum) => sum / all) as [number, number, number];
    return { covered: (4 * count) / data.length, red, green, blue, contrast: Math.sqrt(Math.max(0, squares / all - (bright / all) ** 2)) };
  });
}

/** The canvas as a small PNG without background, base64. */
export function thumbnail(page: Page): Promise<string> {
  return page.evaluate(async () => {
    const picture = document.querySelector('canvas')!;
    const copy = new OffscreenCanvas(128, 128);
    const context = copy.getContext('2d')!;
    context.imageSmoothingQuality = 'high';
    context.fillStyle = 'white';
    context.fillRect(0, 0, 128, 128);
    context.drawImage(picture, 0, 0, 128, 128);
    const bytes = new Uint8Array(await (await copy.convertToBlob({ type: 'image/png' })).arrayBuffer());
    return btoa(String.fromCharCode(...bytes));
  });
}

/** Mean difference of two PNGs over the pixels that are not white in either, 0 to 255. */
export function difference(page: Page, first: string, second: string): Promise<number> {
  return page.evaluate(async (both) => {
    const pixels = await Promise.all(both.map(async (text) => {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const context = new OffscreenCanvas(128, 128).getContext('2d')!;
      context.drawImage(image, 0, 0);
      return context.getImageData(0, 0, 128, 128).data;
    }));
    let sum = 0;
    let count = 0;
    for (let i = 0; i < pixels[0]!.length; i += 4) {
      const values = pixels.map((data) => [...data.subarray(i, i + 3)]);
      if (values.flat().every((value) => value > 250)) continue;
      ++count;
      sum += [0, 1, 2].reduce((all, k) => all + Math.abs(values[0]![k]! - values[1]![k]!) / 3, 0);
    }
    return sum / Math.max(count, 1);
  }, [first, second]);
}

/** The thumbnail as soon as it differs from `before` by more than `least`, see difference(). */
export async function thumbnailAfter(page: Page, before: string, least: number): Promise<string> {
  for (const end = Date.now() + PATIENCE; ; ) {
    const now = await thumbnail(page);
    const apart = await difference(page, before, now);
    if (apart > least) return now;
    assert.ok(Date.now() < end, `the picture still differs by ${apart} alone`);
    await page.waitForTimeout(50);
  }
}
