// The list of stages while a scan becomes a surface.
import { Stage } from '../../generated/rilievo/v1/report_pb';
import { element, make, say } from './elements';

const NAMES: [number | string, string][] = [
  ['read', 'Reading the file'],
  ['upload', 'Sending the points'],
  [Stage.QUEUED, 'Waiting for a place'],
  [Stage.CHECK, 'Checking the points'],
  [Stage.NEIGHBORS, 'Finding neighbours'],
  [Stage.NORMALS, 'Normals and orientation'],
  [Stage.CONTROL_MESH, 'Control mesh'],
  [Stage.DOMAIN_FIT, 'Fitting the smooth surface'],
  [Stage.DISPLACEMENT, 'Displacement'],
  [Stage.MEASURE, 'Measuring the error'],
  [Stage.ENCODE, 'Coding'],
  ['surface', 'Receiving the surface'],
];

type StageKey = number | 'read' | 'upload' | 'surface';

/** Where each stage stands; stages before the running one are done. */
export class StageList {
  readonly #items = new Map<number | string, HTMLLIElement>();
  #running: number | string | undefined;

  constructor(title: string) {
    element('work-title').textContent = title;
    const items = NAMES.map(([key, name]) => {
      const item = make('li', {}, make('span', { textContent: name }), make('span'));
      item.dataset.state = 'waiting';
      this.#items.set(key, item);
      return item;
    });
    element('stages').replaceChildren(...items);
    element('work').hidden = false;
    element('cancel').hidden = false;
  }

  show(stage: StageKey, fraction?: number, seconds?: number): void {
    const item = this.#items.get(stage);
    if (!item || item.dataset.state === 'done') return;
    if (this.#running !== stage) this.#enter(stage, item);
    const [name, figure] = item.querySelectorAll('span') as unknown as [HTMLElement, HTMLElement];
    figure.textContent = seconds === undefined ? '' : `${seconds.toFixed(1)} s`;
    let bar = item.querySelector('progress');
    if (fraction === undefined) return;
    if (!bar) item.append((bar = make('progress', { max: 1 })));
    bar.setAttribute('aria-label', name.textContent ?? '');
    bar.value = fraction;
  }

  #enter(stage: StageKey, item: HTMLLIElement): void {
    for (const other of this.#items.values()) {
      if (other === item) break;
      StageList.#set(other, 'done');
    }
    this.#running = stage;
    StageList.#set(item, 'running');
    say(item.querySelector('span')?.textContent ?? '');
  }

  /** All done, or the running one failed. */
  finish(succeeded: boolean): void {
    for (const [stage, item] of this.#items) {
      if (succeeded) StageList.#set(item, 'done');
      else if (stage === this.#running) StageList.#set(item, 'failed');
    }
    element('cancel').hidden = true;
    if (succeeded) element('work').hidden = true;
  }

  static #set(item: HTMLLIElement, state: string): void {
    item.dataset.state = state;
    if (state === 'running') item.setAttribute('aria-current', 'step');
    else item.removeAttribute('aria-current');
    if (state !== 'running') item.querySelector('progress')?.remove();
  }
}
