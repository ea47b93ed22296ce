// The surface on the page: decoded prefix by prefix, drawn at a level, coloured, told in figures.
import type { DecoderClient } from '../decoder/client';
import type { Decoded, Frame, Picture, ReadScan } from '../decoder/messages';
import type { SurfaceInfo } from '../decoder/module';
import { colourOf, type Coloured, type Colouring, figure, type Legend, type OfScan } from '../scene/colours';
import type { Viewer } from '../scene/viewer';
import type { SurfaceStream } from '../server/surface_stream';
import { download, element, make, say, sizeText, whole } from './elements';
import { LayerTimes } from './layer_times';

/** With the control mesh alone: its smooth limit surface. */
const PREVIEW_LEVEL = 2;

export class SurfaceView {
  readonly #decoder: DecoderClient;
  readonly #viewer: Viewer;
  readonly #level = element<HTMLInputElement>('level');
  readonly #colour = element<HTMLSelectElement>('colour');
  #picture: Picture | undefined;
  #info: SurfaceInfo | undefined;
  #bytes: Uint8Array<ArrayBuffer> | undefined;
  #name = 'surface';
  /** Whether the surface has shown colours of its own. */
  #hasColours = false;
  #hasScan = false;
  #scanFrame: Frame | undefined;
  #generation = 0;
  /** Chunks of the stream that are in the picture. */
  #drawn = 0;
  #layers: ReadScan['layers'] = { colours: false, intensity: false };
  /** What the scan says of the vertices of a level, once it was asked for. */
  readonly #ofScan = new Map<number, OfScan>();
  readonly #times = new LayerTimes();

  constructor(decoder: DecoderClient, viewer: Viewer) {
    this.#decoder = decoder;
    this.#viewer = viewer;
  }

  get hasSurface(): boolean {
    return this.#picture !== undefined;
  }

  /** A new surface begins; `keepsScan`: it is made from the scan that is shown. */
  begin(name: string, keepsScan: boolean): number {
    this.#name = name;
    this.#picture = this.#info = this.#bytes = undefined;
    this.#hasColours = false;
    this.#ofScan.clear();
    this.#drawn = 0;
    this.#times.clear();
    if (!keepsScan) this.forgetScan();
    for (const id of ['view', 'facts-section', 'legend']) element(id).hidden = true;
    this.#viewer.setVisible({ surface: false, control: false });
    return ++this.#generation;
  }

  /**
   * Decodes the whole chunks that are not in the picture yet; once at a time, the newest counts. Figures and files are
   * those of a stream that is right.
   */
  async drawStream(stream: SurfaceStream, generation: number): Promise<void> {
    while (this.#drawn < stream.wholeChunks) {
      // The first layer is drawn by itself, however fast the others follow.
      const count = this.#drawn === 0 ? 1 : stream.wholeChunks;
      const decoded = await this.#decoder.ask('decode', { bytes: stream.firstChunks(count) });
      const picture = await this.#decoder.ask('picture', { level: this.#levelOf(decoded.info) });
      if (generation !== this.#generation) return;
      this.#show(decoded, picture);
      // Seen before the next layer is drawn: the second frame from now begins once this one is shown.
      for (let frame = 0; frame < 2 && !document.hidden; ++frame) await new Promise(requestAnimationFrame);
      if (generation !== this.#generation) return;
      const { arrived = 0, end } = stream.chunks[count - 1]!;
      const toPictureMs = performance.now() - arrived;
      this.#times.add(count - 1, { bytes: end, decodeMs: decoded.decodeMs + picture.tessellateMs, toPictureMs });
      this.#drawn = count;
    }
    if (!stream.isRight || this.#bytes || generation !== this.#generation) return;
    this.#complete(stream.bytes);
    void this.#timeTheOthers(stream, generation).catch(() => undefined);
  }

  /** Layers that came together with finer ones were not drawn: what they cost is found out afterwards. */
  async #timeTheOthers(stream: SurfaceStream, generation: number): Promise<void> {
    for (const [layer, { end }] of stream.chunks.entries()) {
      if (this.#times.has(layer)) continue;
      const decodeMs = await this.#decoder.ask('timeOf', { bytes: stream.firstChunks(layer + 1) });
      if (generation !== this.#generation) return;
      this.#times.add(layer, { bytes: end, decodeMs });
    }
  }

  #levelOf(info: SurfaceInfo): number {
    return info.chunk_bytes.length === 1 && info.declared_max_level > 0 ? PREVIEW_LEVEL : info.max_level;
  }

  #show({ info, control }: Decoded, picture: Picture): void {
    this.#info = info;
    this.#picture = picture;
    this.#viewer.showControl(control);
    if (picture.colours.length > 0 && !this.#hasColours && this.#colour.value === 'stone') this.#colour.value = 'surface';
    this.#hasColours = picture.colours.length > 0;
    this.#place(picture);
    element('welcome').hidden = true;
    element('view').hidden = false;
    this.#level.max = `${info.max_level}`;
    this.#level.value = `${info.max_level}`;
    this.#tellLevel();
    this.applyVisibility();
    this.#viewer.drawNow(); // once, with all of it: in software a picture takes a tenth of a second
    void this.#measure();
  }

  /** With its colours, as far as they are known: of the error not before it is measured. */
  #place(picture: Picture): void {
    const { colours, legend } = this.#coloured(picture);
    this.#viewer.showSurface(picture, colours);
    this.#showLegend(legend);
  }

  #coloured(picture: Picture): Coloured {
    const { diagonal } = this.#info!.frame;
    return colourOf(picture, this.#colour.value as Colouring, diagonal, this.#ofScan.get(picture.level));
  }

  /** What the chosen colours still lack. */
  #lacking(level: number): 'error' | 'colours' | undefined {
    const known = this.#ofScan.get(level);
    if (this.#colour.value === 'error' && this.#hasScan && !known?.error) return 'error';
    return this.#colour.value === 'scan' && this.#layers.colours && !known?.colours ? 'colours' : undefined;
  }

  #complete(bytes: Uint8Array<ArrayBuffer>): void {
    this.#bytes = bytes;
    this.#tellFacts();
    element('facts-section').hidden = false;
    if (this.#hasScan) void this.#placeScan();
    say(`The surface is complete: ${whole.format(this.#picture!.flags.length)} vertices.`);
  }

  async showLevel(level: number): Promise<void> {
    const generation = this.#generation;
    const picture = await this.#decoder.ask('picture', { level });
    if (generation !== this.#generation || Number(this.#level.value) !== level) return;
    this.#picture = picture;
    this.#place(picture);
    this.#tellLevel();
    await this.#measure();
  }

  /** By what the list says. */
  async recolour(): Promise<void> {
    if (!this.#picture) return;
    const { colours, legend } = this.#coloured(this.#picture);
    this.#viewer.colourSurface(colours);
    this.#showLegend(legend);
    await this.#measure();
  }

  /** What the scan says of the surface, when it is first asked for; then it is shown. */
  async #measure(): Promise<void> {
    const picture = this.#picture;
    const lacking = picture && this.#lacking(picture.level);
    if (!lacking) return;
    const { level } = picture;
    say(lacking === 'error' ? 'Measuring the distance to the scan.' : 'Looking up the colours of the scan.');
    const generation = this.#generation;
    const found: OfScan = lacking === 'error'
      ? { error: await this.#decoder.ask('distance', { level }) }
      : { colours: await this.#decoder.ask('scanColours', { level }) };
    if (generation !== this.#generation) return;
    this.#ofScan.set(level, { ...this.#ofScan.get(level), ...found });
    if (picture === this.#picture) await this.recolour();
  }

  #showLegend(legend: Legend | undefined): void {
    const box = element('legend');
    box.hidden = legend === undefined;
    if (!legend) return;
    const parts: Node[] = [make('div', { textContent: legend.title })];
    if (legend.gradient) {
      const bar = make('div', { className: 'bar' });
      bar.style.background = legend.gradient.css;
      const { low, high } = legend.gradient;
      parts.push(bar, make('div', { className: 'ends' }, make('span', {}, low), make('span', {}, high)));
    }
    for (const { css, name } of legend.patches ?? []) {
      const colour = make('i');
      colour.style.background = css;
      parts.push(make('span', { className: 'patch' }, colour, name));
    }
    box.replaceChildren(...parts);
  }

  #tellLevel(): void {
    const picture = this.#picture!;
    const triangles = `${whole.format(picture.faces.length / 3)} triangles`;
    element('level-text').textContent = `${picture.level}`;
    this.#level.setAttribute('aria-valuetext', `level ${picture.level}, ${triangles}`);
    element('canvas').setAttribute('aria-label', `${this.#name}: a surface of ${triangles}, level ${picture.level}`);
  }

  #tellFacts(): void {
    const { control, levels, frame, certificate, metadata, place } = this.#info!;
    const finest = levels.at(-1)!;
    const { metres_per_unit } = place;
    const length = (value: number) =>
      metres_per_unit === null ? figure(value) : `${figure(value * metres_per_unit)} m`;
    const share = (value: number | null) =>
      value === null ? 'not stated' : `${length(value * frame.diagonal)} (${(100 * value).toPrecision(2)} %)`;
    const facts: [string, string][] = [
      ['Scan to surface, RMS', share(certificate.scan_to_surface.rms)],
      ['Farthest point', share(certificate.scan_to_surface.max)],
      ['File', sizeText(this.#bytes!.length)],
      ['Control mesh', `${whole.format(control.faces)} faces`],
      ['Finest level', `${whole.format(finest.vertices)} vertices`],
      ['Diagonal', length(frame.diagonal)],
      ['Shape', control.closed ? 'closed' : 'open'],
    ];
    if (metadata.road) facts.push(['Topology', metadata.road]);
    element('name').textContent = this.#name;
    element('facts').replaceChildren(
      ...facts.flatMap(([term, text]) => [make('dt', { textContent: term }), make('dd', { textContent: text })]),
    );
  }

  /** A scan has been read: its points are shown until a surface is there. */
  async showScan(layers: ReadScan['layers']): Promise<void> {
    this.#hasScan = true;
    this.#layers = layers;
    this.#scanFrame = undefined;
    this.#ofScan.clear();
    await this.#placeScan();
    element('welcome').hidden = true;
    this.applyVisibility();
  }

  forgetScan(): void {
    this.#hasScan = false;
    this.#layers = { colours: false, intensity: false };
    void this.#decoder.ask('forgetScan', undefined);
    this.applyVisibility();
  }

  async #placeScan(): Promise<void> {
    const frame = this.#info?.frame;
    if (this.#scanFrame && this.#scanFrame === frame) return;
    const scan = await this.#decoder.ask('scanPicture', { frame });
    this.#scanFrame = frame;
    this.#viewer.showScan(scan.positions);
  }

  applyVisibility(): void {
    const scanBox = element<HTMLInputElement>('show-scan');
    const { colours, intensity } = this.#layers;
    scanBox.disabled = !this.#hasScan;
    const changed = (this.#picture?.changes.length ?? 0) > 0;
    for (const [value, usable] of [['change', changed], ['surface', this.#hasColours], ['error', this.#hasScan], ['scan', colours]] as const) {
      this.#colour.querySelector<HTMLOptionElement>(`option[value=${value}]`)!.disabled = !usable;
      if (!usable && this.#colour.value === value) this.#colour.value = 'stone';
    }
    element('carry-field').hidden = !colours && !intensity;
    const control = element<HTMLInputElement>('show-control').checked && this.hasSurface;
    this.#viewer.setVisible({
      surface: this.hasSurface,
      control,
      scan: this.#hasScan && (scanBox.checked || !this.hasSurface),
    });
  }

  async save(format: string): Promise<void> {
    if (!this.#bytes) return;
    const stem = this.#name.replace(/\.[^.]*$/, '') || 'surface';
    const level = Number(this.#level.value);
    const carry = !element('carry-field').hidden && element<HTMLInputElement>('carry').checked;
    const bytes =
      format === 'dss' ? this.#bytes : await this.#decoder.ask('meshFile', { format: format as 'ply' | 'glb', level, carry });
    download(bytes, `${stem}.${format}`);
    say(`${stem}.${format} is being saved.`);
  }
}
