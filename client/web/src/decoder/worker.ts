// The decoder in a thread of its own: the page stays awake while a level is decoded.
import wasmAddress from 'rilievo.wasm?url';
import sampleAddress from '../../../../tests/golden/sheet_and_octahedron_v2.dss?url';
import type { Answered, Asked, ControlPicture, Decoded, Frame, Picture, ReadScan, ScanPicture, TaskName, Tasks } from './messages';
import { type ControlMesh, DecoderError, DecoderModule, type Scan, type Surface } from './module';

/** More do not help the eye, and weigh on the graphics. */
const MAX_DRAWN_POINTS = 400_000;

let loading: Promise<DecoderModule> | undefined;
let decoder: DecoderModule;
let surface: Surface | undefined;
let frame: Frame | undefined;
let scan: Scan | undefined;
let heights = new Float32Array();
let changes = new Float32Array();

async function load(): Promise<DecoderModule> {
  const answer = await fetch(wasmAddress);
  if (!answer.ok) throw new DecoderError(14, 'the decoder cannot be loaded; load the page again');
  return DecoderModule.load(await answer.arrayBuffer());
}

/**
 * Browsers translate a function of the module when it is first called. A thousand bytes with a border,
 * creases and a closed part are decoded before anybody's surface comes, so that it does not wait.
 */
async function warmUp(): Promise<undefined> {
  const sample = new Uint8Array(await (await fetch(sampleAddress)).arrayBuffer());
  const first = decoder.decode(sample);
  first.info();
  first.heights();
  first.control();
  for (let level = 0; level <= 3; ++level) first.tessellate(level);
  first.free();
  return undefined;
}

/** A module that ran out of memory takes its surface and scan along. */
async function usableDecoder(): Promise<DecoderModule> {
  if (decoder !== undefined && !decoder.usable) {
    loading = surface = scan = undefined;
  }
  loading ??= load();
  return (decoder = await loading);
}

function relative(points: Float64Array, { center, diagonal }: Frame): Float32Array {
  const result = new Float32Array(points.length);
  for (let i = 0; i < points.length; ++i) result[i] = (points[i]! - center[i % 3]!) / diagonal;
  return result;
}

function edgesOf({ faces, vertices }: ControlMesh): Uint32Array {
  const count = vertices.length / 3;
  const seen = new Set<number>();
  for (let i = 0; i < faces.length; ++i) {
    const a = faces[i]!;
    const b = faces[i % 3 === 2 ? i - 2 : i + 1]!;
    seen.add(Math.min(a, b) * count + Math.max(a, b));
  }
  const edges = new Uint32Array(2 * seen.size);
  let at = 0;
  for (const edge of seen) {
    edges[at++] = Math.floor(edge / count);
    edges[at++] = edge % count;
  }
  return edges;
}

function decode(bytes: Uint8Array): Decoded {
  const begin = performance.now();
  const next = decoder.decode(bytes);
  const decodeMs = performance.now() - begin;
  surface?.free();
  surface = next;
  const info = next.info();
  frame = info.frame;
  heights = next.heights() as Float32Array<ArrayBuffer>;
  changes = next.heightChanges() as Float32Array<ArrayBuffer>;
  const mesh = next.control();
  const control: ControlPicture = {
    positions: relative(mesh.vertices, frame), edges: edgesOf(mesh), creases: mesh.creases,
  };
  return { info, control, decodeMs };
}

function timeOf(bytes: Uint8Array): number {
  const begin = performance.now();
  const other = decoder.decode(bytes);
  other.tessellate(other.info().max_level);
  const time = performance.now() - begin;
  other.free();
  return time;
}

function theSurface(): Surface {
  if (!surface) throw new DecoderError(9, 'there is no surface yet');
  return surface;
}

function theScan(): Scan {
  if (!scan) throw new DecoderError(9, 'there is no scan here: open the scan of this surface too');
  return scan;
}

function picture(level: number): Picture {
  const begin = performance.now();
  const mesh = theSurface().tessellate(level);
  const tessellateMs = performance.now() - begin;
  const vertices = mesh.vertices.length / 3;
  const ofVertices = (values: Float32Array) => {
    const shown = new Float32Array(vertices);
    shown.set(values.subarray(0, Math.min(vertices, values.length)));
    return shown;
  };
  return {
    level, positions: relative(mesh.vertices, frame!), normals: mesh.normals, faces: mesh.faces,
    flags: mesh.flags, colours: mesh.colours, heights: ofVertices(heights),
    changes: changes.length > 0 ? ofVertices(changes) : new Float32Array(), tessellateMs,
  };
}

function readScan(bytes: Uint8Array, name: string): ReadScan {
  const next = decoder.readScan(bytes, name);
  scan?.free();
  scan = next;
  const packed = next.packed();
  return {
    points: next.count(),
    format: next.format(),
    coordinateBytes: packed.coordinateBytes,
    stations: packed.stations,
    normals: packed.normals,
    layers: next.layers(),
    place: next.place(),
    packed: packed.bytes,
    sha256: [...packed.sha256].map((byte) => byte.toString(16).padStart(2, '0')).join(''),
  };
}

function boxOf(points: Float64Array): Frame {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; ++i) {
    const value = points[i]!;
    if (!Number.isFinite(value)) continue;
    const axis = i % 3;
    if (value < low[axis]!) low[axis] = value;
    if (value > high[axis]!) high[axis] = value;
  }
  const middle = (axis: number) => (Number.isFinite(low[axis]!) ? (low[axis]! + high[axis]!) / 2 : 0);
  const size = Math.hypot(...[0, 1, 2].map((axis) => high[axis]! - low[axis]!));
  return { center: [middle(0), middle(1), middle(2)], diagonal: Number.isFinite(size) && size > 0 ? size : 1 };
}

function scanPicture(asked: Frame | undefined): ScanPicture {
  const points = theScan().points();
  const shown = asked ?? boxOf(points);
  const count = points.length / 3;
  const stride = Math.max(1, Math.ceil(count / MAX_DRAWN_POINTS));
  const kept = new Float64Array(3 * Math.ceil(count / stride));
  let at = 0;
  for (let i = 0; i < count; i += stride) {
    const [x, y, z] = points.subarray(3 * i, 3 * i + 3) as unknown as [number, number, number];
    if (!Number.isFinite(x + y + z)) continue;
    kept[at++] = x;
    kept[at++] = y;
    kept[at++] = z;
  }
  return { positions: relative(kept.subarray(0, at), shown), stride, frame: shown };
}

const tasks: { [N in TaskName]: (ask: Tasks[N]['ask']) => Tasks[N]['answer'] | Promise<Tasks[N]['answer']> } = {
  warmUp,
  decode: ({ bytes }) => decode(bytes),
  timeOf: ({ bytes }) => timeOf(bytes),
  digest: ({ bytes }) => decoder.digest(bytes),
  picture: ({ level }) => picture(level),
  readScan: ({ bytes, name }) => readScan(bytes, name),
  scanPicture: (ask) => scanPicture(ask.frame),
  forgetScan: () => {
    scan?.free();
    scan = undefined;
    return undefined;
  },
  distance: ({ level }) => theSurface().distanceToScan(level, theScan()),
  scanColours: ({ level }) => theSurface().coloursOf(level, theScan()),
  meshFile: ({ format, level, carry }) => theSurface().file(format, level, carry ? theScan() : undefined),
};

function buffersOf(answer: unknown): ArrayBuffer[] {
  const values = ArrayBuffer.isView(answer) ? [answer] : Object.values(answer ?? {});
  return values.filter(ArrayBuffer.isView).map((view) => view.buffer as ArrayBuffer);
}

self.onmessage = async ({ data }: MessageEvent<Asked>) => {
  try {
    await usableDecoder();
    const answer = await tasks[data.task](data.ask as never);
    self.postMessage({ id: data.id, answer } satisfies Answered, { transfer: buffersOf(answer) });
  } catch (error) {
    const code = error instanceof DecoderError ? error.code : 13;
    self.postMessage({ id: data.id, error: { code, message: (error as Error).message } } satisfies Answered);
  }
};
