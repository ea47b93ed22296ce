// A loader of .dss files for three.js: whole, as its other loaders, or level by level as they arrive.
import { BufferAttribute, BufferGeometry, Loader, type LoadingManager } from 'three';
import { type DecoderModule, loadDecoder, type Mesh, type Surface, type SurfaceInfo, type WasmSource } from './decoder.js';

/** Levels that have not arrived are drawn up to this one: as the smooth surface, without their heights. */
const PREVIEW_LEVEL = 2;

/** What a geometry has in `userData`. */
export interface SurfaceData {
  /** Of the triangles; `levels` of `info` has all. */
  level: number;
  /** Scan frame: positions are relative to it, so that float keeps their digits. */
  center: [number, number, number];
  info: SurfaceInfo;
}

export type SurfaceGeometry = BufferGeometry & { userData: SurfaceData };

const LINEAR = Float32Array.from({ length: 256 }, (_none, byte) => {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});

/** Puts a mesh into a geometry; what was in it is taken off the graphics card. */
function fill(geometry: SurfaceGeometry, mesh: Mesh, data: SurfaceData): void {
  geometry.dispose();
  const positions = Float32Array.from(mesh.vertices, (value, i) => value - data.center[i % 3]!);
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setAttribute('normal', new BufferAttribute(mesh.normals, 3));
  if (mesh.colours.length > 0) {
    geometry.setAttribute('color', new BufferAttribute(Float32Array.from(mesh.colours, (byte) => LINEAR[byte]!), 3));
  }
  geometry.setIndex(new BufferAttribute(mesh.faces, 1));
  geometry.userData = data;
  geometry.computeBoundingSphere();
}

function fillFrom(geometry: SurfaceGeometry, surface: Surface, asked?: number): void {
  const info = surface.info();
  const level = asked ?? Math.max(info.max_level, Math.min(PREVIEW_LEVEL, info.declared_max_level));
  fill(geometry, surface.tessellate(level), { level, center: info.frame.center, info });
}

/**
 * Decodes in the thread that calls it: some milliseconds for 10 000 triangles. `color` is linear, as
 * three.js wants it; colours of the scan show with a material of `vertexColors: true`.
 */
export class DSSLoader extends Loader<SurfaceGeometry> {
  #wasm: WasmSource | undefined;
  #decoder: Promise<DecoderModule> | undefined;

  constructor(manager?: LoadingManager) {
    super(manager);
  }

  /** Where rilievo.wasm is, if not beside this file. */
  setWasm(source: WasmSource): this {
    this.#wasm = source;
    this.#decoder = undefined;
    return this;
  }

  override load(
    url: string,
    onLoad: (geometry: SurfaceGeometry) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const progress = (loaded: number, total: number) =>
      onProgress?.(new ProgressEvent('progress', { lengthComputable: total > 0, loaded, total }));
    const address = this.#begun(url);
    this.#stream(address, undefined, progress).then(onLoad).catch((error: unknown) => {
      this.manager.itemError(address);
      if (onError) onError(error);
      else console.error(error);
    }).finally(() => this.manager.itemEnd(address));
  }

  /**
   * Calls `onLevel` with one and the same geometry each time that finer levels have arrived, and gives
   * it once the file is complete; one that ends before its last level is an error. `signal` breaks it off.
   */
  async loadLevels(url: string, onLevel: (geometry: SurfaceGeometry) => void, signal?: AbortSignal): Promise<SurfaceGeometry> {
    const address = this.#begun(url);
    try {
      return await this.#stream(address, onLevel, undefined, signal);
    } catch (error) {
      this.manager.itemError(address);
      throw error;
    } finally {
      this.manager.itemEnd(address);
    }
  }

  /** A file, or a beginning of one that ends with a whole chunk; at `level`, by default the finest. */
  async parseAsync(bytes: Uint8Array, level?: number): Promise<SurfaceGeometry> {
    return this.#decoded(await this.#usable(), bytes, new BufferGeometry() as SurfaceGeometry, level);
  }

  /** The address that the manager waits for. */
  #begun(url: string): string {
    const address = this.manager.resolveURL(this.path + url);
    this.manager.itemStart(address);
    return address;
  }

  /** A decoder that once ran out of memory is loaded anew. */
  async #usable(): Promise<DecoderModule> {
    this.#decoder ??= loadDecoder(this.#wasm);
    const decoder = await this.#decoder;
    if (decoder.usable) return decoder;
    this.#decoder = loadDecoder(this.#wasm);
    return this.#decoder;
  }

  #decoded(decoder: DecoderModule, bytes: Uint8Array, into: SurfaceGeometry, level?: number): SurfaceGeometry {
    const surface = decoder.decode(bytes);
    try {
      fillFrom(into, surface, level);
    } finally {
      surface.free();
    }
    return into;
  }

  async #stream(
    address: string,
    onLevel?: (geometry: SurfaceGeometry) => void,
    onProgress?: (loaded: number, total: number) => void,
    signal?: AbortSignal,
  ): Promise<SurfaceGeometry> {
    const decoder = await this.#usable();
    const answer = await fetch(address, {
      headers: this.requestHeader,
      credentials: this.withCredentials ? 'include' : 'same-origin',
      ...(signal && { signal }),
    });
    if (!answer.ok || !answer.body) throw new Error(`${address}: HTTP ${answer.status} ${answer.statusText}`);
    const total = Number(answer.headers.get('content-length') ?? 0);
    const geometry = new BufferGeometry() as SurfaceGeometry;
    const reader = answer.body.getReader();
    let bytes = new Uint8Array(1 << 16);
    let loaded = 0;
    let drawn = 0;
    for (let piece = await reader.read(); !piece.done; piece = await reader.read()) {
      while (loaded + piece.value.length > bytes.length) {
        const larger = new Uint8Array(2 * bytes.length);
        larger.set(bytes);
        bytes = larger;
      }
      bytes.set(piece.value, loaded);
      loaded += piece.value.length;
      onProgress?.(loaded, total);
      const whole = onLevel ? decoder.wholeBytes(bytes.subarray(0, loaded)) : 0;
      if (whole <= drawn) continue;
      drawn = whole;
      onLevel!(this.#decoded(decoder, bytes.subarray(0, whole), geometry));
    }
    // What comes behind the last whole chunk is none: the decoder says what is wrong with the file.
    if (loaded === 0 || loaded !== drawn) this.#decoded(decoder, bytes.subarray(0, loaded), geometry);
    const { max_level, declared_max_level } = geometry.userData.info;
    if (max_level < declared_max_level) {
      throw new Error(`${address}: ends at level ${max_level} of ${declared_max_level}; load it again`);
    }
    return geometry;
  }
}
