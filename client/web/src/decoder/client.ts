// The worker as promises. Tasks are done in the order in which they are asked.
import type { Answered, TaskName, Tasks } from './messages';
import { DecoderError } from './module';

export class DecoderClient {
  readonly #worker = new Worker(new URL('./worker.ts', import.meta.url), { type: 'module' });
  readonly #waiting = new Map<number, { resolve(answer: unknown): void; reject(error: Error): void }>();
  #next = 0;

  constructor() {
    this.#worker.onmessage = ({ data }: MessageEvent<Answered>) => {
      const waiting = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if (data.error) waiting?.reject(new DecoderError(data.error.code, data.error.message));
      else waiting?.resolve(data.answer);
    };
    this.#worker.onerror = () => {
      for (const { reject } of this.#waiting.values()) {
        reject(new DecoderError(13, 'the decoder has stopped; load the page again'));
      }
      this.#waiting.clear();
    };
  }

  ask<N extends TaskName>(task: N, ask: Tasks[N]['ask']): Promise<Tasks[N]['answer']> {
    const id = ++this.#next;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve: resolve as (answer: unknown) => void, reject });
      this.#worker.postMessage({ id, task, ask });
    });
  }
}
