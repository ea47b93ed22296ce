// The table of what each layer of a surface cost.
import { element, make, milliseconds, sizeText } from './elements';

export interface LayerTime {
  /** From the beginning of the file to the end of the layer. */
  bytes: number;
  /** To decode the file so far and to tessellate its finest level. */
  decodeMs: number;
  /** From the arrival of the layer's last byte until its picture is on the screen, if it was drawn. */
  toPictureMs?: number;
}

export class LayerTimes {
  readonly #rows: (HTMLElement | undefined)[] = [];

  clear(): void {
    this.#rows.length = 0;
    element('times').replaceChildren();
  }

  has(layer: number): boolean {
    return this.#rows[layer] !== undefined;
  }

  /** `layer` 0 is the control mesh, 1 the heights of level 0. */
  add(layer: number, { bytes, decodeMs, toPictureMs }: LayerTime): void {
    const cells = [layer === 0 ? 'control' : `${layer - 1}`, sizeText(bytes), milliseconds(decodeMs),
      toPictureMs === undefined ? '' : milliseconds(toPictureMs)];
    const row = make('tr', {}, ...cells.map((text) => make('td', { textContent: text })));
    if (toPictureMs !== undefined) row.dataset.toPicture = toPictureMs.toFixed(1);
    this.#rows[layer] = row;
    element('times').replaceChildren(...this.#rows.filter((one) => one !== undefined));
  }
}
