// Colours that show a figure of the vertices, and what they mean.
import type { Distances, Picture } from '../decoder/messages';

export type Colouring = 'stone' | 'displacement' | 'change' | 'error' | 'source' | 'scan' | 'surface';

type Rgb = [number, number, number];

export interface Legend {
  title: string;
  /** A CSS gradient with its ends in words, or patches with names. */
  gradient?: { css: string; low: string; high: string };
  patches?: { css: string; name: string }[];
}

export interface Coloured {
  /** Linear RGB, three a vertex. */
  colours: Float32Array;
  legend: Legend | undefined;
}

const STONE: Rgb = [0.86, 0.83, 0.78];
const NOTHING: Rgb = [0.62, 0.62, 0.62];
const SOURCES: { colour: Rgb; name: string }[] = [
  { colour: STONE, name: 'measured' },
  { colour: [0.36, 0.58, 0.82], name: 'smoothed' },
  { colour: [0.93, 0.6, 0.24], name: 'filled in' },
];
/** Inwards blue, outwards red, as charts of relief have it. */
const DIVERGING: Rgb[] = [[0.13, 0.3, 0.63], [0.5, 0.68, 0.86], [0.95, 0.94, 0.91], [0.93, 0.62, 0.47], [0.66, 0.14, 0.18]];
/** Dark to light with even steps for the eye, also without colour vision. */
const SEQUENTIAL: Rgb[] = [[0.22, 0.2, 0.44], [0.19, 0.41, 0.56], [0.13, 0.6, 0.55], [0.55, 0.78, 0.34], [0.99, 0.9, 0.35]];

function at(palette: Rgb[], share: number): Rgb {
  const place = Math.min(Math.max(share, 0), 1) * (palette.length - 1);
  const index = Math.min(Math.floor(place), palette.length - 2);
  const part = place - index;
  const [a, b] = [palette[index]!, palette[index + 1]!];
  return [0, 1, 2].map((k) => a[k]! + (b[k]! - a[k]!) * part) as Rgb;
}

const css = ([r, g, b]: Rgb) => `rgb(${[r, g, b].map((value) => Math.round(255 * value)).join(' ')})`;
const gradient = (palette: Rgb[]) => `linear-gradient(to right, ${palette.map(css).join(', ')})`;
const linear = (value: number) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4);

function fill(count: number, colourOf: (vertex: number) => Rgb): Float32Array {
  const colours = new Float32Array(3 * count);
  for (let v = 0; v < count; ++v) {
    const colour = colourOf(v);
    for (let k = 0; k < 3; ++k) colours[3 * v + k] = linear(colour[k]!);
  }
  return colours;
}

/** What `share` of all finite values other than 0 stay below, in size. */
function quantile(values: Float32Array, share: number): number {
  const sizes = values.filter((value) => Number.isFinite(value) && value !== 0).map(Math.abs).sort();
  return sizes[Math.floor(share * (sizes.length - 1))] ?? 0;
}

/** Three digits, as people write them. */
export function figure(value: number): string {
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-5) return value.toExponential(1).replace('e', ' × 10^').replace('+', '');
  if (size < 1e-3) return value.toFixed(6).replace(/0+$/, '');
  return size >= 100 ? value.toFixed(0) : value.toPrecision(3);
}

/** What the scan says of the vertices, as far as it is known. */
export interface OfScan {
  /** RMS distance of its points at each vertex, and of all of them, scan unit; for 'error'. */
  error?: Distances;
  /** Red, green, blue of the nearest point, 0 to 255; for 'scan'. */
  colours?: Uint8Array;
}

export function colourOf(picture: Picture, colouring: Colouring, diagonal: number, { error, colours }: OfScan = {}): Coloured {
  const count = picture.flags.length;
  if (colouring === 'displacement' || (colouring === 'change' && picture.changes.length > 0)) {
    const values = colouring === 'displacement' ? picture.heights : picture.changes;
    const most = quantile(values, 0.98) || 1e-12;
    return {
      colours: fill(count, (v) => at(DIVERGING, 0.5 + values[v]! / most / 2)),
      legend: {
        title: colouring === 'displacement'
          ? 'Displacement along the normal, in units of the scan'
          : 'Change by the last update along the normal, in units of the scan',
        gradient: { css: gradient(DIVERGING), low: `−${figure(most * diagonal)}`, high: `+${figure(most * diagonal)}` },
      },
    };
  }
  if (colouring === 'error' && error) {
    const { distances, rms } = error;
    const most = quantile(distances, 0.98) || 1e-12;
    return {
      colours: fill(count, (v) => (Number.isNaN(distances[v]!) ? NOTHING : at(SEQUENTIAL, distances[v]! / most))),
      legend: {
        title: `Distance of the scan to the surface, RMS, in its units; of all points ${figure(rms)}. Grey: no point near`,
        gradient: { css: gradient(SEQUENTIAL), low: '0', high: figure(most) },
      },
    };
  }
  const given = colouring === 'scan' ? colours : colouring === 'surface' ? picture.colours : undefined;
  if (given && given.length > 0) {
    return { colours: Float32Array.from(given, (value) => linear(value / 255)), legend: undefined };
  }
  if (colouring === 'source') {
    const present = SOURCES.filter((_source, flag) => picture.flags.includes(flag));
    return {
      colours: fill(count, (v) => SOURCES[picture.flags[v]!]?.colour ?? NOTHING),
      legend: {
        title: 'Where the heights come from',
        patches: present.map(({ colour, name }) => ({ css: css(colour), name })),
      },
    };
  }
  return { colours: fill(count, () => STONE), legend: undefined };
}
