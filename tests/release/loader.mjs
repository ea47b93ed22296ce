// The npm package in Node: the decoder, and the three.js loader on a file that arrives in pieces.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { setTimeout } from 'node:timers/promises';
import { DecoderError, loadDecoder } from '@rilievo/decoder';
import { DSSLoader } from '@rilievo/decoder/three';

const bytes = readFileSync(process.argv[2]);
const decoder = await loadDecoder();
const surface = decoder.decode(bytes);
const info = surface.info();
assert.equal(surface.tessellate(info.max_level).vertices.length / 3, info.levels.at(-1).vertices);
surface.free();
assert.throws(() => decoder.decode(Buffer.from('not a surface')), DecoderError);

const server = createServer(async (_request, response) => {
  let sent = 0;
  const levels = info.levels.slice(0, -1).map((_level, i) => decoder.wholeBytes(bytes, i));
  for (const end of [info.chunk_bytes[0], ...levels]) {
    response.write(bytes.subarray(sent, end));
    sent = end;
    await setTimeout(50);
  }
  response.end(bytes.subarray(sent));
}).listen(0, '127.0.0.1');
await new Promise((resolve) => server.once('listening', resolve));
const address = `http://127.0.0.1:${server.address().port}/a.dss`;
const triangles = [];
const geometry = await new DSSLoader().loadLevels(address, (finer) => triangles.push(finer.index.count / 3));
server.close();
assert.ok(triangles.length >= 3, `${triangles}`);
assert.ok(triangles.every((count, i) => i === 0 || count >= triangles[i - 1]), `${triangles}`);
assert.equal(geometry.index.count / 3, info.levels.at(-1).faces);
const { center } = geometry.userData;
geometry.computeBoundingBox();
assert.ok(geometry.boundingBox.max.x > 0 && Number.isFinite(center[0]));
console.log(`triangles: ${triangles}`);
