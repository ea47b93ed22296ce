// The points of a scan on their way to the server, with progress: fetch() tells none, so XMLHttpRequest.
import type { JsonObject } from '@bufbuild/protobuf';
import { Code, ConnectError } from '@connectrpc/connect';
import { errorFromJson } from '@connectrpc/connect/protocol-connect';
import { authorization } from './token';

export interface PointUpload {
  id: string;
  bytes: Uint8Array<ArrayBuffer>;
  sha256: string;
}

/** Gives the scan's name at the server. `onSent` hears of bytes that have left. */
export function uploadScan(upload: PointUpload, signal: AbortSignal, onSent: (fraction: number) => void): Promise<string> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('POST', 'scans');
    request.setRequestHeader('x-upload-id', upload.id);
    request.setRequestHeader('x-scan-sha256', upload.sha256);
    request.setRequestHeader('content-type', 'application/octet-stream');
    const token = authorization();
    if (token) request.setRequestHeader('authorization', token);
    request.upload.onprogress = ({ loaded, total }) => onSent(total > 0 ? loaded / total : 0);
    request.onload = () => {
      const answer = parsed(request.responseText);
      if (request.status === 200 && typeof answer.scanId === 'string') resolve(answer.scanId);
      else reject(errorOf(answer, request.status));
    };
    request.onerror = () => reject(new ConnectError('failed to fetch', Code.Unavailable));
    request.onabort = () => reject(new ConnectError('cancelled', Code.Canceled));
    signal.addEventListener('abort', () => request.abort());
    if (signal.aborted) reject(new ConnectError('cancelled', Code.Canceled));
    else request.send(upload.bytes);
  });
}

function errorOf(answer: JsonObject, status: number): ConnectError {
  const wordless = new ConnectError(`HTTP ${status}`, Code.Unknown);
  try {
    return errorFromJson(answer, undefined, wordless);
  } catch {
    return wordless; // of what stands between page and gateway
  }
}

function parsed(text: string): JsonObject {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}
