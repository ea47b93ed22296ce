// Scans that are compressed with gzip, unpacked by the browser itself. There is no zstd in browsers: the
// reader says what to do.
import { DecoderError } from '../decoder/module';

/** As the command line bounds it (client/formats/unpacked_input.h): bytes for any file, and for each of its own. */
const ANY_FILE = 64 << 20;
const PER_BYTE = 100;

/** The bytes that a gzip file holds; others as they are. */
export async function unpacked(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) return bytes;
  const most = ANY_FILE + PER_BYTE * bytes.length;
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  const parts: Uint8Array[] = [];
  let size = 0;
  for (;;) {
    const { done, value } = await reader.read().catch(() => {
      throw new DecoderError(15, 'gzip: the compressed data are damaged, cut off, or of several members; unpack the file first (gunzip)');
    });
    if (done) break;
    size += value.length;
    if (size > most) {
      void reader.cancel().catch(() => undefined);
      throw new DecoderError(3, `gzip: inflates to more than ${most} bytes, the limit for a compressed file of ${bytes.length}; if it is what it should be, unpack it first (gunzip)`);
    }
    parts.push(value);
  }
  const whole = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    whole.set(part, at);
    at += part.length;
  }
  return whole;
}
