// The gateway: serves the page, and carries its calls to rilievod. `--help` lists its options.
import { createServer, type IncomingMessage, type RequestListener, type ServerResponse } from 'node:http';
import { type AddressInfo } from 'node:net';
import { basename } from 'node:path';
import { isMainThread } from 'node:worker_threads';
import { createRegistry } from '@bufbuild/protobuf';
import { connectNodeAdapter, createGrpcTransport } from '@connectrpc/connect-node';
import { file_google_rpc_error_details } from '../generated/google/rpc/error_details_pb';
import { fileHandler } from './files';
import { forwardCalls } from './forward';
import { convert } from './glb';
import { boundConnections, boundMessage, MAX_MESSAGE_BYTES } from './limits';
import { fail, type Options, readOptions } from './options';
import { secure } from './security_headers';
import { surfaceFileHandler } from './surface_file';
import { uploadHandler } from './upload';

/** Nothing is inflated: a few kilobytes can hold gigabytes. */
const BOUNDS = { readMaxBytes: MAX_MESSAGE_BYTES, acceptCompression: [] };

/** The names in `Host` that are this gateway: a page of another name must not use it (DNS rebinding). */
function isOurs(request: IncomingMessage, names: Set<string>): boolean {
  const host = request.headers.host ?? '';
  const name = host.replace(/:\d+$/, '');
  const origin = request.headers.origin;
  return names.has(name) && (origin === undefined || origin.replace(/^https?:\/\//, '') === host);
}

function answers(options: Options): RequestListener {
  const transport = createGrpcTransport({ baseUrl: options.serverUrl, nodeOptions: options.tls, ...BOUNDS });
  const files = fileHandler(options.page, options.file);
  const upload = uploadHandler(transport, options);
  const surfaceFile = surfaceFileHandler(transport, options, options.page);
  const calls = connectNodeAdapter({
    ...BOUNDS,
    // The error of a job that failed holds messages of these types.
    jsonOptions: { registry: createRegistry(file_google_rpc_error_details) },
    routes: (router) => forwardCalls(router, transport, options),
    fallback: (request, response) => files(request as IncomingMessage, response as ServerResponse),
  });
  return (request, response) => {
    if (!isOurs(request, options.names)) {
      response.writeHead(403, { 'content-type': 'text/plain' })
        .end('this gateway does not answer to that name; start it with --allow-host\n');
    } else if (request.method === 'POST' && request.url === '/scans') {
      void upload(request, response);
    } else if (request.method === 'GET' && request.url?.startsWith('/jobs/')) {
      void surfaceFile(request, response);
    } else {
      if (request.method === 'POST') boundMessage(request);
      calls(request, response);
    }
  };
}

function main(): void {
  const options = readOptions();
  const answer = answers(options);
  // Whatever one request brings, the next one is answered.
  const server = createServer({ connectionsCheckingInterval: 2000 }, (request, response) => {
    try {
      secure(response);
      answer(request, response);
    } catch (error) {
      console.error(`gateway: ${request.method} ${request.url?.slice(0, 200)}: ${(error as Error).message}`);
      if (response.headersSent) response.destroy();
      else response.writeHead(500, { 'content-type': 'text/plain' }).end('the gateway failed at this request\n');
    }
  });
  boundConnections(server, options.maxConnections);
  server.on('error', (error) => fail(error.message));
  server.listen(options.port, options.host, () => {
    const { port } = server.address() as AddressInfo;
    const open = options.file === undefined ? '' : `#open=${encodeURIComponent(basename(options.file))}`;
    console.log(`rilievo on http://${options.shown}:${port}/${open}`);
  });
  if (options.untilInputEnds) process.stdin.resume().on('end', () => process.exit(0));
  for (const signal of ['SIGINT', 'SIGTERM'] as const) {
    process.on(signal, () => process.exit(0));
  }
}

if (isMainThread) main();
else void convert();
