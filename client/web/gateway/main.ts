// The gateway: serves the page, and carries its calls to rilievod.
//   node gateway.mjs --server HOST:PORT [--listen HOST:PORT] [--page FOLDER] [--token-file FILE]
//                   [--tls-ca FILE] [--allow-host NAME]...
import { readFileSync } from 'node:fs';
import { createServer, type IncomingMessage, type ServerResponse } from 'node:http';
import { type AddressInfo } from 'node:net';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { connectNodeAdapter, createGrpcTransport } from '@connectrpc/connect-node';
import { fileHandler } from './files';
import { forwardCalls } from './forward';
import { uploadHandler } from './upload';

const USAGE = `usage: node gateway.mjs --server HOST:PORT [options]

  --server HOST:PORT  of a rilievod with --store; https://HOST:PORT for TLS
  --listen HOST:PORT  default 127.0.0.1:8080; port 0 takes a free one
  --page FOLDER       the built page; default: beside this program
  --file FILE         the page opens it; nothing else outside the page's folder is served
  --token-file FILE   a bearer token for callers that bring none
  --tls-ca FILE       who may have signed the server's certificate (PEM)
  --tls-cert FILE, --tls-key FILE
                      the gateway's own certificate, where the server asks for one
  --allow-host NAME   a further name by which the page may be called; may be repeated
  --until-input-ends  end with the standard input: with the program that started this one`;

function fail(message: string): never {
  console.error(`gateway: ${message}`);
  process.exit(2);
}

function options() {
  try {
    const { values } = parseArgs({
      options: {
        server: { type: 'string' }, listen: { type: 'string', default: '127.0.0.1:8080' },
        page: { type: 'string' }, 'token-file': { type: 'string' }, 'tls-ca': { type: 'string' },
        'tls-cert': { type: 'string' }, 'tls-key': { type: 'string' },
        'allow-host': { type: 'string', multiple: true, default: [] },
        file: { type: 'string' }, 'until-input-ends': { type: 'boolean' }, help: { type: 'boolean' },
      },
    });
    return values;
  } catch (error) {
    return fail(`${(error as Error).message}\n${USAGE}`);
  }
}

function textOf(path: string | undefined): string | undefined {
  try {
    return path === undefined ? undefined : readFileSync(path, 'utf8');
  } catch (error) {
    return fail((error as Error).message);
  }
}

/** The names in `Host` that are this gateway: a page of another name must not use it (DNS rebinding). */
function isOurs(request: IncomingMessage, names: Set<string>): boolean {
  const host = request.headers.host ?? '';
  const name = host.replace(/:\d+$/, '');
  const origin = request.headers.origin;
  return names.has(name) && (origin === undefined || origin.replace(/^https?:\/\//, '') === host);
}

function main(): void {
  const given = options();
  if (given.help) {
    console.log(USAGE);
    return;
  }
  if (!given.server) fail(`--server is missing\n${USAGE}`);
  // Without a host Node would listen everywhere.
  const address = /^(?:\[(.+)\]|([^:]+)):(\d+)$/.exec(given.listen!);
  if (!address) fail(`--listen '${given.listen}' is no HOST:PORT; give for example 127.0.0.1:8080`);
  const host = (address[1] ?? address[2])!;
  const shown = host.includes(':') ? `[${host}]` : host;
  const token = textOf(given['token-file'])?.trim();
  if (given['allow-host']!.includes('')) fail('--allow-host is empty; give the name by which the page is called');
  const transport = createGrpcTransport({
    baseUrl: /^https?:/.test(given.server) ? given.server : `http://${given.server}`,
    nodeOptions: { ca: textOf(given['tls-ca']), cert: textOf(given['tls-cert']), key: textOf(given['tls-key']) },
  });
  const names = new Set(['127.0.0.1', 'localhost', '[::1]', shown, ...given['allow-host']!]);
  const folder = resolve(given.page ?? join(dirname(fileURLToPath(import.meta.url)), 'page'));
  const files = fileHandler(folder, given.file);
  const upload = uploadHandler(transport, token);
  const calls = connectNodeAdapter({
    routes: (router) => forwardCalls(router, transport, token),
    fallback: (request, response) => files(request as IncomingMessage, response as ServerResponse),
  });
  const answer = (request: IncomingMessage, response: ServerResponse): void => {
    if (!isOurs(request, names)) {
      response.writeHead(403, { 'content-type': 'text/plain' })
        .end('this gateway does not answer to that name; start it with --allow-host\n');
    } else if (request.method === 'POST' && request.url === '/scans') {
      void upload(request, response);
    } else {
      calls(request, response);
    }
  };
  // Whatever one request brings, the next one is answered.
  const server = createServer((request, response) => {
    try {
      answer(request, response);
    } catch (error) {
      console.error(`gateway: ${request.method} ${request.url?.slice(0, 200)}: ${(error as Error).message}`);
      if (response.headersSent) response.destroy();
      else response.writeHead(500, { 'content-type': 'text/plain' }).end('the gateway failed at this request\n');
    }
  });
  // A large scan on a slow line takes longer than Node's five minutes; rilievod has limits of its own.
  server.requestTimeout = 0;
  server.on('error', (error) => fail(error.message));
  server.listen(Number(address[3]), host, () => {
    const { port } = server.address() as AddressInfo;
    const open = given.file === undefined ? '' : `#open=${encodeURIComponent(basename(given.file))}`;
    console.log(`rilievo on http://${shown}:${port}/${open}`);
  });
  if (given['until-input-ends']) process.stdin.resume().on('end', () => process.exit(0));
  for (const signal of ['SIGINT', 'SIGTERM'] as const) {
    process.on(signal, () => process.exit(0));
  }
}

main();
