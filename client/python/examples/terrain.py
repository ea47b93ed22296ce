# %% [markdown]
# # A terrain with a hole, from points to a surface and back to arrays
# Run it as a script, or cell by cell in an editor that knows percent cells. It needs NumPy, gRPC
# and the program `rilievod` in PATH (or named by RILIEVOD).

# %%
import tempfile

import numpy as np

import rilievo

# %% [markdown]
# A scan: 20 000 points on rolling hills in metres, on a map grid, 5 mm of noise, a pond without
# points.

# %%
rng = np.random.default_rng(0)
xy = rng.uniform(-50, 50, size=(20_000, 2))
xy = xy[np.linalg.norm(xy - [20, 10], axis=1) > 6]
z = 3 * np.sin(xy[:, 0] / 12) * np.cos(xy[:, 1] / 9) + rng.normal(scale=0.005, size=len(xy))
points = np.column_stack([xy, z]) + [4_600_000, 5_500_000, 300]

# %% [markdown]
# The surface, with an RMS error of at most 2 cm, which is told as a fraction of the diagonal. Each
# new level is shown as it arrives.

# %%
diagonal = np.linalg.norm(np.ptp(points, axis=0))
surface = rilievo.reconstruct(
    points, max_error=0.02 / diagonal, topology="planar",
    progress=lambda event: print(f"{event.stage:>14} {event.fraction:4.0%}", end="\r"),
    layer=lambda part: print(f"level {part.max_level}: {len(part.to_bytes())} bytes so far"))
print(surface)

# %% [markdown]
# What it says of itself: errors measured on the decoded bytes.

# %%
certificate = surface.certificate
print(f"{points.nbytes} bytes of points became {len(surface.to_bytes())}")
print(f"points to surface: RMS {certificate.scan_to_surface.rms * surface.frame.diagonal:.4f} m, "
      f"largest {certificate.scan_to_surface.max * surface.frame.diagonal:.4f} m")

# %% [markdown]
# Arrays of any level. Where there were no points the heights are filled in, and flagged.

# %%
for level in surface.levels:
    flags = surface.flags(level["level"])
    print(f"level {level['level']}: {level['vertices']} vertices, {level['faces']} faces, "
          f"{np.mean(flags == rilievo.FILLED):.1%} filled in")
slope = np.degrees(np.arccos(np.clip(surface.normals()[:, 2], -1, 1)))
print(f"steepest slope {slope.max():.0f} degrees")

# %% [markdown]
# A mesh of few triangles, and the file.

# %%
mesh, error = surface.adaptive_mesh(triangles=2000)
print(f"{len(mesh.faces)} triangles within {error * surface.frame.diagonal:.3f} m")
with tempfile.TemporaryDirectory() as folder:
    surface.write(f"{folder}/terrain.dss")
    again = rilievo.read(f"{folder}/terrain.dss")
    assert np.array_equal(again.vertices(), surface.vertices())
