// A small E57 file (ASTM E2807-11): one scan of cartesian floats in one packet.

const PAGE = 1024;
const PAYLOAD = PAGE - 4;

function crc32c(bytes: Buffer): number {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0x82f63b78 : 0);
  }
  return (crc ^ 0xffffffff) >>> 0;
}

const physical = (at: number) => Math.floor(at / PAYLOAD) * PAGE + (at % PAYLOAD);

/** `points`: x, y, z each, at most 5000 points, which is what a packet holds. */
export function e57File(points: Float32Array): Buffer {
  const count = points.length / 3;
  const packet = Buffer.alloc(Math.ceil((12 + 4 * points.length) / 4) * 4);
  packet.writeUInt16LE(1, 0);
  packet.writeUInt16LE(packet.length - 1, 2);
  packet.writeUInt16LE(3, 4);
  for (let axis = 0; axis < 3; ++axis) {
    packet.writeUInt16LE(4 * count, 6 + 2 * axis);
    for (let i = 0; i < count; ++i) packet.writeFloatLE(points[3 * i + axis]!, 12 + 4 * (axis * count + i));
  }
  const section = Buffer.alloc(32);
  section[0] = 1;
  section.writeBigUInt64LE(BigInt(32 + packet.length), 8);
  section.writeBigUInt64LE(BigInt(physical(48 + 32)), 16);
  const fields = ['X', 'Y', 'Z'].map((axis) => `<cartesian${axis} type="Float" precision="single"/>`).join('');
  const xml = Buffer.from(
    `<?xml version="1.0"?><e57Root><data3D><vectorChild><points fileOffset="48" recordCount="${count}">` +
      `<prototype>${fields}</prototype></points></vectorChild></data3D></e57Root>`,
  );
  const xmlAt = 48 + section.length + packet.length;
  const pages = Math.ceil((xmlAt + xml.length) / PAYLOAD);
  const logical = Buffer.alloc(pages * PAYLOAD);
  logical.write('ASTM-E57', 0, 'latin1');
  logical.writeUInt32LE(1, 8);
  [pages * PAGE, physical(xmlAt), xml.length, PAGE].forEach((value, i) => logical.writeBigUInt64LE(BigInt(value), 16 + 8 * i));
  section.copy(logical, 48);
  packet.copy(logical, 80);
  xml.copy(logical, xmlAt);
  const file = Buffer.alloc(pages * PAGE);
  for (let page = 0; page < pages; ++page) {
    const payload = logical.subarray(page * PAYLOAD, (page + 1) * PAYLOAD);
    payload.copy(file, page * PAGE);
    file.writeUInt32BE(crc32c(payload), page * PAGE + PAYLOAD);
  }
  return file;
}
