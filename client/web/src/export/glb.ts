// A mesh as binary glTF 2.0.
import type { Frame } from '../decoder/messages';
import type { Mesh } from '../decoder/module';

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const FLOAT = 5126;
const UNSIGNED_INT = 5125;
const ARRAY_BUFFER = 34962;
const ELEMENT_ARRAY_BUFFER = 34963;

/**
 * One mesh with normals in one node. glTF holds floats only: vertices are relative to the frame's
 * centre, which is the node's translation, so that map grids lose nothing.
 */
export function glbOf(mesh: Mesh, frame: Frame): Uint8Array<ArrayBuffer> {
  const positions = new Float32Array(mesh.vertices.length);
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    positions[i] = mesh.vertices[i]! - frame.center[i % 3]!;
    low[i % 3] = Math.min(low[i % 3]!, positions[i]!);
    high[i % 3] = Math.max(high[i % 3]!, positions[i]!);
  }
  const parts = [positions, mesh.normals, mesh.faces];
  const views = [];
  let size = 0;
  for (const [index, part] of parts.entries()) {
    const target = index === 2 ? ELEMENT_ARRAY_BUFFER : ARRAY_BUFFER;
    views.push({ buffer: 0, byteOffset: size, byteLength: part.byteLength, target });
    size += part.byteLength; // multiples of four all
  }
  const vertices = positions.length / 3;
  const document = {
    asset: { version: '2.0', generator: 'rilievo' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, translation: frame.center }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2, material: 0 }] }],
    materials: [
      { doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0.8, 0.77, 0.72, 1], metallicFactor: 0, roughnessFactor: 0.8 } },
    ],
    accessors: [
      { bufferView: 0, componentType: FLOAT, count: vertices, type: 'VEC3', min: low, max: high },
      { bufferView: 1, componentType: FLOAT, count: vertices, type: 'VEC3' },
      { bufferView: 2, componentType: UNSIGNED_INT, count: mesh.faces.length, type: 'SCALAR' },
    ],
    bufferViews: views,
    buffers: [{ byteLength: size }],
  };
  return written(document, parts, size);
}

function written(document: unknown, parts: ArrayBufferView[], size: number): Uint8Array<ArrayBuffer> {
  const text = new TextEncoder().encode(JSON.stringify(document));
  const textSize = (text.length + 3) & ~3;
  const bytes = new Uint8Array(12 + 8 + textSize + 8 + size);
  const view = new DataView(bytes.buffer);
  const words = [MAGIC, 2, bytes.length, textSize, JSON_CHUNK];
  words.forEach((word, index) => view.setUint32(4 * index, word, true));
  bytes.fill(0x20, 20, 20 + textSize);
  bytes.set(text, 20);
  let at = 20 + textSize;
  view.setUint32(at, size, true);
  view.setUint32(at + 4, BINARY_CHUNK, true);
  at += 8;
  for (const part of parts) {
    bytes.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += part.byteLength;
  }
  return bytes;
}
