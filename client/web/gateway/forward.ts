// Calls of the page, Connect or gRPC-web, as gRPC calls of rilievod.
import type { DescMethod, DescService } from '@bufbuild/protobuf';
import { Code, ConnectError, type ConnectRouter, type HandlerContext, type Transport } from '@connectrpc/connect';
import { JobsService } from '../generated/rilievo/v1/jobs_pb';
import { ReconstructionService } from '../generated/rilievo/v1/reconstruction_pb';

/** The page's own token goes on; without one the gateway's. */
export function forwardedHeaders(authorization: string | null, token: string | undefined): Headers {
  const headers = new Headers();
  if (authorization) headers.set('authorization', authorization);
  else if (token) headers.set('authorization', `Bearer ${token}`);
  return headers;
}

/** Every unary and server-streaming RPC; browsers cannot stream up, see upload.ts. */
export function forwardCalls(router: ConnectRouter, transport: Transport, token?: string): void {
  for (const service of [JobsService, ReconstructionService] as DescService[]) {
    for (const method of service.methods) forwardMethod(router, transport, method, token);
  }
}

function forwardMethod(router: ConnectRouter, transport: Transport, method: DescMethod, token?: string) {
  const headers = (context: HandlerContext) =>
    forwardedHeaders(context.requestHeader.get('authorization'), token);
  if (method.methodKind === 'unary') {
    router.rpc(method as DescMethod & { methodKind: 'unary' }, async (request, context) => {
      const answer = await transport.unary(
        method as DescMethod & { methodKind: 'unary' },
        context.signal, context.timeoutMs(), headers(context), request,
      );
      return answer.message;
    });
  } else if (method.methodKind === 'server_streaming') {
    router.rpc(method as DescMethod & { methodKind: 'server_streaming' }, async function* (request, context) {
      const answer = await transport.stream(
        method as DescMethod & { methodKind: 'server_streaming' },
        context.signal, context.timeoutMs(), headers(context),
        (async function* () { yield request; })(),
      );
      yield* answer.message;
    });
  } else {
    router.rpc(method as DescMethod & { methodKind: 'client_streaming' }, () => {
      throw new ConnectError('browsers cannot stream up; post the points to /scans', Code.Unimplemented);
    });
  }
}
