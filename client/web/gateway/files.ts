// The built page, from one folder, and the file that it is to open.
import { createReadStream, statSync } from 'node:fs';
import type { IncomingMessage, ServerResponse } from 'node:http';
import { extname, join, normalize, sep } from 'node:path';

const TYPES: Record<string, string> = {
  '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css',
  '.wasm': 'application/wasm', '.svg': 'image/svg+xml', '.json': 'application/json',
};

/** `opened`: a file anywhere, as /opened, that the page takes for one that was dropped on it. */
export function fileHandler(folder: string, opened?: string) {
  return (request: IncomingMessage, response: ServerResponse): void => {
    const path = decodedPath(request.url ?? '/');
    const given = path === '/opened' ? opened : undefined;
    const file = given ?? (path && normalize(join(folder, path === '/' ? 'index.html' : path)));
    if (!path || !file || !(given || file.startsWith(folder + sep)) || !isFile(file)) {
      response.writeHead(404, { 'content-type': 'text/plain' }).end('not found\n');
      return;
    }
    // Names of assets hold a hash of what is in them.
    const cache = path.startsWith('/assets/') ? 'public, max-age=31536000, immutable' : 'no-cache';
    response.writeHead(200, {
      'content-type': TYPES[extname(file)] ?? 'application/octet-stream',
      'cache-control': cache,
    });
    if (request.method === 'HEAD') response.end();
    else createReadStream(file).on('error', () => response.destroy()).pipe(response);
  };
}

function decodedPath(url: string): string | undefined {
  try {
    return decodeURIComponent(new URL(url, 'http://gateway').pathname);
  } catch {
    return undefined;
  }
}

/** Of any text: a name that no file can have, too long or with a zero in it, is no file's. */
function isFile(path: string): boolean {
  try {
    return statSync(path).isFile();
  } catch {
    return false;
  }
}
