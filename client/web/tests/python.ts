// The Python client of this build, by Debian's own Python.
//   PYTHON_PACKAGE: the folder of the package; DECODER_LIBRARY: librilievo_decoder.so.
import { execFileSync, spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';

const { PYTHON_PACKAGE = '', DECODER_LIBRARY = '' } = process.env;
const PYTHON = '/usr/bin/python3';
const env = { ...process.env, PYTHONPATH: PYTHON_PACKAGE, RILIEVO_DECODER_LIBRARY: DECODER_LIBRARY };

/** Why it cannot be used here; empty: it can. */
export function pythonLacks(): string {
  const tried = spawnSync(PYTHON, ['-c', 'import rilievo'], { env, encoding: 'utf8' });
  return tried.status === 0 ? '' : `${tried.error ?? tried.stderr.trim().split('\n').at(-1)}`;
}

const SCRIPT = `
import sys
import numpy as np, rilievo
surface = rilievo.reconstruct(np.loadtxt(sys.argv[1]), server=sys.argv[2])
vertices, faces = surface.vertices(), surface.faces()
assert vertices.dtype == np.float64 and faces.dtype == np.uint32
with open(sys.argv[3], "wb") as out:
    out.write(vertices.tobytes() + faces.tobytes())
print(vertices.nbytes)
`;

/** The arrays of the finest level, as bytes. */
export function reconstructInPython(scan: string, server: string, out: string): { vertices: Buffer; faces: Buffer } {
  const said = execFileSync(PYTHON, ['-c', SCRIPT, scan, server, out], { env, encoding: 'utf8' });
  const bytes = readFileSync(out);
  return { vertices: bytes.subarray(0, Number(said)), faces: bytes.subarray(Number(said)) };
}
