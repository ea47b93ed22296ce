// What the page and its worker say to each other.
import type { Place, SurfaceInfo } from './module';

/** Triangles for the screen: relative to the frame, in float. */
export interface Picture {
  level: number;
  /** (point - centre) / diagonal, three a vertex. */
  positions: Float32Array;
  normals: Float32Array;
  faces: Uint32Array;
  /** 0 measured, 1 smoothed, 2 filled. */
  flags: Uint8Array;
  /** Red, green, blue, 0 to 255; none where the surface has no colours. */
  colours: Uint8Array;
  /** Displacement, fractions of the diagonal; zero where no level has come yet. */
  heights: Float32Array;
  /** Of the heights by the last update, fractions of the diagonal; none where the file has no updates. */
  changes: Float32Array;
  tessellateMs: number;
}

export interface ControlPicture {
  positions: Float32Array;
  /** Two vertex numbers an edge. */
  edges: Uint32Array;
  creases: Uint32Array;
}

export interface Decoded {
  info: SurfaceInfo;
  control: ControlPicture;
  decodeMs: number;
}

export interface ReadScan {
  points: number;
  format: string;
  coordinateBytes: 4 | 8;
  /** See PackedScan of module.ts. */
  stations: Uint8Array<ArrayBuffer>;
  normals: boolean;
  packed: Uint8Array<ArrayBuffer>;
  sha256: string;
  layers: { colours: boolean; intensity: boolean };
  place: Place;
}

export interface Frame {
  center: [number, number, number];
  diagonal: number;
}

/** Points for the screen: relative to the frame; every how many were kept. */
export interface ScanPicture {
  positions: Float32Array;
  stride: number;
  frame: Frame;
}

/** RMS distance of the scan's points at each vertex, NaN where none is near, and of all; scan unit. */
export interface Distances {
  distances: Float32Array;
  rms: number;
}

export interface Tasks {
  /** Before anything is asked for. */
  warmUp: { ask: undefined; answer: undefined };
  /** The beginning of a file, whole chunks. Replaces the surface before. */
  decode: { ask: { bytes: Uint8Array }; answer: Decoded };
  /** Milliseconds to decode this beginning of a file and to tessellate its finest level; the surface stays. */
  timeOf: { ask: { bytes: Uint8Array }; answer: number };
  /** SHA-256. */
  digest: { ask: { bytes: Uint8Array }; answer: Uint8Array<ArrayBuffer> };
  picture: { ask: { level: number }; answer: Picture };
  readScan: { ask: { bytes: Uint8Array; name: string }; answer: ReadScan };
  /** Without a frame: that of the points' own bounding box. */
  scanPicture: { ask: { frame: Frame | undefined }; answer: ScanPicture };
  forgetScan: { ask: undefined; answer: undefined };
  distance: { ask: { level: number }; answer: Distances };
  /** Red, green, blue of the scan at each vertex, 0 to 255. */
  scanColours: { ask: { level: number }; answer: Uint8Array<ArrayBuffer> };
  /** `carry`: with colours and intensity of the scan. */
  meshFile: { ask: { format: 'ply' | 'glb'; level: number; carry: boolean }; answer: Uint8Array<ArrayBuffer> };
}

export type TaskName = keyof Tasks;
export type Asked = { [N in TaskName]: { id: number; task: N; ask: Tasks[N]['ask'] } }[TaskName];
export type Answered = { id: number; answer?: unknown; error?: { code: number; message: string } };
