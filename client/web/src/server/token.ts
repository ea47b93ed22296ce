// The token that the server asks for. In the page's memory alone: it ends with the page.
import type { Interceptor } from '@connectrpc/connect';

let token = '';

export function useToken(given: string): void {
  token = given.trim();
}

/** The header `authorization`, where a token was given. */
export function authorization(): string | undefined {
  return token ? `Bearer ${token}` : undefined;
}

export const withToken: Interceptor = (next) => (request) => {
  const value = authorization();
  if (value) request.header.set('authorization', value);
  return next(request);
};
