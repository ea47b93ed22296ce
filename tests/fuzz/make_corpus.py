#!/usr/bin/env python3
"""Makes the seeds of the fuzz targets: small files of every kind the readers know.

    make_corpus.py RILIEVO    RILIEVO: the built command, which makes the .dss files and
                            a compressed GLB

Not made here: unpacked/rows.zst, which zstd 1.5 wrote of the rows of unpacked/rows.gz, and
las/packed_*.laz, which laz-perf 3 wrote of the points of laz_samples_test.cc.
"""
import gzip
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent / "corpus"
POINTS = [(0, 0, 0), (1, 0, 0.5), (1, 1, -0.25), (0, 1, 1e-3)]
FACES = [(0, 1, 2), (0, 2, 3)]


def put(name, data):
    path = HERE / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def ply():
    head = ("ply\nformat {} 1.0\ncomment seed\nelement vertex 4\nproperty {} x\nproperty {} y\n"
            "property {} z\nproperty uchar red\nelement face 2\n"
            "property list uchar int vertex_indices\nend_header\n")
    text = "".join(f"{x} {y} {z} 7\n" for x, y, z in POINTS)
    text += "".join("3 %d %d %d\n" % f for f in FACES)
    put("ply/ascii.ply", head.format("ascii", *["float"] * 3) + text)
    for order, sign in (("little", "<"), ("big", ">")):
        for kind, code in (("float", "f"), ("double", "d")):
            body = b"".join(struct.pack(sign + 3 * code + "B", *p, 7) for p in POINTS)
            body += b"".join(struct.pack(sign + "B3i", 3, *f) for f in FACES)
            name = f"binary_{order}_endian"
            put(f"ply/{name}_{kind}.ply", head.format(name, *[kind] * 3).encode() + body)
    normals = ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float nx\nproperty float ny\n"
               "property float nz\nproperty double x\nproperty double y\nproperty double z\n"
               "property uchar source\nproperty list uchar short extra\nend_header\n"
               "0 0 1 2 3 4 1 2 5 6\n")
    put("ply/normals.ply", normals)
    places = ("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
              "property float z\nproperty short station\nelement station 2\nproperty double x\n"
              "property double y\nproperty double z\nend_header\n"
              "0 0 0 1\n1 0 0.5 0\n1 1 -0.25 -1\n0 1 1e-3 1\n0.1 5 6\n7 8 9\n")
    put("ply/stations.ply", places)


def lzf(data):
    packed = b""
    for i in range(0, len(data), 32):
        piece = data[i:i + 32]
        packed += bytes([len(piece) - 1]) + piece
    return packed


def pcd():
    head = ("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\n"
            "COUNT 1 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA {}\n")
    put("pcd/ascii.pcd", head.format("ascii") + "".join(f"{x} {y} {z} 9\n" for x, y, z in POINTS))
    rows = b"".join(struct.pack("<3fI", *p, 9) for p in POINTS)
    put("pcd/binary.pcd", head.format("binary").encode() + rows)
    columns = b"".join(struct.pack("<4f", *[p[k] for p in POINTS]) for k in range(3))
    columns += struct.pack("<4I", 9, 9, 9, 9)
    packed = lzf(columns)
    put("pcd/compressed.pcd", head.format("binary_compressed").encode() +
        struct.pack("<II", len(packed), len(columns)) + packed)
    put("pcd/old.pcd", "VERSION .6\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n"
        "POINTS 1\nDATA ascii\n1 nan 3\n")
    put("pcd/viewpoint.pcd", "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\n"
        "TYPE F F F F F F\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 7 8 9.5 1 0 0 0\nPOINTS 2\nDATA ascii\n"
        "1 2 3 0 0 1\n4 5 6 0 -1 nan\n")
    put("lzf/literals", struct.pack("<H", len(columns)) + packed)
    put("lzf/match", b"\x0c\x00" + b"\x00a" + bytes([7 << 5, 2, 0]))


def text_formats():
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    put("xyz/plain.xyz", rows)
    put("xyz/commas.txt", "# x, y, z\n// more\nx,y,z,i\n" + "1,2,3,4\n-1e-3;2;.5;0\n")
    put("xyz/blocks.pts", "4\n" + rows + "1\n5\t6\t7\t255\r\n")
    put("xyz/quoted.csv", '"X","Y","Z [m]","a, b"\n1,2,3,4\n')
    put("xyz/survey.csv", "\ufeffid;Northing (m);Easting (m);Height (m)\r\n7;2;1;3\r\n")
    put("xyz/sights.csv", "Nx,Ny,Nz,X,Y,Z,sensor_x,sensor_y,sensor_z\n"
        "0,0,1,1,2,3,7,8,9\n0,1,0,4,5,6\n")
    put("xyz/commented.txt", "//Time X Y Z R G B\n2\n0 1 2 3 7 8 9\n0 4 5 6 7 8 9\n")
    put("obj/mesh.obj", "# seed\nmtllib a.mtl\no a\n" + "".join("v %g %g %g\n" % p for p in POINTS) +
        "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 -2 -3\nf 1//1 2//1 \\\n3//1\n")
    put("obj/colors.obj", "v 1 2 3 0.5 0.5 0.5\nv 4 5 6 1\n")
    facet = "facet normal 0 0 1\n outer loop\n" + "".join("  vertex %g %g %g\n" % POINTS[k]
                                                          for k in FACES[0]) + " endloop\nendfacet\n"
    put("stl/ascii.stl", "solid seed\n" + facet + "endsolid seed\n")
    body = b"".join(struct.pack("<3f", 0, 0, 1) +
                    b"".join(struct.pack("<3f", *POINTS[k]) for k in f) + b"\0\0" for f in FACES)
    put("stl/binary.stl", b"seed".ljust(80) + struct.pack("<I", 2) + body)


def glb(name, nodes, primitives, accessors):
    """`accessors`: (component type, type, code of struct, values) each."""
    binary, views, described = b"", [], []
    for component, kind, code, values in accessors:
        data = struct.pack(f"<{len(values)}{code}", *values)
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[kind]
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        described.append({"bufferView": len(views) - 1, "componentType": component, "type": kind,
                          "count": len(values) // width, "normalized": code == "H"})
        binary += data
    root = {"scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "accessors": described,
            "meshes": [{"primitives": primitives}], "bufferViews": views,
            "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(root, separators=(",", ":")).encode()
    chunks = b""
    for kind, data in ((b"JSON", text + b" " * (-len(text) % 4)),
                       (b"BIN\0", binary + bytes(-len(binary) % 4))):
        chunks += struct.pack("<I", len(data)) + kind + data
    put(f"glb/{name}.glb", b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)


def glb_files():
    points = (5126, "VEC3", "f", [c for p in POINTS for c in p])
    faces = [corner for face in FACES for corner in face]
    glb("indexed", [{"mesh": 0, "scale": [1, -2, 3]}],
        [{"attributes": {"POSITION": 0}, "indices": 1}], [points, (5125, "SCALAR", "I", faces)])
    glb("strips", [{"children": [1], "rotation": [0, 0, 0.6, 0.8]}, {"mesh": 0}],
        [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "mode": 5},
         {"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": 6}],
        [points, (5123, "VEC4", "H", list(range(0, 64000, 4000))),
         (5121, "SCALAR", "B", [0, 1, 3, 2])])


def packed():
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS).encode()
    put("unpacked/rows.gz", gzip.compress(rows, mtime=0))
    put("unpacked/members.gz", gzip.compress(b"0 0 0\n", 1, mtime=0) + gzip.compress(b"", mtime=0))


def las():
    for minor, kind, size, red in ((2, 0, 20, 0), (2, 3, 36, 28), (4, 7, 36, 30)):
        head = bytearray({2: 227, 4: 375}[minor])
        head[0:4], head[24], head[25] = b"LASF", 1, minor
        struct.pack_into("<HII", head, 94, len(head), len(head) + 3, 0)
        struct.pack_into("<BHI", head, 104, kind, size, 4 if kind < 6 else 0)
        struct.pack_into("<6d", head, 131, .001, .001, .001, 4.6e6, 5.5e6, 0)
        if minor == 4:
            struct.pack_into("<Q", head, 247, 4)
        rows = b""
        for i, p in enumerate(POINTS):
            row = bytearray(size)
            struct.pack_into("<3iH", row, 0, *[round(c * 1000) for c in p], i)
            if red:
                struct.pack_into("<3H", row, red, 256 * i, 9, 9)
            rows += row
        put(f"las/format_{kind}.las", bytes(head) + b"vlr" + rows)


def crc32c(data):
    crc = 0xffffffff
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82f63b78 if crc & 1 else 0)
    return crc ^ 0xffffffff


def e57_bits(values, minimum, maximum):
    width = (maximum - minimum).bit_length()
    number = sum(value - minimum << width * i for i, value in enumerate(values))
    return number.to_bytes((width * len(values) + 7) // 8, "little")


def e57_packet(kind, content):
    content += bytes(-len(content) % 4)
    return struct.pack("<HH", kind, len(content) + 3) + content


def e57(name, page, scans):
    """`scans`: (elements of the prototype, bytestreams, elements of the Data3D) each."""
    data = bytearray(48)

    def physical(at):
        return at // (page - 4) * page + at % (page - 4)

    xml = "<?xml version='1.0'?><e57Root><data3D>"
    for fields, streams, more in scans:
        at = len(data)
        packets = b""
        # The first three bytes of each stream, then the rest.
        for pieces in ([s[:3] for s in streams], [s[3:] for s in streams]):
            sizes = struct.pack(f"<{len(pieces) + 1}H", len(pieces), *map(len, pieces))
            packets += e57_packet(1, sizes + b"".join(pieces)) + e57_packet(2, b"") + \
                e57_packet(0, bytes(12))
        data += struct.pack("<4Q", 1, 32 + len(packets), physical(at + 32), 0) + packets
        xml += f"<vectorChild>{more}<points fileOffset='{physical(at)}' recordCount='4'>" \
               f"<prototype>{fields}</prototype></points></vectorChild>"
    xml += "</data3D></e57Root>"
    struct.pack_into("<8s2I4Q", data, 0, b"ASTM-E57", 1, 0, 0, physical(len(data)), len(xml), page)
    data += xml.encode()
    data += bytes(-len(data) % (page - 4))
    struct.pack_into("<Q", data, 16, len(data) // (page - 4) * page)
    pages = [bytes(data[at:at + page - 4]) for at in range(0, len(data), page - 4)]
    put(f"e57/{name}.e57", b"".join(p + struct.pack(">I", crc32c(p)) for p in pages))


def e57_files():
    axes = list(zip(*POINTS))
    singles = "".join(f"<cartesian{c} type='Float' precision='single'/>" for c in "XYZ")
    doubles = "".join(f"<spherical{c} type='Float'/>" for c in ("Range", "Azimuth", "Elevation"))
    scaled = "".join(f"<cartesian{c} type='ScaledInteger' minimum='-999' maximum='1000' "
                     "scale='0.001'/>" for c in "XYZ")
    state = "<{}InvalidState type='Integer' minimum='0' maximum='2'/>"
    colors = "".join(f"<color{c} type='Integer' minimum='0' maximum='255'/>"
                     for c in ("Red", "Green", "Blue"))
    pose = ("<pose><rotation><w>0.6</w><x/><y/><z>-8e-1</z></rotation><translation>"
            "<x>4600000</x><y>1</y><z/></translation></pose>")
    float_streams = [struct.pack("<4f", *axis) for axis in axes]
    e57("floats", 1024, [(singles, float_streams, "")])
    e57("integers", 128, [
        (scaled + state.format("cartesian") + colors +
         "<intensity type='Integer' minimum='7' maximum='7'/>",
         [e57_bits([round(1000 * c) for c in axis], -999, 1000) for axis in axes] +
         [e57_bits([0, 1, 2, 0], 0, 2)] + [bytes([0, 9, 99, 255])] * 3 + [b""], "")])
    e57("poses", 256, [
        (singles, float_streams, pose),
        (doubles + state.format("spherical"),
         [struct.pack("<4d", *axis) for axis in axes] + [e57_bits([0, 0, 0, 1], 0, 2)], pose)])


def ptx():
    head = "{}\n{}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n4600000 5500000 0 1\n"
    rows = "".join(f"{x} {y} {z} 0.5\n" for x, y, z in POINTS)
    put("ptx/two.ptx", head.format(2, 2) + matrix + rows + head.format(1, 1) + matrix +
        "1 2 3 0.25 1 2 3\n")


def dss(rilievo):
    golden = HERE.parent.parent / "golden"
    for path in sorted(golden.glob("*.dss")):
        put(f"dss/{path.name}", path.read_bytes())
    with tempfile.TemporaryDirectory() as folder:
        scan, out = f"{folder}/scan.ply", f"{folder}/out.dss"
        for shape, more in (("sphere", ["--max-level", "2"]), ("terrain", ["--max-level", "1"]),
                            ("torus", ["--max-level", "3", "--max-error", "0.01"]),
                            ("sphere", ["--max-level", "0"])):
            subprocess.run([rilievo, "simulate", shape, "-o", scan, "--points", "200", "--views",
                            "2"], check=True, stdout=subprocess.DEVNULL)
            subprocess.run([rilievo, "reconstruct", scan, "-o", out, "--quiet", "--control-faces",
                            "20"] + more, check=True, stdout=subprocess.DEVNULL)
            put(f"dss/{shape}{more[1]}.dss", pathlib.Path(out).read_bytes())
        rows = "x y z r g b\n"
        for i in range(200):
            z, turn = (i + 0.5) / 100 - 1, 2.399963 * i
            across = math.sqrt(1 - z * z)
            rows += f"{across * math.cos(turn)} {across * math.sin(turn)} {z} " \
                    f"{40 * i % 256} {99 * i % 256} {i}\n"
        pathlib.Path(f"{folder}/scan.xyz").write_text(rows)
        subprocess.run([rilievo, "reconstruct", f"{folder}/scan.xyz", "-o", out, "--quiet",
                        "--control-faces", "20", "--max-level", "2"], check=True,
                       stdout=subprocess.DEVNULL)
        put("dss/colored2.dss", pathlib.Path(out).read_bytes())
        mesh = f"{folder}/small.glb"
        subprocess.run([rilievo, "export", out, mesh, "--level", "1", "--compress"], check=True,
                       stdout=subprocess.DEVNULL)
        put("glb/compressed.glb", pathlib.Path(mesh).read_bytes())


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    ply()
    pcd()
    text_formats()
    glb_files()
    packed()
    las()
    e57_files()
    ptx()
    dss(sys.argv[1])
