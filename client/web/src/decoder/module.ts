// The decoder as WebAssembly, behind types. Runs in the page's worker and in Node alike.
//
// Every array that is handed out is a copy: the module's memory moves when it grows.

/** What the module exports: the functions of rilievo_decoder.h and wasm/page.h. */
type Exports = Record<string, (...values: (number | bigint)[]) => number> & {
  memory: WebAssembly.Memory;
};

/** A sentence of the decoder or of the readers of scans. */
export class DecoderError extends Error {
  /** gRPC's number of the error: 3 no such file, 15 cut off or corrupted, ... */
  readonly code: number;
  constructor(code: number, message: string) {
    super(message);
    this.name = 'DecoderError';
    this.code = code;
  }
}

/** What coordinates stand for; null where unknown. */
export interface Place {
  metres_per_unit: number | null;
  up: 'x' | 'y' | 'z' | '-x' | '-y' | '-z' | null;
  /** Well-known text, or "EPSG:" and a number. */
  crs: string | null;
}

/** Facts of a surface, as rilievo_surface_info() writes them; null where unknown. */
export interface SurfaceInfo {
  format_version: number;
  frame: { center: [number, number, number]; diagonal: number };
  levels: { vertices: number; faces: number }[];
  max_level: number;
  declared_max_level: number;
  chunk_bytes: number[];
  control: { vertices: number; faces: number; closed: boolean; creases: number; corners: number };
  certificate: Record<string, unknown> & { scan_to_surface: { rms: number | null; max: number | null } };
  place: Place;
  metadata: { generator: string; road: string; scan_points: number | null; options: string };
}

export interface Mesh {
  /** x, y, z of each vertex, scan frame. */
  vertices: Float64Array;
  /** Three vertex numbers a triangle. */
  faces: Uint32Array;
  /** Unit normals. */
  normals: Float32Array;
  /** 0 measured, 1 smoothed, 2 filled, one a vertex. */
  flags: Uint8Array;
  /** Red, green, blue of each vertex, sRGB; none where the surface has no colours. */
  colours: Uint8Array;
}

export interface ControlMesh {
  /** Control points, scan frame. */
  vertices: Float64Array;
  /** Triangles; of a Catmull-Clark surface the halves of its quads. */
  faces: Uint32Array;
  /** Two vertex numbers a crease. */
  creases: Uint32Array;
}

export interface PackedScan {
  /** PointChunk.data of all points. */
  bytes: Uint8Array<ArrayBuffer>;
  coordinateBytes: 4 | 8;
  /** ReconstructHeader.stations: three float64 each. */
  stations: Uint8Array<ArrayBuffer>;
  normals: boolean;
  sha256: Uint8Array;
}

const ERROR_INTERNAL = 13;
const ERROR_RESOURCE_EXHAUSTED = 8;

/** All that the module imports: a system without files, arguments or clock. */
function quietSystem(): WebAssembly.ModuleImports {
  const notThere = () => 8; // WASI: EBADF
  return new Proxy({}, { get: (_target, name) => (name === 'proc_exit' ? trap : notThere) });
}

function trap(): never {
  throw new WebAssembly.RuntimeError('the module ended itself');
}

/** A surface in the module's memory; free() it. */
export class Surface {
  readonly #module: DecoderModule;
  #pointer: number;

  constructor(module: DecoderModule, pointer: number) {
    this.#module = module;
    this.#pointer = pointer;
  }

  info(): SurfaceInfo {
    const bytes = this.#module.bytesOf('rilievo_surface_info', this.#pointer);
    return JSON.parse(new TextDecoder().decode(bytes)) as SurfaceInfo;
  }

  /** Displacement of each vertex of max_level, fractions of the diagonal; coarser levels first. */
  heights(): Float32Array {
    return this.#module.floatsOf('rilievo_surface_heights', this.#pointer);
  }

  /** By which the last update changed each of these heights; none where the file has no updates. */
  heightChanges(): Float32Array {
    return this.#module.floatsOf('rilievo_surface_height_changes', this.#pointer);
  }

  control(): ControlMesh {
    return {
      vertices: this.#module.doublesOf('rilievo_control_vertices', this.#pointer),
      faces: this.#module.indicesOf('rilievo_control_faces', this.#pointer),
      creases: this.#module.indicesOf('rilievo_control_creases', this.#pointer),
    };
  }

  /** Level in [0, max_level + 2]. */
  tessellate(level: number): Mesh {
    return this.withMesh(level, (mesh) => ({
      vertices: this.#module.doublesOf('rilievo_mesh_vertices', mesh),
      faces: this.#module.indicesOf('rilievo_mesh_faces', mesh),
      normals: this.#module.floatsOf('rilievo_mesh_normals', mesh),
      flags: this.#module.bytesOf('rilievo_mesh_flags', mesh),
      colours: this.#module.bytesOf('rilievo_mesh_colors', mesh),
    }));
  }

  /** A file of the mesh, with normals, flags and colours; with the layers of the scan `carried` instead. */
  file(format: 'ply' | 'glb', level: number, carried?: Scan): Uint8Array<ArrayBuffer> {
    const surface = format === 'glb' ? [this.#pointer] : [];
    return this.withMesh(level, (mesh) =>
      this.#module.file(`rilievo_page_write_${format}`, ...surface, mesh, carried?.pointer ?? 0),
    );
  }

  /** Red, green, blue of the scan's point nearest to each vertex of a level. */
  coloursOf(level: number, scan: Scan): Uint8Array<ArrayBuffer> {
    return this.withMesh(level, (mesh) => this.#module.file('rilievo_page_scan_colors', scan.pointer, mesh));
  }

  /**
   * RMS distance of the scan's points near each vertex of a level, scan unit, NaN where there are
   * none; and that of all points.
   */
  distanceToScan(level: number, scan: Scan): { distances: Float32Array; rms: number } {
    return this.withMesh(level, (mesh) => scan.distanceTo(mesh));
  }

  withMesh<T>(level: number, use: (mesh: number) => T): T {
    const mesh = this.#module.make('rilievo_tessellate', this.#pointer, level, 1);
    try {
      return use(mesh);
    } finally {
      this.#module.call('rilievo_mesh_free', mesh);
    }
  }

  free(): void {
    this.#module.call('rilievo_surface_free', this.#pointer);
    this.#pointer = 0;
  }
}

/** A scan in the module's memory; free() it. */
export class Scan {
  readonly #module: DecoderModule;
  #pointer: number;

  constructor(module: DecoderModule, pointer: number) {
    this.#module = module;
    this.#pointer = pointer;
  }

  /** x, y, z of each point, scan frame; non-finite ones among them. */
  points(): Float64Array {
    return this.#module.doublesOf('rilievo_page_scan_points', this.#pointer);
  }

  /** How many points. */
  count(): number {
    return this.#module.countOf('rilievo_page_scan_points', this.#pointer) / 3;
  }

  format(): string {
    return this.#module.text(this.#module.call('rilievo_page_scan_format', this.#pointer));
  }

  place(): Place {
    return JSON.parse(this.#module.text(this.#module.call('rilievo_page_scan_place', this.#pointer))) as Place;
  }

  /** In the module; for calls of it. */
  get pointer(): number {
    return this.#pointer;
  }

  layers(): { colours: boolean; intensity: boolean } {
    const bits = this.#module.call('rilievo_page_scan_layers', this.#pointer);
    return { colours: (bits & 1) !== 0, intensity: (bits & 2) !== 0 };
  }

  packed(): PackedScan {
    const module = this.#module;
    const stations = new Uint8Array(module.doublesOf('rilievo_page_scan_stations', this.#pointer).buffer);
    return module.withRoom(48, (room) => {
      const pointer = module.call('rilievo_page_scan_packed', this.#pointer, room, room + 8, room + 4);
      const view = module.view();
      return {
        bytes: module.copy(pointer, view.getUint32(room + 4, true)),
        coordinateBytes: view.getInt32(room, true) as 4 | 8,
        stations,
        normals: module.call('rilievo_page_scan_has_normals', this.#pointer) !== 0,
        sha256: module.copy(room + 8, 32),
      };
    });
  }

  /** See Surface.distanceToScan(). */
  distanceTo(mesh: number): { distances: Float32Array; rms: number } {
    const module = this.#module;
    const vertices = module.countOf('rilievo_mesh_vertices', mesh) / 3;
    return module.withRoom(16 + 4 * vertices, (room) => {
      module.check(module.call('rilievo_page_scan_distance', this.#pointer, mesh, room + 16, room));
      return {
        distances: new Float32Array(module.copy(room + 16, 4 * vertices).buffer),
        rms: module.view().getFloat64(room, true),
      };
    });
  }

  free(): void {
    this.#module.call('rilievo_page_scan_free', this.#pointer);
    this.#pointer = 0;
  }
}

export class DecoderModule {
  readonly #exports: Exports;
  #broken = false;

  private constructor(instance: WebAssembly.Instance) {
    this.#exports = instance.exports as unknown as Exports;
    (this.#exports as unknown as { _initialize(): void })._initialize();
  }

  static async load(wasm: BufferSource): Promise<DecoderModule> {
    const { instance } = await WebAssembly.instantiate(wasm, {
      wasi_snapshot_preview1: quietSystem(),
    });
    return new DecoderModule(instance);
  }

  /** False once a call ran out of memory: load a new one. */
  get usable(): boolean {
    return !this.#broken;
  }

  version(): string {
    return this.text(this.call('rilievo_decoder_version'));
  }

  /** Any beginning of a .dss file that ends with a whole chunk. */
  decode(bytes: Uint8Array): Surface {
    const pointer = this.withBytes(bytes, (at) => this.make('rilievo_decode', at, bytes.length, 1));
    return new Surface(this, pointer);
  }

  /** How many of these first bytes of a file are whole chunks; 0: not even the control mesh. */
  wholeBytes(bytes: Uint8Array, maxLevel = -1): number {
    return this.withBytes(bytes, (at) => this.make('rilievo_whole_bytes', at, bytes.length, maxLevel));
  }

  /** A scan file of any kind that the command line reads, known by content and name. */
  readScan(bytes: Uint8Array, name: string): Scan {
    const text = new TextEncoder().encode(`${name}\0`);
    return this.withBytes(text, (nameAt) =>
      this.withBytes(bytes, (at) => new Scan(this, this.make('rilievo_page_read_scan', at, bytes.length, nameAt))),
    );
  }

  /** SHA-256; browsers have none of their own outside of secure contexts. */
  digest(bytes: Uint8Array): Uint8Array<ArrayBuffer> {
    return this.withBytes(bytes, (at) =>
      this.withRoom(32, (room) => {
        this.call('rilievo_page_sha256', at, bytes.length, room);
        return this.copy(room, 32);
      }),
    );
  }

  call(name: string, ...values: number[]): number {
    if (this.#broken) throw new DecoderError(ERROR_INTERNAL, 'the decoder has ended; load it again');
    const called = this.#exports[name];
    if (called === undefined) throw new DecoderError(ERROR_INTERNAL, `the decoder has no ${name}`);
    try {
      return called(...values);
    } catch (error) {
      this.#broken = true;
      throw new DecoderError(
        ERROR_RESOURCE_EXHAUSTED,
        'no memory left in the browser for this file; try a smaller one',
        );
    }
  }

  check(code: number): void {
    if (code !== 0) throw new DecoderError(code, this.text(this.call('rilievo_last_error')));
  }

  /** Calls a function whose last argument takes the address of a new object, and gives that. */
  make(name: string, ...values: number[]): number {
    return this.withRoom(8, (room) => {
      this.check(this.call(name, ...values, room));
      return this.view().getUint32(room, true);
    });
  }

  /** Calls a function that writes a file, and copies it. */
  file(name: string, ...values: number[]): Uint8Array<ArrayBuffer> {
    const pointer = this.make(name, ...values);
    const bytes = this.bytesOf('rilievo_page_bytes', pointer);
    this.call('rilievo_page_bytes_free', pointer);
    return bytes;
  }

  countOf(name: string, object: number): number {
    return this.#elements(name, object, 0).count;
  }
  bytesOf(name: string, object: number): Uint8Array<ArrayBuffer> {
    return this.#elements(name, object, 1).bytes;
  }
  floatsOf(name: string, object: number): Float32Array {
    return new Float32Array(this.#elements(name, object, 4).bytes.buffer);
  }
  doublesOf(name: string, object: number): Float64Array<ArrayBuffer> {
    return new Float64Array(this.#elements(name, object, 8).bytes.buffer);
  }
  indicesOf(name: string, object: number): Uint32Array {
    return new Uint32Array(this.#elements(name, object, 4).bytes.buffer);
  }

  #elements(name: string, object: number, size: number) {
    return this.withRoom(8, (room) => {
      const pointer = this.call(name, object, room);
      const count = this.view().getUint32(room, true);
      return { count, bytes: this.copy(pointer, count * size) };
    });
  }

  copy(pointer: number, size: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.#exports.memory.buffer as ArrayBuffer, pointer, size).slice();
  }

  view(): DataView {
    return new DataView(this.#exports.memory.buffer);
  }

  text(pointer: number): string {
    const bytes = new Uint8Array(this.#exports.memory.buffer, pointer);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  withRoom<T>(size: number, use: (pointer: number) => T): T {
    const pointer = this.call('malloc', Math.max(size, 1));
    if (pointer === 0) {
      throw new DecoderError(
        ERROR_RESOURCE_EXHAUSTED,
        'no memory left in the browser for this file; try a smaller one',
      );
    }
    try {
      return use(pointer);
    } finally {
      if (!this.#broken) this.call('free', pointer);
    }
  }

  withBytes<T>(bytes: Uint8Array, use: (pointer: number) => T): T {
    return this.withRoom(bytes.length, (pointer) => {
      new Uint8Array(this.#exports.memory.buffer).set(bytes, pointer);
      return use(pointer);
    });
  }
}
