// Surfaces as GLB files, by the decoder of the page, each in a thread of its own.
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { parentPort, Worker, workerData } from 'node:worker_threads';
import { Code, ConnectError } from '@connectrpc/connect';
import { DecoderError, DecoderModule } from '../src/decoder/module';

/** At a time: one may take some hundred megabytes. */
export const MAX_CONVERSIONS = 2;

interface Work {
  wasm: string;
  bytes: Uint8Array;
  level: number | undefined;
}

type Done = { glb: Uint8Array } | { code: number; message: string };

/** At `level`, by default the finest. The bytes are those that the page saves. */
export async function glbOf(page: string, bytes: Uint8Array, level: number | undefined, signal: AbortSignal): Promise<Uint8Array> {
  const assets = join(page, 'assets');
  const name = readdirSync(assets).find((file) => file.endsWith('.wasm'));
  if (!name) throw new ConnectError(`there is no decoder in ${assets}; build the page`, Code.Internal);
  const work: Work = { wasm: join(assets, name), bytes, level };
  const worker = new Worker(new URL(import.meta.url), { workerData: work });
  signal.addEventListener('abort', () => void worker.terminate());
  const done = await new Promise<Done>((resolve, reject) => {
    worker.once('message', resolve).once('error', reject);
    worker.once('exit', () => reject(new ConnectError('the caller has gone', Code.Canceled)));
  });
  if ('glb' in done) return done.glb;
  throw new ConnectError(done.message, done.code as Code);
}

/** What the thread does. */
export async function convert(): Promise<void> {
  const { wasm, bytes, level } = workerData as Work;
  try {
    const decoder = await DecoderModule.load(readFileSync(wasm));
    const surface = decoder.decode(bytes);
    parentPort!.postMessage({ glb: surface.file('glb', level ?? surface.info().max_level) } satisfies Done);
  } catch (error) {
    const code = error instanceof DecoderError ? error.code : Code.Internal;
    parentPort!.postMessage({ code, message: (error as Error).message } satisfies Done);
  }
}
