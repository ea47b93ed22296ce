// What one caller, or all of them, may take of the gateway.
import type { IncomingMessage, Server } from 'node:http';

/** Of one message; rilievod takes no larger one. */
export const MAX_MESSAGE_BYTES = 4 << 20;
/** Bodies of /scans that are on their way at a time. */
export const MAX_UPLOADS = 16;

const HEADER_SECONDS = 10;
const MESSAGE_SECONDS = 30;
const UNREAD_SECONDS = 30;

/** Connections, and how long one may take to say what it wants. */
export function boundConnections(server: Server, maxConnections: number): void {
  server.maxConnections = maxConnections;
  server.headersTimeout = HEADER_SECONDS * 1000;
  // Of a whole body: a large scan on a slow line takes longer, and rilievod bounds uploads itself. So
  // calls are bounded one by one.
  server.requestTimeout = 0;
}

/**
 * Ends a connection that takes nothing of what is sent to it, for a file that is held in memory. A
 * connection that is kept for further calls has its own time again.
 */
export function boundUnread({ socket }: IncomingMessage): void {
  socket.setTimeout(UNREAD_SECONDS * 1000);
}

/** Ends a call whose message does not come. */
export function boundMessage(request: IncomingMessage): void {
  const late = setTimeout(() => request.destroy(), MESSAGE_SECONDS * 1000);
  for (const event of ['end', 'close']) request.once(event, () => clearTimeout(late));
}
