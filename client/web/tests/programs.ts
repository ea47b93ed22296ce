// rilievod and the gateway as they run for people, on free ports of loopback.
import { type ChildProcess, execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { join } from 'node:path';
import { createInterface } from 'node:readline';

const { BIN = '', WEB = '' } = process.env;
const START_SECONDS = 20;

export interface Program {
  address: string;
  pid: number;
  stop(): Promise<void>;
}

/** Starts a program and waits for the line that says where it listens. */
async function started(command: string, words: string[], line: RegExp): Promise<Program> {
  const child: ChildProcess = spawn(command, words, { stdio: ['ignore', 'pipe', 'pipe'] });
  let said = '';
  child.stderr!.on('data', (text) => (said = (said + text).slice(-4000)));
  const address = await new Promise<string>((resolve, reject) => {
    const late = setTimeout(() => reject(new Error(`${command} did not start: ${said}`)), START_SECONDS * 1000);
    child.on('exit', (code) => reject(new Error(`${command} ended with ${code}: ${said}`)));
    createInterface({ input: child.stdout! }).on('line', (text) => {
      const found = line.exec(text);
      if (!found) return;
      clearTimeout(late);
      resolve(found[1]!);
    });
  });
  const stop = async () => {
    if (child.exitCode !== null) return;
    child.kill('SIGTERM');
    await once(child, 'exit');
  };
  return { address, pid: child.pid!, stop };
}

export function startServer(store: string, ...more: string[]): Promise<Program> {
  return started(join(BIN, 'rilievod'), ['--listen', '127.0.0.1:0', '--store', store, '--drain-seconds', '1', ...more],
    /listening on (\S+)/);
}

export function startGateway(server: string, ...more: string[]): Promise<Program> {
  return started('node', [join(WEB, 'gateway.mjs'), '--server', server, '--listen', '127.0.0.1:0', ...more],
    /rilievo on (\S+)/);
}

/** A token that the server accepts which is started with `--tokens file`. */
export function makeToken(name: string, file: string): string {
  return execFileSync(join(BIN, 'rilievod'), ['--make-token', name, '--tokens', file], { encoding: 'utf8' }).trim();
}

export function startViewer(file: string): Promise<Program> {
  return started(join(BIN, 'rilievo'), ['view', file, '--open'], /^(http\S+)$/);
}

export function rilievo(...words: string[]): string {
  return execFileSync(join(BIN, 'rilievo'), words, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}
