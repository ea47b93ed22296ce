// The page: files and jobs in, a surface that sharpens out.
import { Code, ConnectError } from '@connectrpc/connect';
import { type Job, JobState } from '../generated/rilievo/v1/jobs_pb';
import { DecoderClient } from './decoder/client';
import { DecoderError } from './decoder/module';
import { element, sizeText, say, showError, whole } from './page/elements';
import { JobList, nameOfJob, rememberName } from './page/job_list';
import { StageList } from './page/stages';
import { SurfaceView } from './page/surface_view';
import { unpacked } from './page/unpack';
import { Viewer } from './scene/viewer';
import { errorOfJob, jobs, reconstruction, streamSurface, submitScan, watchJob, type Listener } from './server/jobs';
import { SurfaceStream } from './server/surface_stream';
import { useToken } from './server/token';
import { inWords } from './server/words';

const canvas = element<HTMLCanvasElement>('canvas');
const level = element<HTMLInputElement>('level');
let work: { abort: AbortController; jobId?: string } | undefined;

function start(): void {
  let viewer: Viewer;
  try {
    viewer = new Viewer(canvas);
  } catch {
    showError('This browser has no WebGL, which the picture needs. Switch on hardware acceleration, or use another browser.');
    return;
  }
  const decoder = new DecoderClient();
  // Loads the module before it is needed; what cannot be loaded is told when it is.
  void decoder.ask('warmUp', undefined).catch(() => undefined);
  const view = new SurfaceView(decoder, viewer);
  const digestOf = (bytes: Uint8Array) => decoder.ask('digest', { bytes });
  const list = new JobList((job) => void openJob(job));

  /** Runs one piece of work at a time; what was begun before is broken off. */
  async function run(title: string, body: (signal: AbortSignal, stages: StageList) => Promise<void>): Promise<void> {
    work?.abort.abort();
    const mine = (work = { abort: new AbortController() });
    showError(undefined);
    const stages = new StageList(title);
    try {
      await body(mine.abort.signal, stages);
      stages.finish(true);
    } catch (error) {
      if (mine !== work) return;
      stages.finish(false);
      const cancelled = mine.abort.signal.aborted || ConnectError.from(error).code === Code.Canceled;
      askForToken(error);
      showError(cancelled ? 'Cancelled.' : inWords(error));
    } finally {
      if (mine === work) work = undefined;
      void list.refresh().catch(() => undefined);
    }
  }

  function listenerOf(stages: StageList): Listener {
    return {
      onUpload: (fraction) => stages.show('upload', fraction),
      onJob: () => undefined,
      onProgress: ({ stage, fraction, stageSeconds }) => stages.show(stage, fraction, stageSeconds),
    };
  }

  async function receive(job: Job, name: string, keepsScan: boolean, signal: AbortSignal, stages: StageList): Promise<void> {
    if (job.state !== JobState.SUCCEEDED) throw errorOfJob(job);
    stages.show('surface');
    const generation = view.begin(name, keepsScan);
    let drawing: Promise<void> | undefined;
    try {
      const stream = await streamSurface(job.jobId, digestOf, signal, (arriving) => {
        drawing ??= view.drawStream(arriving, generation).finally(() => (drawing = undefined));
        drawing.catch(() => undefined); // awaited below
      });
      await drawing;
      await view.drawStream(stream, generation);
    } catch (error) {
      const damaged = ConnectError.from(error).code === Code.DataLoss;
      if (damaged && !signal.aborted) view.begin(name, keepsScan); // what was drawn of it goes
      throw error;
    }
  }

  async function openJob(job: Job): Promise<void> {
    const name = nameOfJob(job.jobId);
    await run(name, async (signal, stages) => {
      work!.jobId = job.jobId;
      const finished = job.state === JobState.SUCCEEDED ? job : await watchJob(job.jobId, signal, listenerOf(stages));
      await receive(finished, name, false, signal, stages);
    });
  }

  async function openScan(file: File): Promise<void> {
    await run(file.name, async (signal, stages) => {
      stages.show('read');
      const bytes = await unpacked(new Uint8Array(await file.arrayBuffer()));
      signal.throwIfAborted();
      const scan = await decoder.ask('readScan', { bytes, name: file.name });
      view.begin(file.name, true);
      await view.showScan(scan.layers);
      const listener = listenerOf(stages);
      stages.show('upload', 0);
      say(`${whole.format(scan.points)} points, ${scan.format}.`);
      const job = await submitScan(scan, signal, listener);
      rememberName(job.jobId, file.name);
      if (work) work.jobId = job.jobId;
      void list.refresh().catch(() => undefined);
      await receive(await watchJob(job.jobId, signal, listener), file.name, true, signal, stages);
    });
  }

  async function openSurface(file: File): Promise<void> {
    work?.abort.abort();
    work = undefined;
    showError(undefined);
    element('work').hidden = true;
    try {
      const bytes = new Uint8Array(await file.arrayBuffer());
      const generation = view.begin(file.name, false);
      const { info } = await decoder.ask('decode', { bytes });
      const stream = new SurfaceStream(bytes.length, info.chunk_bytes);
      stream.add(0, bytes);
      stream.isRight = true; // its own checksums say so: there is no other digest
      await view.drawStream(stream, generation);
    } catch (error) {
      showError(`${file.name}: ${inWords(error)}`);
    }
  }

  const open = (file: File) => (/\.dss$/i.test(file.name) ? openSurface(file) : openScan(file));
  connectControls(view, viewer, open);
  element<HTMLFormElement>('token-form').onsubmit = (event) => {
    event.preventDefault();
    useToken(element<HTMLInputElement>('token').value);
    showError(undefined);
    void greet(list);
  };
  openWhatIsAsked((file) => void open(file));
  void greet(list);
}

function connectControls(view: SurfaceView, viewer: Viewer, open: (file: File) => Promise<void>): void {
  const input = element<HTMLInputElement>('file');
  input.onchange = () => {
    const file = input.files?.[0];
    input.value = ''; // the same file may be chosen again
    if (file) void open(file);
  };
  const drop = element('drop');
  for (const name of ['dragover', 'dragleave', 'drop'] as const) {
    document.addEventListener(name, (event) => {
      event.preventDefault();
      drop.classList.toggle('over', name === 'dragover');
      const file = name === 'drop' ? event.dataTransfer?.files[0] : undefined;
      if (file) void open(file);
    });
  }
  const failing = (promise: Promise<void>) => void promise.catch((error) => showError(inWords(error)));
  const showLevel = () => failing(view.showLevel(Number(level.value)));
  level.oninput = showLevel;
  element('colour').onchange = () => failing(view.recolour());
  for (const id of ['show-control', 'show-scan']) element(id).onchange = () => view.applyVisibility();
  element('reset').onclick = () => viewer.resetView();
  element('cancel').onclick = () => cancelWork();
  element('downloads').onclick = ({ target }) => {
    const format = (target as HTMLElement).dataset.format;
    if (format) failing(view.save(format));
  };
  const tick = (id: string) => {
    const box = element<HTMLInputElement>(id);
    if (!box.disabled) box.click();
  };
  const stepLevel = (step: number) => {
    level.value = `${Number(level.value) + step}`;
    showLevel();
  };
  const keys: Record<string, () => void> = {
    ArrowLeft: () => viewer.turn(-1, 0), ArrowRight: () => viewer.turn(1, 0),
    ArrowUp: () => viewer.turn(0, 1), ArrowDown: () => viewer.turn(0, -1),
    '+': () => viewer.zoom(0.85), '=': () => viewer.zoom(0.85), '-': () => viewer.zoom(1 / 0.85),
    '0': () => viewer.resetView(), '[': () => stepLevel(-1), ']': () => stepLevel(1),
    w: () => tick('show-control'), p: () => tick('show-scan'),
  };
  canvas.onkeydown = (event) => {
    const act = event.ctrlKey || event.metaKey || event.altKey ? undefined : keys[event.key];
    if (!act) return;
    event.preventDefault();
    if (view.hasSurface || !'[]wp'.includes(event.key)) act();
  };
}

/** `rilievo view FILE --open`: the gateway has the file, the address its name. */
function openWhatIsAsked(open: (file: File) => void): void {
  const name = new URLSearchParams(location.hash.slice(1)).get('open');
  if (!name) return;
  fetch('opened')
    .then(async (answer) => {
      if (!answer.ok) throw new DecoderError(5, `${name} is no longer there`);
      open(new File([await answer.blob()], name));
    })
    .catch((error) => showError(inWords(error)));
}

/** The call is broken off here and now, and the server is told to stop. */
function cancelWork(): void {
  const { abort, jobId } = work ?? {};
  if (jobId) void jobs.cancelJob({ jobId }).catch(() => undefined);
  abort?.abort();
}

/** Shows the field for it, if that is what the server wants. */
function askForToken(error: unknown): void {
  if (ConnectError.from(error).code !== Code.Unauthenticated) return;
  element('token-form').hidden = false;
  element('token').focus();
}

async function greet(list: JobList): Promise<void> {
  const line = element('server');
  try {
    const { serverVersion, limits, keepsJobs } = await reconstruction.getCapabilities({});
    element('token-form').hidden = true;
    element<HTMLInputElement>('token').value = '';
    if (!keepsJobs) {
      line.textContent = 'This server keeps no jobs, so scans cannot be sent: start rilievod with --store. Surfaces (.dss) can be opened.';
      return;
    }
    const size = Number(limits?.maxScanBytes ?? 0);
    const most = size > 0 && size < 1e10 ? `, scans up to ${sizeText(size)}` : ''; // above, no browser holds it
    line.textContent = `rilievod ${serverVersion}${most}`;
    await list.refresh();
  } catch (error) {
    askForToken(error);
    line.textContent = `${inWords(error)} Surfaces (.dss) can be opened without it.`;
  }
}

start();
