// The jobs that the server keeps for this client.
import { timestampMs } from '@bufbuild/protobuf/wkt';
import { type Job, JobState } from '../../generated/rilievo/v1/jobs_pb';
import { isFinished, jobs } from '../server/jobs';
import { errorOfJob } from '../server/jobs';
import { inWords } from '../server/words';
import { element, make, showError, sizeText, whole } from './elements';

const STATES: Record<JobState, string> = {
  [JobState.UNSPECIFIED]: 'unknown',
  [JobState.QUEUED]: 'waiting',
  [JobState.RUNNING]: 'at work',
  [JobState.SUCCEEDED]: 'done',
  [JobState.FAILED]: 'failed',
  [JobState.CANCELLED]: 'cancelled',
};

const NAMES_KEPT = 100;

/** The file names of this browser's jobs: the server knows points only. */
export function nameOfJob(jobId: string): string {
  return names()[jobId] ?? `job ${jobId.slice(0, 8)}`;
}

export function rememberName(jobId: string, name: string): void {
  const kept = Object.entries(names()).slice(1 - NAMES_KEPT);
  try {
    localStorage.setItem('names', JSON.stringify(Object.fromEntries([...kept, [jobId, name]])));
  } catch {
    // Without storage the jobs go by their numbers.
  }
}

function names(): Record<string, string> {
  try {
    return JSON.parse(localStorage.getItem('names') ?? '{}') as Record<string, string>;
  } catch {
    return {};
  }
}

function describe(job: Job): string {
  const when = job.createTime ? new Date(timestampMs(job.createTime)).toLocaleString([], { dateStyle: 'medium', timeStyle: 'short' }) : '';
  const parts = [STATES[job.state], when];
  if (job.surface) parts.push(sizeText(Number(job.surface.totalBytes)));
  if (job.report) parts.push(`${whole.format(Number(job.report.pointsIn))} points`);
  if (job.state === JobState.FAILED) parts.push(inWords(errorOfJob(job)));
  return parts.filter(Boolean).join(' · ');
}

export class JobList {
  readonly #open: (job: Job) => void;

  constructor(open: (job: Job) => void) {
    this.#open = open;
  }

  async refresh(): Promise<void> {
    const { jobs: found } = await jobs.listJobs({ pageSize: 20 });
    element('jobs').replaceChildren(...found.map((job) => this.#item(job)));
    element('no-jobs').hidden = found.length > 0;
    element('jobs-section').hidden = false;
  }

  #item(job: Job): HTMLLIElement {
    const name = nameOfJob(job.jobId);
    const button = (text: string, act: () => void) => {
      const made = make('button', { type: 'button', textContent: text, onclick: act });
      made.setAttribute('aria-label', `${text} ${name}`);
      return made;
    };
    const buttons: HTMLElement[] = [];
    if (job.state === JobState.SUCCEEDED || !isFinished(job)) {
      buttons.push(button(isFinished(job) ? 'Open' : 'Watch', () => this.#open(job)));
    }
    const remove = isFinished(job) ? 'Delete' : 'Cancel';
    buttons.push(button(remove, () => void this.#end(job)));
    return make('li', {}, make('strong', { textContent: name }),
      make('span', { className: 'what', textContent: describe(job) }),
      make('span', { className: 'row' }, ...buttons));
  }

  async #end(job: Job): Promise<void> {
    try {
      if (isFinished(job)) await jobs.deleteJob({ jobId: job.jobId });
      else await jobs.cancelJob({ jobId: job.jobId });
      await this.refresh();
    } catch (error) {
      showError(inWords(error));
    }
  }
}
