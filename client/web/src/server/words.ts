// Errors as sentences for people.
import { Code, ConnectError } from '@connectrpc/connect';
import { BadRequestSchema, RetryInfoSchema } from '../../generated/google/rpc/error_details_pb';
import { DecoderError } from '../decoder/module';

const LEAD: Partial<Record<Code, string>> = {
  [Code.Unavailable]: 'The server cannot be reached',
  [Code.Unauthenticated]: 'The server asks who you are',
  [Code.PermissionDenied]: 'The server does not allow this',
  [Code.ResourceExhausted]: 'The server has no room for this now',
  [Code.DeadlineExceeded]: 'This took too long',
  [Code.InvalidArgument]: 'The server cannot work with this',
  [Code.FailedPrecondition]: 'This is not possible as things are',
  [Code.DataLoss]: 'Something was lost on the way',
  [Code.NotFound]: 'This is no longer there',
  [Code.Canceled]: 'Cancelled',
};

function sentence(text: string): string {
  const trimmed = text.trim().replace(/^./, (letter) => letter.toUpperCase());
  return /[.!?]$/.test(trimmed) ? trimmed : `${trimmed}.`;
}

export function inWords(error: unknown): string {
  if (error instanceof DecoderError) return sentence(error.message);
  const { code, rawMessage } = ConnectError.from(error);
  const cause = causeOf(error, rawMessage);
  // A browser's own words for a connection that failed say nothing to people.
  const foreign = /failed to fetch|networkerror|load failed|HTTP 5\d\d|ECONNREFUSED/i.test(cause);
  const lead = foreign ? LEAD[Code.Unavailable] : LEAD[code];
  const parts = [lead ?? 'Something went wrong'];
  if (!foreign && cause && code !== Code.Canceled) parts.push(cause);
  else if (foreign) parts.push('is it running?');
  return [sentence(parts.join(': ')), ...remedies(error)].join(' ');
}

/** What is wrong with each field, without its name in the protocol: the page asks for none of them. */
function causeOf(error: unknown, message: string): string {
  const fields = error instanceof ConnectError ? error.findDetails(BadRequestSchema).flatMap((detail) => detail.fieldViolations) : [];
  return fields.length > 0 ? fields.map(({ description }) => description).join('; ') : message;
}

function remedies(error: unknown): string[] {
  const retry = error instanceof ConnectError ? error.findDetails(RetryInfoSchema)[0]?.retryDelay : undefined;
  return retry ? [`Try again in ${Math.max(1, Number(retry.seconds))} seconds.`] : [];
}
