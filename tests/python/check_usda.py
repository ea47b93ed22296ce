#!/usr/bin/env python3
"""A strict reader of the USD text that holds one Mesh: grammar, types, and the rules of UsdGeomMesh.

    check_usda.py FILE.usda
"""
import re
import sys

TOKEN = re.compile(r'\s*(?:(#[^\n]*)|("(?:[^"\\\n]|\\.)*")|([A-Za-z_][\w:]*(?:\[\])?)|'
                   r'(-?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|inf))|([()\[\]{}=,]))')
# UsdGeomMesh and what it inherits: type, and whether it is uniform.
SCHEMA = {
    "extent": ("float3[]", False), "points": ("point3f[]", False),
    "faceVertexCounts": ("int[]", False), "faceVertexIndices": ("int[]", False),
    "subdivisionScheme": ("token", True), "interpolateBoundary": ("token", True),
    "orientation": ("token", True), "creaseIndices": ("int[]", False),
    "creaseLengths": ("int[]", False), "creaseSharpnesses": ("float[]", False),
    "cornerIndices": ("int[]", False), "cornerSharpnesses": ("float[]", False),
    "xformOp:translate": ("double3", False), "xformOp:orient": ("quatd", False),
    "xformOpOrder": ("token[]", True),
}
ALLOWED = {"subdivisionScheme": {"catmullClark", "loop", "bilinear", "none"},
           "interpolateBoundary": {"none", "edgeOnly", "edgeAndCorner"},
           "orientation": {"rightHanded", "leftHanded"}}
INTERPOLATIONS = {"constant", "uniform", "varying", "vertex", "faceVarying"}
LAYER_FIELDS = {"defaultPrim", "upAxis", "metersPerUnit", "doc", "comment"}


class UsdError(Exception):
    pass


def need(holds, message):
    if not holds:
        raise UsdError(message)


class Reader:
    def __init__(self, text):
        need(text.startswith("#usda 1.0\n"), "the first line must be '#usda 1.0'")
        self.tokens, at = [], len("#usda 1.0\n")
        while text[at:].strip():
            match = TOKEN.match(text, at)
            need(match, f"no token at {text[at:at + 30]!r}")
            if not match.group(1):
                self.tokens.append(match.group(0).strip())
            at = match.end()
        self.at = 0

    def peek(self):
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def next(self, expected=None):
        token = self.peek()
        need(token and expected in (None, token), f"{expected!r} is due, there is {token!r}")
        self.at += 1
        return token

    def string(self):
        token = self.next()
        need(token.startswith('"'), f"a string is due, there is {token}")
        return token[1:-1]

    def scalar(self, kind):
        if kind == "token":
            return self.string()
        token = self.next()
        pattern = r"-?\d+" if kind == "int" else r"-?(\d+\.?\d*([eE][-+]?\d+)?|inf)"
        need(re.fullmatch(pattern, token), f"{token!r} is no {kind}")
        return int(token) if kind == "int" else float(token)

    def value(self, kind):
        if kind.endswith("[]"):
            values = []
            self.next("[")
            while self.peek() != "]":
                if values:
                    self.next(",")
                values.append(self.value(kind[:-2]))
            self.next("]")
            return values
        if kind in ("float3", "point3f", "double3"):
            self.next("(")
            x = self.scalar("float")
            self.next(",")
            y = self.scalar("float")
            self.next(",")
            z = self.scalar("float")
            self.next(")")
            return (x, y, z)
        if kind == "quatd":
            self.next("(")
            parts = [self.scalar("float")]
            for _ in range(3):
                self.next(",")
                parts.append(self.scalar("float"))
            self.next(")")
            need(abs(sum(p * p for p in parts) - 1) < 1e-12, f"{parts} is not a rotation")
            return tuple(parts)
        need(kind in ("int", "float", "token"), f"unknown type {kind}")
        return self.scalar(kind)

    def fields(self):
        """( name = "text" ... )"""
        found = {}
        if self.peek() != "(":
            return found
        self.next("(")
        while self.peek() != ")":
            name = self.next()
            self.next("=")
            need(name not in found, f"{name} stands twice")
            found[name] = self.string() if self.peek().startswith('"') else self.scalar("float")
        self.next(")")
        return found

    def mesh(self):
        attributes, interpolations = {}, {}
        layer = self.fields()
        need(set(layer) <= LAYER_FIELDS, f"unknown layer metadata in {sorted(layer)}")
        need(layer.get("upAxis") in ("Y", "Z"), "upAxis must be Y or Z")
        need(layer.get("metersPerUnit", 0) > 0, "metersPerUnit must be there, or it is 0.01")
        self.next("def")
        self.next("Mesh")
        need(self.string() == layer.get("defaultPrim"), "defaultPrim names no prim")
        self.next("{")
        while self.peek() != "}":
            uniform = self.peek() == "uniform"
            if uniform:
                self.next()
            kind, name = self.next(), self.next()
            need(name not in attributes, f"{name} stands twice")
            if name.startswith("primvars:"):
                need(not uniform, f"{name} must not be uniform")
            else:
                need(SCHEMA.get(name) == (kind, uniform), f"{name} as {kind} is not in the schema")
            self.next("=")
            attributes[name] = self.value(kind)
            metadata = self.fields()
            if name.startswith("primvars:"):
                need(metadata.get("interpolation") in INTERPOLATIONS, f"interpolation of {name}")
                interpolations[name] = metadata["interpolation"]
            else:
                need(not metadata, f"metadata of {name}")
        self.next("}")
        need(self.at == len(self.tokens), "something stands behind the prim")
        return attributes, interpolations


def check_topology(mesh):
    counts, indices, points = (mesh[name] for name in
                               ("faceVertexCounts", "faceVertexIndices", "points"))
    need(points and counts, "no points or no faces")
    need(sum(counts) == len(indices), "the counts do not add up to the indices")
    need(all(0 <= i < len(points) for i in indices), "an index is out of range")
    if mesh.get("subdivisionScheme") == "loop":
        need(set(counts) == {3}, "Loop's scheme takes triangles only")
    need(set(indices) == set(range(len(points))), "a point is used by no face")
    need(len(mesh["extent"]) == 2, "the extent is two corners")
    low, high = mesh["extent"]
    for axis in range(3):
        column = [p[axis] for p in points]
        need((min(column), max(column)) == (low[axis], high[axis]), "the extent is another")


def check_sharpness(mesh):
    indices, lengths = mesh.get("creaseIndices", []), mesh.get("creaseLengths", [])
    sharpness = mesh.get("creaseSharpnesses", [])
    need(sum(lengths) == len(indices), "creaseLengths do not add up to creaseIndices")
    need(all(length >= 2 for length in lengths), "a crease of fewer than two vertices")
    need(len(sharpness) in (len(lengths), sum(length - 1 for length in lengths)),
         "as many sharpnesses as creases or as their edges are needed")
    faces = mesh["faceVertexIndices"]
    edges, begin = set(), 0
    for count in mesh["faceVertexCounts"]:
        corners = faces[begin:begin + count]
        edges |= {frozenset((corners[i - 1], corners[i])) for i in range(count)}
        begin += count
    at = 0
    for length in lengths:
        for k in range(at, at + length - 1):
            need(frozenset(indices[k:k + 2]) in edges, f"{indices[k:k + 2]} is not an edge")
        at += length
    corners = mesh.get("cornerIndices", [])
    need(len(corners) == len(mesh.get("cornerSharpnesses", [])), "corners without sharpness")
    need(all(0 <= c < len(mesh["points"]) for c in corners), "a corner is out of range")
    need(all(s > 0 for s in sharpness + mesh.get("cornerSharpnesses", [])), "a sharpness below 0")


def check(text):
    """The attributes of the mesh; UsdError for what is wrong."""
    mesh, interpolations = Reader(text).mesh()
    for name in ("points", "faceVertexCounts", "faceVertexIndices", "extent"):
        need(name in mesh, f"{name} is missing")
    for name, words in ALLOWED.items():
        need(mesh.get(name) in words, f"{name} must be one of {sorted(words)}")
    check_topology(mesh)
    check_sharpness(mesh)
    sizes = {"constant": 1, "uniform": len(mesh["faceVertexCounts"]),
             "varying": len(mesh["points"]), "vertex": len(mesh["points"]),
             "faceVarying": len(mesh["faceVertexIndices"])}
    for name, interpolation in interpolations.items():
        need(len(mesh[name]) == sizes[interpolation], f"{name} has {len(mesh[name])} values")
    need(all(op in mesh for op in mesh.get("xformOpOrder", [])), "an xformOp is missing")
    return mesh


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        with open(sys.argv[1]) as file:
            found = check(file.read())
    except UsdError as error:
        sys.exit(f"{sys.argv[1]}: {error}")
    print(f"{len(found['points'])} points, {len(found['faceVertexCounts'])} faces")
