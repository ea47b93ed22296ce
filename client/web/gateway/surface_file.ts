// GET /jobs/ID/surface.dss, and /jobs/ID/surface.glb with `?level=N`: the surface of a job that succeeded
// as one file. Errors as Connect writes them: {"code": ..., "message": ..., "details": ...}.
import { createHash } from 'node:crypto';
import { once } from 'node:events';
import type { IncomingMessage, ServerResponse } from 'node:http';
import { Code, ConnectError, type Client, createClient, type Transport } from '@connectrpc/connect';
import { codeToHttpStatus, errorToJson } from '@connectrpc/connect/protocol-connect';
import { JobsService } from '../generated/rilievo/v1/jobs_pb';
import { forwardedHeaders, handedOn, type TokenRule } from './forward';
import { glbOf, MAX_CONVERSIONS } from './glb';
import { boundUnread } from './limits';

/** A .dss that is made a GLB is held in memory. */
const MAX_GLB_SOURCE_BYTES = 64 << 20;

const PATH = /^\/jobs\/([\w.-]{1,200})\/surface\.(dss|glb)(?:\?level=(\d{1,2}))?$/;

interface Asked {
  jobId: string;
  format: 'dss' | 'glb';
  level: number | undefined;
}

function askedFor(url: string): Asked {
  const [, jobId = '', format, level] = PATH.exec(url) ?? [];
  if (!format || (format === 'dss' && level !== undefined)) {
    throw new ConnectError('ask for /jobs/ID/surface.dss, or /jobs/ID/surface.glb with ?level=N', Code.NotFound);
  }
  return { jobId, format: format as Asked['format'], level: level === undefined ? undefined : Number(level) };
}

/** The file piece by piece, its size first. The last piece comes only where the digest of all is right. */
async function* piecesOf(client: Client<typeof JobsService>, jobId: string, headers: Headers, signal: AbortSignal): AsyncGenerator<number | Uint8Array> {
  const digest = createHash('sha256');
  let wanted: Uint8Array = new Uint8Array();
  let total = 0;
  let arrived = 0;
  let held: Uint8Array | undefined;
  for await (const { message } of client.streamSurface({ jobId }, { headers, signal })) {
    if (message.case === 'surface') {
      total = Number(message.value.totalBytes);
      wanted = message.value.sha256;
      yield total;
    } else if (message.case === 'piece') {
      if (held) yield held;
      held = message.value.data;
      arrived += held.length;
      digest.update(held);
    }
  }
  if (!held || arrived !== total || (wanted.length > 0 && !digest.digest().equals(wanted))) {
    throw new ConnectError('the surface was damaged on its way; fetch it again', Code.DataLoss);
  }
  yield held;
}

export function surfaceFileHandler(transport: Transport, rule: TokenRule, page: string) {
  const client = createClient(JobsService, transport);
  let converting = 0;

  async function glbFrom(pieces: AsyncGenerator<number | Uint8Array>, level: number | undefined, signal: AbortSignal) {
    const parts: Uint8Array[] = [];
    for await (const piece of pieces) {
      if (typeof piece !== 'number') parts.push(piece);
      else if (piece > MAX_GLB_SOURCE_BYTES) {
        throw new ConnectError(`the surface has ${piece} bytes, the gateway makes a GLB of ${MAX_GLB_SOURCE_BYTES} at most; ` +
          'fetch surface.dss and use `rilievo export`', Code.FailedPrecondition);
      }
    }
    return glbOf(page, Buffer.concat(parts), level, signal);
  }

  /** A GLB has its place until the caller has all of it: till then it is held in memory. */
  async function sendGlb({ jobId, level }: Asked, pieces: AsyncGenerator<number | Uint8Array>, gone: AbortSignal, response: ServerResponse) {
    if (converting >= MAX_CONVERSIONS) {
      throw new ConnectError(`${MAX_CONVERSIONS} surfaces are being made GLB files or sent as such; try again later`, Code.ResourceExhausted);
    }
    converting += 1;
    try {
      const glb = await glbFrom(pieces, level, gone);
      if (gone.aborted) return;
      boundUnread(response.req);
      response.writeHead(200, headOf(jobId, 'glb', glb.length)).end(glb);
      await once(gone, 'abort');
    } finally {
      converting -= 1;
    }
  }

  async function sendDss({ jobId }: Asked, pieces: AsyncGenerator<number | Uint8Array>, response: ServerResponse) {
    for await (const piece of pieces) {
      if (typeof piece === 'number') response.writeHead(200, headOf(jobId, 'dss', piece));
      else if (!response.write(piece)) {
        await new Promise<void>((resolve) => ['drain', 'close'].forEach((event) => response.once(event, resolve)));
      }
    }
    response.end();
  }

  return async (request: IncomingMessage, response: ServerResponse): Promise<void> => {
    const gone = new AbortController();
    const { socket } = request;
    const end = () => gone.abort();
    // Of calls that one connection sends together only the first has a response that closes with it.
    socket.once('close', end);
    response.once('close', () => socket.off('close', end)).once('close', end);
    try {
      const asked = askedFor(request.url ?? '');
      const headers = forwardedHeaders((name) => request.headers[name]?.toString(), rule);
      const pieces = piecesOf(client, asked.jobId, headers, gone.signal);
      await (asked.format === 'glb' ? sendGlb(asked, pieces, gone.signal, response) : sendDss(asked, pieces, response));
    } catch (cause) {
      // A file that has begun ends before its end: its length says that it is not whole.
      if (response.headersSent) return void response.destroy();
      const error = handedOn(cause);
      response.writeHead(codeToHttpStatus(error.code), { 'content-type': 'application/json' });
      response.end(JSON.stringify(errorToJson(error, undefined)));
    }
  };
}

function headOf(jobId: string, format: string, bytes: number) {
  return {
    'content-type': format === 'glb' ? 'model/gltf-binary' : 'application/octet-stream',
    'content-length': `${bytes}`,
    'content-disposition': `attachment; filename="${jobId}.${format}"`,
    'cache-control': 'no-cache',
  };
}
