// Calls of the page, Connect or gRPC-web, as gRPC calls of rilievod.
import type { DescMethod, DescService } from '@bufbuild/protobuf';
import { Code, ConnectError, type ConnectRouter, type HandlerContext, type Transport } from '@connectrpc/connect';
import { JobsService } from '../generated/rilievo/v1/jobs_pb';
import { ReconstructionService } from '../generated/rilievo/v1/reconstruction_pb';

/** Which tokens go to the server. */
export interface TokenRule {
  /** Of callers that bring none. */
  token: string | undefined;
  /** False where they would travel unencrypted to another machine. */
  mayCarryTokens: boolean;
}

/** The caller's own token goes on, else the gateway's; and the trace that the call belongs to. */
export function forwardedHeaders(given: (name: string) => string | null | undefined, rule: TokenRule): Headers {
  const headers = new Headers();
  const authorization = given('authorization') ?? (rule.token && `Bearer ${rule.token}`);
  if (authorization && !rule.mayCarryTokens) {
    throw new ConnectError('the token would travel unencrypted from the gateway to the server; ' +
      'start it with --server https://HOST:PORT, or with --allow-plaintext', Code.FailedPrecondition);
  }
  if (authorization) headers.set('authorization', authorization);
  const trace = given('traceparent');
  if (trace) headers.set('traceparent', trace);
  return headers;
}

/** Code, message and details. The headers that brought them tell of the other call, not of this one. */
export function handedOn(error: unknown): ConnectError {
  const { rawMessage, code, details } = ConnectError.from(error);
  const own = new ConnectError(rawMessage, code);
  own.details = details;
  return own;
}

/** Every unary and server-streaming RPC; browsers cannot stream up, see upload.ts. */
export function forwardCalls(router: ConnectRouter, transport: Transport, rule: TokenRule): void {
  for (const service of [JobsService, ReconstructionService] as DescService[]) {
    for (const method of service.methods) forwardMethod(router, transport, method, rule);
  }
}

function forwardMethod(router: ConnectRouter, transport: Transport, method: DescMethod, rule: TokenRule) {
  const headers = (context: HandlerContext) => forwardedHeaders((name) => context.requestHeader.get(name), rule);
  if (method.methodKind === 'unary') {
    router.rpc(method as DescMethod & { methodKind: 'unary' }, async (request, context) => {
      try {
        const answer = await transport.unary(
          method as DescMethod & { methodKind: 'unary' },
          context.signal, context.timeoutMs(), headers(context), request,
        );
        return answer.message;
      } catch (error) {
        throw handedOn(error);
      }
    });
  } else if (method.methodKind === 'server_streaming') {
    router.rpc(method as DescMethod & { methodKind: 'server_streaming' }, async function* (request, context) {
      try {
        const answer = await transport.stream(
          method as DescMethod & { methodKind: 'server_streaming' },
          context.signal, context.timeoutMs(), headers(context),
          (async function* () { yield request; })(),
        );
        yield* answer.message;
      } catch (error) {
        throw handedOn(error);
      }
    });
  } else {
    router.rpc(method as DescMethod & { methodKind: 'client_streaming' }, () => {
      throw new ConnectError('browsers cannot stream up; post the points to /scans', Code.Unimplemented);
    });
  }
}
