// The points of a scan on their way to the server, with progress: fetch() tells none, so XMLHttpRequest.
import { ConnectError, type Code, Code as Codes } from '@connectrpc/connect';
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
      if (request.status === 200 && answer.scanId) resolve(answer.scanId);
      else reject(new ConnectError(answer.message ?? `HTTP ${request.status}`, answer.code ?? Codes.Unknown));
    };
    request.onerror = () => reject(new ConnectError('failed to fetch', Codes.Unavailable));
    request.onabort = () => reject(new ConnectError('cancelled', Codes.Canceled));
    signal.addEventListener('abort', () => request.abort());
    if (signal.aborted) reject(new ConnectError('cancelled', Codes.Canceled));
    else request.send(upload.bytes);
  });
}

function parsed(text: string): { scanId?: string; code?: Code; message?: string } {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}
