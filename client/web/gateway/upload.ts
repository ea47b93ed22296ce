// POST /scans: the points of a scan as the body of one request, handed on as UploadScan.
//
// Headers: content-length, x-upload-id, x-scan-sha256 (64 hexadecimal digits, of the body). Answers
// 200 {"scanId": ...} or an error as Connect writes them: {"code": ..., "message": ..., "details": ...}.
import type { IncomingMessage, ServerResponse } from 'node:http';
import { Code, ConnectError, type Client, createClient, type Transport } from '@connectrpc/connect';
import { codeToHttpStatus, errorToJson } from '@connectrpc/connect/protocol-connect';
import { JobsService } from '../generated/rilievo/v1/jobs_pb';
import { forwardedHeaders, type TokenRule } from './forward';
import { MAX_UPLOADS } from './limits';

/** Well below limits.max_chunk_bytes of any server. */
const MESSAGE_BYTES = 256 * 1024;

interface Upload {
  id: string;
  totalBytes: number;
  sha256: Uint8Array;
}

function uploadOf(request: IncomingMessage): Upload {
  const totalBytes = Number(request.headers['content-length']);
  const id = `${request.headers['x-upload-id'] ?? ''}`;
  const digest = `${request.headers['x-scan-sha256'] ?? ''}`;
  if (!Number.isSafeInteger(totalBytes) || totalBytes < 1) {
    throw new ConnectError('content-length is missing; send the points with their size', Code.InvalidArgument);
  }
  if (!/^[0-9a-f]{64}$/i.test(digest)) {
    throw new ConnectError(`x-scan-sha256 '${digest.slice(0, 80)}' is no SHA-256; send 64 hexadecimal digits`, Code.InvalidArgument);
  }
  return { id, totalBytes, sha256: Uint8Array.from(Buffer.from(digest, 'hex')) };
}

async function* messages(request: IncomingMessage, upload: Upload) {
  const { id, totalBytes, sha256 } = upload;
  yield {
    message: { case: 'header' as const, value: { uploadId: id, offset: 0n, totalBytes: BigInt(totalBytes) } },
  };
  for await (const piece of request as AsyncIterable<Buffer>) {
    for (let begin = 0; begin < piece.length; begin += MESSAGE_BYTES) {
      yield { message: { case: 'chunk' as const, value: Uint8Array.from(piece.subarray(begin, begin + MESSAGE_BYTES)) } };
    }
  }
  yield { message: { case: 'end' as const, value: { totalBytes: BigInt(totalBytes), sha256 } } };
}

async function storeScan(client: Client<typeof JobsService>, request: IncomingMessage,
                         signal: AbortSignal, rule: TokenRule): Promise<string> {
  const headers = forwardedHeaders((name) => request.headers[name]?.toString(), rule);
  const answer = await client.uploadScan(messages(request, uploadOf(request)), { signal, headers });
  return answer.scanId;
}

export function uploadHandler(transport: Transport, rule: TokenRule) {
  const client = createClient(JobsService, transport);
  let underWay = 0;
  return async (request: IncomingMessage, response: ServerResponse): Promise<void> => {
    const gone = new AbortController();
    response.on('close', () => gone.abort());
    const answer = (status: number, body: unknown) => {
      if (response.headersSent || response.destroyed) return;
      // What is left of the body is not read: the connection ends with the answer.
      response.writeHead(status, { 'content-type': 'application/json', connection: 'close' });
      response.end(JSON.stringify(body));
    };
    underWay += 1;
    try {
      if (underWay > MAX_UPLOADS) {
        throw new ConnectError(`${MAX_UPLOADS} scans are on their way through the gateway; try again later`, Code.ResourceExhausted);
      }
      answer(200, { scanId: await storeScan(client, request, gone.signal, rule) });
    } catch (cause) {
      const error = ConnectError.from(cause);
      answer(codeToHttpStatus(error.code), errorToJson(error, undefined));
    } finally {
      underWay -= 1;
    }
  };
}
