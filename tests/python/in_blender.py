"""Run by Blender in the background: the add-on's round trip. Arguments after `--`: the folder of the
add-on, a .dss, a folder for what is made here."""
import os
import sys

import numpy as np

addons, source, folder = sys.argv[sys.argv.index("--") + 1:]
sys.path.insert(0, addons)

import bpy  # noqa: E402
import rilievo_blender  # noqa: E402

import rilievo  # noqa: E402


def check(value, words):
    if not value:
        raise SystemExit(f"not so: {words}")


def export(name):
    path = os.path.join(folder, name)
    check(bpy.ops.export_mesh.rilievo_dss(filepath=path) == {"FINISHED"}, name)
    return rilievo.read(path)


rilievo_blender.register()
bpy.ops.import_mesh.rilievo_dss(filepath=source)
before = rilievo.read(source)
cage = bpy.context.object
check(len(cage.data.vertices) == len(before.control_mesh.vertices), "the control mesh is there")
shown = next(o for o in bpy.data.objects if o.get(rilievo_blender.CAGE))
check(len(shown.data.vertices) == len(before.vertices()), "the surface is shown")

same = export("same.dss")
check(same.to_bytes() == before.to_bytes(), "an unchanged control mesh gives the same bytes")

# A vertex is moved, a crease made softer.
cage.data.vertices[3].co.z += 0.125
crease = next(e for e in cage.data.edges if e.crease > 0)
crease.crease = np.sqrt(2.5 / 10)
cage.name = "another name"
bpy.ops.object.rilievo_update()
check(sum(o.get(rilievo_blender.CAGE) is not None for o in bpy.data.objects) == 1, "one preview")
edited = export("edited.dss")
moved = edited.control_mesh.vertices - before.control_mesh.vertices
check(abs(moved[3, 2] - 0.125) < 1e-4, "the vertex is where it was put")
check(np.abs(np.delete(moved, 3, 0)).max() < 1e-7 * before.frame.diagonal, "no other has moved")
sharpness = {tuple(sorted(e)): s for e, s in zip(edited.control_mesh.creases.tolist(),
                                                 edited.control_mesh.sharpness.tolist())}
check(sharpness[tuple(sorted(crease.vertices))] == 2.5, "the crease has the sharpness asked for")
check(len(sharpness) == len(before.control_mesh.creases), "the other creases are there")
np.testing.assert_array_equal(edited.control_mesh.corners, before.control_mesh.corners)
np.testing.assert_array_equal(edited.heights, before.heights)
near = np.empty((len(shown.data.vertices), 3), np.float32)
shown.data.vertices.foreach_get("co", near.ravel())
apart = near + before.frame.center - edited.vertices()
check(np.abs(apart).max() < 1e-6 * before.frame.diagonal, "what is shown is what is exported")

# The file and its object travel in a .blend.
blend = os.path.join(folder, "scene.blend")
bpy.ops.wm.save_as_mainfile(filepath=blend)
bpy.ops.wm.open_mainfile(filepath=blend)
check(export("again.dss").to_bytes() == edited.to_bytes(), "a .blend keeps it")

# Frames of an animation.
bpy.context.object.keyframe_insert("location", frame=1)
bpy.context.object.location.x = 2
bpy.context.object.keyframe_insert("location", frame=2)
bpy.context.scene.frame_end = 2
check(bpy.ops.export_mesh.rilievo_frames(directory=folder) == {"FINISHED"}, "frames")
check(sorted(n for n in os.listdir(folder) if n.endswith(".obj")) ==
      ["frame_0001.obj", "frame_0002.obj"], "a file for each frame")

# Without creases and corners a frame says so.
item = bpy.context.object
for edge in item.data.edges:
    edge.crease = 0
item.vertex_groups.clear()
check(bpy.ops.export_mesh.rilievo_frames(directory=folder) == {"FINISHED"}, "smooth frames")
with open(os.path.join(folder, "frame_0001.obj"), encoding="ascii") as file:
    check(file.read().endswith("\nt crease 0/1/0 10\n"), "nothing is sharp")

old = os.path.join(os.path.dirname(source), "sheet_and_octahedron_v2.dss")
try:
    rilievo_blender.import_surface(old, bpy.context)
except rilievo_blender.NotACage as error:
    check("version 2" in str(error), "an old file is refused")
else:
    raise SystemExit("an old file was taken")

bpy.context.object.data.vertices.add(1)
bpy.context.object.data.update()
try:
    rilievo_blender.moved_surface(bpy.context.object, bpy.context)
except rilievo_blender.NotACage as error:
    check("none may come or go" in str(error), "what is wrong is said")
else:
    raise SystemExit("a vertex more was taken")
rilievo_blender.unregister()
print("ALL IS SO")
