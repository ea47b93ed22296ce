// What the npm package @rilievo/decoder gives: the decoder as WebAssembly, for browsers and Node.
import { DecoderModule } from '../decoder/module.js';

export { DecoderError, DecoderModule, Scan, Surface } from '../decoder/module.js';
export type { ControlMesh, Mesh, PackedScan, Place, SurfaceInfo } from '../decoder/module.js';

/** Where the WebAssembly module is, or its bytes. */
export type WasmSource = string | URL | BufferSource;

async function bytesOf(source: WasmSource): Promise<BufferSource> {
  if (typeof source !== 'string' && !(source instanceof URL)) return source;
  const url = new URL(source, import.meta.url);
  if (url.protocol === 'file:') {
    // Node fetches no files. Bundlers for browsers leave this name alone.
    const files = 'node:fs/promises';
    const { readFile } = (await import(/* @vite-ignore */ /* webpackIgnore: true */ files)) as {
      readFile(file: URL): Promise<Uint8Array<ArrayBuffer>>;
    };
    return readFile(url);
  }
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url.href}: HTTP ${answer.status}`);
  return answer.arrayBuffer();
}

/** Loads the decoder; by default the module that lies beside this file. */
export async function loadDecoder(source?: WasmSource): Promise<DecoderModule> {
  return DecoderModule.load(await bytesOf(source ?? new URL('./rilievo.wasm', import.meta.url)));
}
