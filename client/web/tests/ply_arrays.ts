// What a mesh file of ours holds, as bytes to be compared.
import assert from 'node:assert/strict';

/** Of a binary PLY of ours with double vertices, normals and sources: the bytes of x, y, z and of the corners. */
export function arraysOfPly(file: Buffer): { vertices: Buffer; faces: Buffer } {
  const end = file.indexOf('end_header\n') + 11;
  const header = file.toString('latin1', 0, end);
  assert.match(header, /property double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar source\n/);
  const [vertices, faces] = ['vertex', 'face'].map((name) => Number(new RegExp(`element ${name} (\\d+)`).exec(header)![1])) as [number, number];
  const row = 3 * 8 + 3 * 4 + 1;
  const corners = file.subarray(end + vertices * row);
  assert.equal(corners.length, faces * 13);
  const pick = (from: Buffer, count: number, size: number, at: number, bytes: number) =>
    Buffer.concat(Array.from({ length: count }, (_row, i) => from.subarray(i * size + at, i * size + at + bytes)));
  return { vertices: pick(file.subarray(end), vertices, row, 0, 24), faces: pick(corners, faces, 13, 1, 12) };
}
