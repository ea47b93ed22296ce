// A scan's way through the server: upload, job, events, surface. All of it may be broken off.
import { createClient, ConnectError, Code } from '@connectrpc/connect';
import { createConnectTransport } from '@connectrpc/connect-web';
import { type Job, JobsService, JobState } from '../../generated/rilievo/v1/jobs_pb';
import { UpDirection } from '../../generated/rilievo/v1/options_pb';
import { CoordinateFormat, type Progress, ReconstructionService } from '../../generated/rilievo/v1/reconstruction_pb';
import type { ReadScan } from '../decoder/messages';
import type { Place } from '../decoder/module';
import { SurfaceStream } from './surface_stream';
import { withToken } from './token';
import { uploadScan } from './upload';

const transport = createConnectTransport({ baseUrl: '.', useBinaryFormat: true, interceptors: [withToken] });
export const jobs = createClient(JobsService, transport);
export const reconstruction = createClient(ReconstructionService, transport);

export interface Listener {
  onUpload(fraction: number): void;
  onJob(job: Job): void;
  onProgress(progress: Progress): void;
}

function randomName(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
}

const UP = {
  x: UpDirection.X, y: UpDirection.Y, z: UpDirection.Z,
  '-x': UpDirection.MINUS_X, '-y': UpDirection.MINUS_Y, '-z': UpDirection.MINUS_Z,
};

/** What the file says of its place goes with the surface. */
function optionsOf({ metres_per_unit, up, crs }: Place) {
  if (metres_per_unit === null && up === null && crs === null) return undefined;
  return { place: { metresPerUnit: metres_per_unit ?? undefined, up: up ? UP[up] : undefined, crs: crs ?? undefined } };
}

/** Uploads, and creates the job. */
export async function submitScan(scan: ReadScan, signal: AbortSignal, listener: Listener): Promise<Job> {
  const upload = { id: randomName(), bytes: scan.packed, sha256: scan.sha256 };
  const scanId = await uploadScan(upload, signal, (fraction) => listener.onUpload(fraction));
  listener.onUpload(1);
  const coordinateFormat =
    scan.coordinateBytes === 4 ? CoordinateFormat.FLOAT32_LE : CoordinateFormat.FLOAT64_LE;
  const { stations, normals } = scan;
  const header = {
    pointCount: BigInt(scan.points), coordinateFormat, stations, normals, colors: scan.layers.colours,
    options: optionsOf(scan.place),
  };
  const { job } = await jobs.createJob({ requestId: randomName(), scanId, header }, { signal });
  if (!job) throw new ConnectError('the server has given no job', Code.Internal);
  return job;
}

const FINISHED = [JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED];

export function isFinished(job: Job): boolean {
  return FINISHED.includes(job.state);
}

/** Watches until the job is finished, over breaks of the connection. */
export async function watchJob(jobId: string, signal: AbortSignal, listener: Listener): Promise<Job> {
  let after = 0n;
  for (let failures = 0; ; ) {
    try {
      for await (const { event } of jobs.watchJob({ jobId, afterSequence: after }, { signal })) {
        failures = 0;
        if (!event) continue;
        after = event.sequence;
        if (event.event.case === 'progress') listener.onProgress(event.event.value);
        if (event.event.case === 'job') {
          listener.onJob(event.event.value);
          if (isFinished(event.event.value)) return event.event.value;
        }
      }
      const { job } = await jobs.getJob({ jobId }, { signal });
      if (job && isFinished(job)) return job;
    } catch (error) {
      const { code } = ConnectError.from(error);
      // Canceled: by a server that ended before it had answered.
      const away = code === Code.Unavailable || code === Code.Canceled;
      if (signal.aborted || !away || ++failures > 5) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, 200 * 2 ** failures));
  }
}

/** What a failed job ended with, as an error. */
export function errorOfJob(job: Job): ConnectError {
  if (job.state === JobState.CANCELLED) return new ConnectError('cancelled', Code.Canceled);
  const { code = Code.Unknown, message = 'the job has failed', details = [] } = job.error ?? {};
  const error = new ConnectError(message, code as Code);
  error.details = details.map(({ typeUrl, value }) => ({ type: typeUrl.split('/').at(-1)!, value }));
  return error;
}

/** The SHA-256 of bytes. */
export type Digest = (bytes: Uint8Array) => Promise<Uint8Array>;

// Servers of the first release send no digest.
async function isWhole(bytes: Uint8Array, sha256: Uint8Array, digestOf: Digest): Promise<boolean> {
  if (sha256.length === 0) return true;
  const digest = await digestOf(bytes);
  return digest.every((byte, i) => byte === sha256[i]);
}

/** The .dss of a job that succeeded, as it comes. */
export async function streamSurface(
  jobId: string, digestOf: Digest, signal: AbortSignal, onWhole: (stream: SurfaceStream) => void,
): Promise<SurfaceStream> {
  let stream: SurfaceStream | undefined;
  let sha256: Uint8Array = new Uint8Array();
  for await (const { message } of jobs.streamSurface({ jobId }, { signal })) {
    if (message.case === 'surface') {
      stream = new SurfaceStream(Number(message.value.totalBytes), message.value.chunkBytes.map(Number));
      sha256 = message.value.sha256;
    } else if (message.case === 'piece' && stream) {
      if (stream.add(Number(message.value.offset), message.value.data)) onWhole(stream);
    }
  }
  if (!stream?.isComplete) throw new ConnectError('the surface ended too early', Code.DataLoss);
  if (!(await isWhole(stream.bytes, sha256, digestOf))) {
    throw new ConnectError('the surface was damaged on its way; fetch it again', Code.DataLoss);
  }
  stream.isRight = true;
  return stream;
}
