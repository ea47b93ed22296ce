// What the command line says, checked.
import { readFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

const USAGE = `usage: node gateway.mjs --server HOST:PORT [options]

  --server HOST:PORT  of a rilievod with --store; https://HOST:PORT for TLS
  --listen HOST:PORT  default 127.0.0.1:8080; port 0 takes a free one
  --page FOLDER       the built page; default: beside this program
  --file FILE         the page opens it; nothing else outside the page's folder is served
  --token-file FILE   a bearer token for callers that bring none
  --tls-ca FILE       who may have signed the server's certificate (PEM)
  --tls-cert FILE, --tls-key FILE
                      the gateway's own certificate, where the server asks for one
  --allow-plaintext   listen unencrypted where other machines reach the address, or
                      send tokens unencrypted to another machine
  --allow-host NAME   a further name by which the page may be called; may be repeated
  --max-connections N open at a time; default 256
  --until-input-ends  end with the standard input: with the program that started this one`;

export interface Options {
  /** Where to listen. `shown`: the host as it stands in a URL. */
  host: string;
  shown: string;
  port: number;
  /** Of rilievod. */
  serverUrl: string;
  tls: { ca?: string; cert?: string; key?: string };
  /** For callers that bring none. */
  token: string | undefined;
  /** Whether tokens may go to the server: over TLS, to this machine, or where that was allowed. */
  mayCarryTokens: boolean;
  page: string;
  file: string | undefined;
  /** Names by which the page may be called. */
  names: Set<string>;
  maxConnections: number;
  untilInputEnds: boolean;
}

export function fail(message: string): never {
  console.error(`gateway: ${message}`);
  process.exit(2);
}

/** Whether a host never leaves this machine. As in the other clients: a name such as 127.example.org may lie anywhere. */
export function isLocalHost(host: string): boolean {
  const name = host.replace(/^\[(.*)\]$/, '$1');
  return name === 'localhost' || name === '::1' || /^127\.[\d.]*$/.test(name);
}

function words() {
  try {
    const { values } = parseArgs({
      options: {
        server: { type: 'string' }, listen: { type: 'string', default: '127.0.0.1:8080' },
        page: { type: 'string' }, 'token-file': { type: 'string' }, 'tls-ca': { type: 'string' },
        'tls-cert': { type: 'string' }, 'tls-key': { type: 'string' },
        'allow-plaintext': { type: 'boolean', default: false },
        'allow-host': { type: 'string', multiple: true, default: [] },
        'max-connections': { type: 'string', default: '256' },
        file: { type: 'string' }, 'until-input-ends': { type: 'boolean', default: false }, help: { type: 'boolean' },
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

function urlOf(server: string): URL {
  const url = /^https?:/.test(server) ? server : `http://${server}`;
  return URL.canParse(url) ? new URL(url) : fail(`--server '${server}' is not HOST:PORT; give for example 127.0.0.1:50051`);
}

export function readOptions(): Options {
  const given = words();
  if (given.help) {
    console.log(USAGE);
    process.exit(0);
  }
  if (!given.server) fail(`--server is missing\n${USAGE}`);
  // Without a host Node would listen everywhere.
  const address = /^(?:\[(.+)\]|([^:]+)):(\d+)$/.exec(given.listen);
  if (!address) fail(`--listen '${given.listen}' is not HOST:PORT; give for example 127.0.0.1:8080`);
  const host = (address[1] ?? address[2])!;
  const shown = host.includes(':') ? `[${host}]` : host;
  if (given['allow-host'].includes('')) fail('--allow-host is empty; give the name by which the page is called');
  const maxConnections = Number(given['max-connections']);
  if (!(Number.isInteger(maxConnections) && maxConnections >= 1)) {
    fail(`--max-connections '${given['max-connections']}' is not a number from 1 on`);
  }
  const server = urlOf(given.server);
  const mayCarryTokens = given['allow-plaintext'] || server.protocol === 'https:' || isLocalHost(server.hostname);
  const token = textOf(given['token-file'])?.trim();
  if (token && !mayCarryTokens) {
    fail(`the token would travel unencrypted to ${given.server}; give https://HOST:PORT, or --allow-plaintext`);
  }
  if (!given['allow-plaintext'] && !isLocalHost(host)) {
    fail(`--listen ${given.listen} is reached by other machines, and scans and tokens would travel unencrypted; ` +
      'listen on 127.0.0.1 behind a proxy with TLS, or give --allow-plaintext');
  }
  return {
    host, shown, port: Number(address[3]), serverUrl: server.origin, token, mayCarryTokens, maxConnections,
    tls: { ca: textOf(given['tls-ca']), cert: textOf(given['tls-cert']), key: textOf(given['tls-key']) },
    page: resolve(given.page ?? join(dirname(fileURLToPath(import.meta.url)), 'page')),
    file: given.file,
    names: new Set(['127.0.0.1', 'localhost', '[::1]', shown, ...given['allow-host']]),
    untilInputEnds: given['until-input-ends'],
  };
}
