"""Displaced subdivision surfaces (.dss) in Blender: the control mesh is edited like any mesh, and
the surface with its detail follows.

An imported surface is an object with its control mesh and its file, so that a .blend needs nothing
else. Coordinates are those of the scan about the centre of the surface, in the scan's axes and
unit: Blender keeps 24 binary digits of them. Vertices that were not moved are exported with all the
digits that the file has, so that an unchanged control mesh gives the same bytes. The quads of a
Catmull-Clark surface come as two triangles each, which have to stay as they are.
"""
import os
from typing import Any, Optional, Set, Tuple

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

bl_info = {
    "name": "rilievo surfaces (.dss)",
    "description": "Edit scanned surfaces by their control mesh; detail rides along",
    "author": "the rilievo maintainers",
    "version": (0, 2, 0),
    "blender": (3, 0, 0),
    "location": "File > Import, File > Export, Object > rilievo",
    "category": "Import-Export",
}

FILE = "rilievo_dss"
"""Custom property of a cage: the bytes of its file."""
CAGE = "rilievo_cage"
"""Custom property of a preview: its cage, whatever name that has by now."""
CORNERS = "rilievo corners"
"""Vertex group of the vertices that stay where they are."""
_SHARPEST = 10.0


class NotACage(Exception):
    """The object is not an imported control mesh, or is no longer the same mesh; or the file takes
    no other one."""


def package() -> Any:
    """The Python package rilievo. ImportError says how to install it."""
    try:
        import rilievo
    except ImportError as error:
        raise ImportError(f"the Python package rilievo cannot be loaded by Blender's Python "
                          f"({error}); install it there: pip install client/python") from error
    return rilievo


def import_surface(path: str, context: Any) -> Any:
    """A new object with the control mesh of a .dss file, selected. NotACage for files of format
    versions 1 and 2, which take no other control mesh."""
    surface = package().read(path)
    version = surface.info["format_version"]
    if version < 3:
        raise NotACage(f"{path} is of format version {version}, and only those of version 3 and on "
                       "take another control mesh; make it anew from its scan with `rilievo "
                       "reconstruct`, or from its mesh with `rilievo export` and `rilievo convert`")
    cage, center = surface.control_mesh, surface.frame.center
    name = os.path.splitext(os.path.basename(path))[0]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata((cage.vertices - center).tolist(), [], cage.faces.tolist())
    _set_creases(mesh, cage)
    item = bpy.data.objects.new(name, mesh)
    item[FILE] = surface.to_bytes()
    group = item.vertex_groups.new(name=CORNERS)
    group.add(cage.corners.tolist(), 1.0, "REPLACE")
    context.collection.objects.link(item)
    for other in context.selected_objects:
        other.select_set(False)
    item.select_set(True)
    context.view_layer.objects.active = item
    return item


def moved_surface(item: Any, context: Any) -> Any:
    """The surface of a cage as it stands, with modifiers that move vertices, shape keys and the
    object's own place. NotACage where vertices or faces are not those of the file."""
    surface = _surface_of(item)
    vertices, faces, creases, sharpness = _evaluated(item, context)
    own = surface.control_mesh
    if vertices.shape != own.vertices.shape or not np.array_equal(faces, own.faces):
        raise NotACage(f"{item.name} has {len(vertices)} vertices and {len(faces)} faces, its file "
                       f"{len(own.vertices)} and {len(own.faces)}, or others: vertices may move, "
                       "but none may come or go; switch off modifiers that add some")
    center = surface.frame.center
    turn = np.array(item.matrix_world, np.float64)
    placed = vertices.astype(np.float64) @ turn[:3, :3].T + turn[:3, 3] + center
    if np.array_equal(turn, np.eye(4)):
        kept = np.all(vertices == (own.vertices - center).astype(np.float32), axis=1)
        placed[kept] = own.vertices[kept]
    group = item.vertex_groups.get(CORNERS)
    corners = [] if group is None else [
        vertex.index for vertex in item.data.vertices
        if any(of.group == group.index and of.weight > 0.5 for of in vertex.groups)]
    return surface.with_cage(placed, creases, sharpness, corners)


def update_preview(item: Any, context: Any, level: int = -1) -> Any:
    """The object that shows the surface of a cage, made or brought up to date. `level`: -1 for the
    finest."""
    surface = moved_surface(item, context)
    made = surface.mesh(None if level < 0 else level)
    vertices = (made.vertices - surface.frame.center).astype(np.float32)
    shown = next((o for o in bpy.data.objects if o.get(CAGE) == item), None)
    if shown is None:
        shown = bpy.data.objects.new(f"{item.name} surface", bpy.data.meshes.new("surface"))
        shown[CAGE] = item
        context.collection.objects.link(shown)
    mesh = shown.data
    if len(mesh.vertices) != len(vertices) or len(mesh.polygons) != len(made.faces):
        mesh.clear_geometry()
        mesh.from_pydata(vertices.tolist(), [], made.faces.tolist())
        mesh.polygons.foreach_set("use_smooth", np.ones(len(made.faces), bool))
    else:
        mesh.vertices.foreach_set("co", vertices.ravel())
    mesh.update()
    return shown


def export_frames(item: Any, context: Any, folder: str, first: int, last: int) -> int:
    """The cage of each frame as an OBJ, for `rilievo deform IN --cage FOLDER/*.obj`; how many."""
    scene, before = context.scene, context.scene.frame_current
    os.makedirs(folder, exist_ok=True)
    try:
        for frame in range(first, last + 1):
            scene.frame_set(frame)
            cage = moved_surface(item, context).control_mesh
            with open(os.path.join(folder, f"frame_{frame:04}.obj"), "w", encoding="ascii") as file:
                file.write(cage.to_obj())
    finally:
        scene.frame_set(before)
    return last - first + 1


def _surface_of(item: Any) -> Any:
    data = None if item is None else item.get(FILE)
    if data is None:
        raise NotACage("choose the control mesh of an imported .dss")
    return package().Surface.from_bytes(data)


def _evaluated(item: Any, context: Any) -> Tuple[Any, Any, Any, Any]:
    """Vertices, faces, creased edges and their sharpness."""
    if item.mode == "EDIT":
        item.update_from_editmode()
    context.view_layer.update()
    seen = item.evaluated_get(context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    try:
        vertices = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", vertices.ravel())
        if any(len(face.vertices) != 3 for face in mesh.polygons):
            raise NotACage(f"{item.name} has faces that are not triangles")
        faces = np.empty((len(mesh.polygons), 3), np.int32)
        mesh.polygons.foreach_get("vertices", faces.ravel())
        ends = np.empty((len(mesh.edges), 2), np.int32)
        mesh.edges.foreach_get("vertices", ends.ravel())
        weights = _creases_of(mesh)
    finally:
        seen.to_mesh_clear()
    # Blender's subdivision takes 10 times the square of a weight for the sharpness.
    sharpness = np.round(16 * _SHARPEST * weights.astype(np.float64) ** 2) / 16
    sharp = sharpness > 0
    return vertices, faces, ends[sharp], sharpness[sharp]


def _set_creases(mesh: Any, cage: Any) -> None:
    weight_of = {tuple(sorted(ends)): float(np.sqrt(min(sharpness, _SHARPEST) / _SHARPEST))
                 for ends, sharpness in zip(cage.creases.tolist(), cage.sharpness.tolist())}
    weights = np.array([weight_of.get(tuple(sorted(edge.vertices)), 0.0) for edge in mesh.edges],
                       np.float32)
    if bpy.app.version >= (4, 0, 0):
        mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", weights)
        return
    if bpy.app.version < (3, 4, 0):
        mesh.use_customdata_edge_crease = True
    mesh.edges.foreach_set("crease", weights)


def _creases_of(mesh: Any) -> Any:
    weights = np.zeros(len(mesh.edges), np.float32)
    if bpy.app.version < (4, 0, 0):
        mesh.edges.foreach_get("crease", weights)
    elif "crease_edge" in mesh.attributes:
        mesh.attributes["crease_edge"].data.foreach_get("value", weights)
    return weights


class _Saying:
    """Errors become what Blender shows of an operator."""

    def _run(self, what: Any) -> Set[str]:
        try:
            said: Optional[str] = what()
        except Exception as error:  # an operator has nobody else to tell
            self.report({"ERROR"}, str(error))  # type: ignore[attr-defined]
            return {"CANCELLED"}
        if said:
            self.report({"INFO"}, said)  # type: ignore[attr-defined]
        return {"FINISHED"}


class ImportDss(bpy.types.Operator, ImportHelper, _Saying):
    """Import the control mesh of a .dss surface"""
    bl_idname, bl_label = "import_mesh.rilievo_dss", "Import .dss"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".dss"
    filter_glob: StringProperty(default="*.dss", options={"HIDDEN"})  # type: ignore[valid-type]
    preview: BoolProperty(  # type: ignore[valid-type]
        name="Show the surface", description="An object that shows the surface too", default=True)

    def execute(self, context: Any) -> Set[str]:
        def run() -> None:
            item = import_surface(self.filepath, context)
            if self.preview:
                update_preview(item, context)
        return self._run(run)


class ExportDss(bpy.types.Operator, ExportHelper, _Saying):
    """Export the surface of an imported control mesh as it stands"""
    bl_idname, bl_label = "export_mesh.rilievo_dss", "Export .dss"
    filename_ext = ".dss"
    filter_glob: StringProperty(default="*.dss", options={"HIDDEN"})  # type: ignore[valid-type]

    def execute(self, context: Any) -> Set[str]:
        return self._run(lambda: moved_surface(context.object, context).write(self.filepath))


class ExportFrames(bpy.types.Operator, _Saying):
    """Export the control mesh of each frame of the scene as an OBJ, for `rilievo deform`"""
    bl_idname, bl_label = "export_mesh.rilievo_frames", "Export frames for rilievo deform"
    directory: StringProperty(subtype="DIR_PATH")  # type: ignore[valid-type]

    def invoke(self, context: Any, _event: Any) -> Set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> Set[str]:
        scene = context.scene
        return self._run(lambda: "%d frames" % export_frames(
            context.object, context, self.directory, scene.frame_start, scene.frame_end))


class UpdatePreview(bpy.types.Operator, _Saying):
    """Show the surface of this control mesh as it stands"""
    bl_idname, bl_label = "object.rilievo_update", "Update the surface"
    bl_options = {"REGISTER", "UNDO"}
    level: IntProperty(  # type: ignore[valid-type]
        name="Level", description="-1: the finest", default=-1, min=-1, max=10)

    def execute(self, context: Any) -> Set[str]:
        return self._run(lambda: update_preview(context.object, context, self.level) and None)


def _import_entry(menu: Any, _context: Any) -> None:
    menu.layout.operator(ImportDss.bl_idname, text="rilievo surface (.dss)")


def _export_entries(menu: Any, _context: Any) -> None:
    menu.layout.operator(ExportDss.bl_idname, text="rilievo surface (.dss)")
    menu.layout.operator(ExportFrames.bl_idname, text="rilievo control mesh of each frame (.obj)")


def _object_entry(menu: Any, _context: Any) -> None:
    menu.layout.operator(UpdatePreview.bl_idname, text="rilievo: update the surface")


_CLASSES = (ImportDss, ExportDss, ExportFrames, UpdatePreview)
_ENTRIES = (("TOPBAR_MT_file_import", _import_entry), ("TOPBAR_MT_file_export", _export_entries),
            ("VIEW3D_MT_object", _object_entry))


def register() -> None:
    for kind in _CLASSES:
        bpy.utils.register_class(kind)
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).append(entry)


def unregister() -> None:
    for menu, entry in _ENTRIES:
        getattr(bpy.types, menu).remove(entry)
    for kind in reversed(_CLASSES):
        bpy.utils.unregister_class(kind)
