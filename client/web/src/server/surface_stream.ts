// A .dss file on its way: which of its chunks are whole, and since when.

export class SurfaceStream {
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** End of each chunk, and when its last byte arrived (performance.now()). */
  readonly chunks: { end: number; arrived: number | undefined }[] = [];
  /** What arrived is what the server has: set once its digest was compared. */
  isRight = false;
  #received = 0;

  constructor(totalBytes: number, chunkBytes: number[]) {
    this.bytes = new Uint8Array(totalBytes);
    let end = 0;
    for (const bytes of chunkBytes) this.chunks.push({ end: (end += bytes), arrived: undefined });
  }

  /** True when another chunk has become whole. */
  add(offset: number, data: Uint8Array): boolean {
    this.bytes.set(data, offset);
    this.#received = offset + data.length;
    let news = false;
    for (const chunk of this.chunks) {
      if (chunk.arrived !== undefined || chunk.end > this.#received) continue;
      chunk.arrived = performance.now();
      news = true;
    }
    return news;
  }

  get isComplete(): boolean {
    return this.#received === this.bytes.length;
  }

  /** How many chunks are whole, from the first on. */
  get wholeChunks(): number {
    return this.chunks.filter(({ arrived }) => arrived !== undefined).length;
  }

  firstChunks(count: number): Uint8Array {
    return this.bytes.subarray(0, this.chunks[count - 1]?.end ?? 0);
  }
}
