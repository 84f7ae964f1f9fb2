#!/usr/bin/env python3
"""Writes tests/scenes/sample.glb: a vaulted hall beside a courtyard, the level that `./run bake` shows.

Standard library only, no randomness: the same bytes everywhere. Every solid is closed and walls have thickness. There is
no TEXCOORD_1, so that charts are generated. CC0.

usage: make_sample.py [output.glb]
"""
import json
import math
import os
import struct
import sys
import zlib


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(sum(x * x for x in a)) or 1.0
    return [x / length for x in a]


class Mesh:
    """Triangles of one material: positions, normals, uvs, indices."""

    def __init__(self):
        self.position, self.normal, self.uv, self.index = [], [], [], []

    def polygon(self, corners, normals=None, uvs=None):
        """A convex polygon, counter-clockwise seen from its front."""
        flat = unit(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])))
        first = len(self.position)
        for i, corner in enumerate(corners):
            self.position.append(corner)
            self.normal.append(normals[i] if normals else flat)
            self.uv.append(uvs[i] if uvs else planar(corner, flat))
        for i in range(1, len(corners) - 1):
            self.index += [first, first + i, first + i + 1]

    def box(self, low, high):
        (x0, y0, z0), (x1, y1, z1) = low, high
        self.polygon([[x1, y0, z1], [x1, y0, z0], [x1, y1, z0], [x1, y1, z1]])
        self.polygon([[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]])
        self.polygon([[x0, y1, z1], [x1, y1, z1], [x1, y1, z0], [x0, y1, z0]])
        self.polygon([[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]])
        self.polygon([[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]])
        self.polygon([[x1, y0, z0], [x0, y0, z0], [x0, y1, z0], [x1, y1, z0]])

    def column(self, x, z, y0, y1, radius, sides=20):
        """A closed cylinder with smooth normals around."""
        ring = [(math.cos(2 * math.pi * i / sides), math.sin(2 * math.pi * i / sides)) for i in range(sides)]
        at = lambda c, y: [x + radius * c[0], y, z - radius * c[1]]
        for i in range(sides):
            a, b = ring[i], ring[(i + 1) % sides]
            na, nb = [a[0], 0, -a[1]], [b[0], 0, -b[1]]
            u0, u1 = i / sides, (i + 1) / sides
            self.polygon([at(a, y0), at(b, y0), at(b, y1), at(a, y1)], [na, nb, nb, na],
                         [[u0, y0], [u1, y0], [u1, y1], [u0, y1]])
        self.polygon([at(c, y1) for c in ring])
        self.polygon([at(c, y0) for c in reversed(ring)])

    def sphere(self, center, radius, rows=10):
        """A closed ball with smooth normals."""
        columns = 2 * rows
        def point(r, c):
            t, p = math.pi * r / rows, 2 * math.pi * (c % columns) / columns
            return [math.sin(t) * math.cos(p), math.cos(t), -math.sin(t) * math.sin(p)]
        for r in range(rows):
            for c in range(columns):
                corners = [point(r, c), point(r + 1, c), point(r + 1, c + 1), point(r, c + 1)]
                if r == 0:
                    corners = [corners[0], corners[1], corners[2]]
                elif r == rows - 1:
                    corners = [corners[0], corners[1], corners[3]]
                self.polygon([[k + radius * v for k, v in zip(center, n)] for n in corners], corners,
                             [[0, 0]] * len(corners))

    def arch_wall(self, x0, x1, y0, y1, z0, z1, middle, half_width, spring, steps=12):
        """A wall with an arched opening: two piers and, over the opening, one closed prism per step of the arch."""
        self.box([x0, y0, z0], [middle - half_width, y1, z1])
        self.box([middle + half_width, y0, z0], [x1, y1, z1])
        arc = [(middle - half_width * math.cos(math.pi * i / steps), spring + half_width * math.sin(math.pi * i / steps))
               for i in range(steps + 1)]
        for (xa, ya), (xb, yb) in zip(arc, arc[1:]):
            # Only the soffit and the two faces: the sides meet the neighbours.
            self.polygon([[xa, ya, z1], [xb, yb, z1], [xb, y1, z1], [xa, y1, z1]])
            self.polygon([[xb, yb, z0], [xa, ya, z0], [xa, y1, z0], [xb, y1, z0]])
            self.polygon([[xa, ya, z1], [xa, ya, z0], [xb, yb, z0], [xb, yb, z1]])
            self.polygon([[xa, y1, z0], [xa, y1, z1], [xb, y1, z1], [xb, y1, z0]])


def planar(p, n):
    """World-metre texture coordinates on the plane that faces n most."""
    axis = max(range(3), key=lambda i: abs(n[i]))
    return [[p[2], -p[1]], [p[0], p[2]], [p[0], -p[1]]][axis]


class Glb:
    def __init__(self):
        self.bin = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "bakewell tests/tools/make_sample.py",
                               "copyright": "CC0"},
                     "extensionsUsed": ["EXT_mesh_gpu_instancing", "KHR_lights_punctual",
                                        "KHR_materials_emissive_strength"],
                     "scene": 0, "scenes": [{"name": "sample", "nodes": []}], "nodes": [], "meshes": [], "materials": [],
                     "accessors": [], "bufferViews": []}

    def push(self, array, element):
        self.json.setdefault(array, []).append(element)
        return len(self.json[array]) - 1

    def view(self, data, target=None):
        self.bin += b"\0" * (-len(self.bin) % 4)
        view = {"buffer": 0, "byteOffset": len(self.bin), "byteLength": len(data)}
        if target:
            view["target"] = target
        self.bin += data
        return self.push("bufferViews", view)

    def vectors(self, rows, bounds=False, target=34962):
        flat = [float(x) for row in rows for x in row]
        single = struct.unpack("<%df" % len(flat), struct.pack("<%df" % len(flat), *flat))
        width = len(rows[0])
        accessor = {"bufferView": self.view(struct.pack("<%df" % len(flat), *flat), target), "componentType": 5126,
                    "type": "VEC%d" % width, "count": len(rows)}
        if bounds:
            accessor["min"] = [min(single[c::width]) for c in range(width)]
            accessor["max"] = [max(single[c::width]) for c in range(width)]
        return self.push("accessors", accessor)

    def material(self, name, color, emission=None, strength=1.0, **more):
        material = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": list(color) + [1.0], "metallicFactor": 0.0,
                                                           "roughnessFactor": 1.0}}
        if emission:
            material["emissiveFactor"] = emission
            material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
        material.update(more)
        return self.push("materials", material)

    def mesh(self, name, parts):
        """parts: (Mesh, material)."""
        primitives = []
        for mesh, material in parts:
            index = struct.pack("<%dH" % len(mesh.index), *mesh.index)
            attributes = {"POSITION": self.vectors(mesh.position, True), "NORMAL": self.vectors(mesh.normal),
                          "TEXCOORD_0": self.vectors(mesh.uv)}
            indices = self.push("accessors", {"bufferView": self.view(index, 34963), "componentType": 5123,
                                              "type": "SCALAR", "count": len(mesh.index)})
            primitives.append({"attributes": attributes, "indices": indices, "material": material})
        return self.push("meshes", {"name": name, "primitives": primitives})

    def node(self, name, **members):
        index = self.push("nodes", {"name": name, **members})
        self.json["scenes"][0]["nodes"].append(index)
        return index

    def bytes(self):
        self.json["buffers"] = [{"byteLength": len(self.bin)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.bin) + b"\0" * (-len(self.bin) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def png(width, height, rgba):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + rgba[4 * width * y:4 * width * (y + 1)] for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def screen_pixels(side=64):
    """A carved screen: rings and a diagonal lattice, opaque where there is wood."""
    pixels = bytearray()
    for y in range(side):
        for x in range(side):
            u, v = (x + 0.5) / side - 0.5, (y + 0.5) / side - 0.5
            ring = abs(math.hypot(u, v) - 0.34) < 0.06
            lattice = abs(abs(u) - abs(v)) < 0.05
            frame = max(abs(u), abs(v)) > 0.44
            wood = 255 if ring or lattice or frame else 0
            pixels += bytes([150, 96, 52, wood])
    return bytes(pixels)


# The hall: inside x in [0, 12], z in [-8, 0], 5 m high, walls 0.3 m. The courtyard: z in [0, 7], x in [0, 12].
WALL, HEIGHT = 0.3, 5.0


def walls():
    m = Mesh()
    # Back wall of the hall, its left wall with a row of tall windows, its right wall.
    m.box([-WALL, 0, -8 - WALL], [12 + WALL, HEIGHT, -8])
    m.box([12, 0, -8], [12 + WALL, HEIGHT, -WALL])
    for z0, z1 in [(-8, -7.2), (-6.2, -5.2), (-4.2, -3.2), (-2.2, -WALL)]:
        m.box([-WALL, 0, z0], [0, HEIGHT, z1])
    for z0, z1 in [(-7.2, -6.2), (-5.2, -4.2), (-3.2, -2.2)]:
        m.box([-WALL, 0, z0], [0, 0.9, z1])
        m.box([-WALL, 3.9, z0], [0, HEIGHT, z1])
    return m


def arcade():
    m = Mesh()
    for i in range(4):
        x = 3.0 * i
        low = x - WALL if i == 0 else x
        high = x + 3.0 + WALL if i == 3 else x + 3.0
        m.arch_wall(low, high, 0, HEIGHT, -WALL, 0, x + 1.5, 1.1, 2.4)
    return m


def floor_and_roof():
    floor, roof = Mesh(), Mesh()
    floor.box([-WALL, -0.3, -8 - WALL], [12 + WALL, 0, 0])
    roof.box([-WALL, HEIGHT, -8 - WALL], [12 + WALL, HEIGHT + 0.25, 0])
    for x in (3.0, 6.0, 9.0):
        roof.box([x - 0.15, HEIGHT - 0.35, -8], [x + 0.15, HEIGHT, -WALL])
    return floor, roof


def courtyard():
    ground, wall = Mesh(), Mesh()
    ground.box([-WALL, -0.4, 0], [12 + WALL, -0.1, 7 + WALL])
    wall.box([-WALL, -0.1, 0], [0, 2.6, 7])
    wall.box([-WALL, -0.1, 7], [12 + WALL, 2.6, 7 + WALL])
    wall.box([12, -0.1, 0], [12 + WALL, 2.6, 7])
    return ground, wall


def stairs():
    m = Mesh()
    for i in range(6):
        m.box([9.4, 0, -7.9 + 0.32 * i], [11.9, 0.2 * (6 - i), -7.9 + 0.32 * (i + 1)])
    return m


def columns():
    m = Mesh()
    for x in (3.0, 6.0, 9.0):
        m.box([x - 0.35, 0, -4.35], [x + 0.35, 0.25, -3.65])
        m.column(x, -4.0, 0.25, HEIGHT - 0.6, 0.24)
        m.box([x - 0.35, HEIGHT - 0.6, -4.35], [x + 0.35, HEIGHT - 0.35, -3.65])
    return m


def bench():
    m = Mesh()
    m.box([0, 0.4, 0], [1.6, 0.48, 0.45])
    m.box([0.1, 0, 0.05], [0.2, 0.4, 0.4])
    m.box([1.4, 0, 0.05], [1.5, 0.4, 0.4])
    m.box([0, 0.48, 0], [0.5, 0.7, 0.08])
    return m


def crate():
    m = Mesh()
    m.box([-0.3, 0, -0.3], [0.3, 0.6, 0.3])
    return m


def screen():
    """A thin closed board with the carved texture on both faces."""
    m = Mesh()
    uvs = [[0, 2], [2, 2], [2, 0], [0, 0]]
    m.polygon([[0, 0, 0.02], [1.8, 0, 0.02], [1.8, 1.8, 0.02], [0, 1.8, 0.02]], None, uvs)
    m.polygon([[1.8, 0, 0], [0, 0, 0], [0, 1.8, 0], [1.8, 1.8, 0]], None, uvs)
    return m


def lamp(center):
    m = Mesh()
    m.sphere(center, 0.16)
    return m


def cord(center):
    """What a lamp hangs from."""
    m = Mesh()
    x, y, z = center
    m.box([x - 0.015, y + 0.15, z - 0.015], [x + 0.015, HEIGHT, z + 0.015])
    return m


def yaw(degrees):
    half = math.radians(degrees) / 2
    return [0.0, math.sin(half), 0.0, math.cos(half)]


def build():
    g = Glb()
    plaster = g.material("plaster", [0.76, 0.72, 0.64])
    stone = g.material("stone", [0.55, 0.52, 0.48])
    tiles = g.material("terracotta tiles", [0.52, 0.26, 0.17])
    timber = g.material("timber", [0.42, 0.27, 0.15])
    gravel = g.material("gravel", [0.48, 0.45, 0.40])
    paint = g.material("blue crate", [0.12, 0.26, 0.50])
    amber = g.material("amber lamp", [0.0, 0.0, 0.0], [1.0, 0.55, 0.18], 55.0)
    teal = g.material("teal lamp", [0.0, 0.0, 0.0], [0.15, 0.85, 1.0], 40.0)
    g.push("images", {"bufferView": g.view(png(64, 64, screen_pixels())), "mimeType": "image/png"})
    g.push("samplers", {"magFilter": 9728, "minFilter": 9728, "wrapS": 10497, "wrapT": 33648})
    g.push("textures", {"source": 0, "sampler": 0})
    carved = g.material("carved screen", [1.0, 1.0, 1.0], alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    g.json["materials"][carved]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}

    floor, roof = floor_and_roof()
    ground, yard_wall = courtyard()
    g.node("hall", mesh=g.mesh("hall", [(walls(), plaster), (floor, tiles), (roof, timber)]))
    g.node("arcade", mesh=g.mesh("arcade", [(arcade(), plaster)]))
    g.node("courtyard", mesh=g.mesh("courtyard", [(ground, gravel), (yard_wall, stone)]))
    g.node("stairs", mesh=g.mesh("stairs", [(stairs(), stone)]))
    g.node("columns", mesh=g.mesh("columns", [(columns(), stone)]))
    # One bench, and the same one mirrored.
    seat = g.mesh("bench", [(bench(), timber)])
    g.node("bench", mesh=seat, translation=[3.6, 0.0, -7.8])
    g.node("bench mirrored", mesh=seat, translation=[8.4, 0.0, -7.8], scale=[-1.0, 1.0, 1.0])
    g.node("screen", mesh=g.mesh("screen", [(screen(), carved)]), translation=[0.7, 0.0, -3.4], rotation=yaw(62))
    crates = {"TRANSLATION": g.vectors([[10.9, -0.1, 1.0], [10.2, -0.1, 1.1], [10.6, 0.5, 1.05], [1.0, -0.1, 5.9]], target=None),
              "ROTATION": g.vectors([yaw(0), yaw(12), yaw(40), yaw(25)], target=None),
              "SCALE": g.vectors([[1, 1, 1], [1, 1, 1], [0.8, 0.8, 0.8], [1.6, 1.2, 1.6]], target=None)}
    g.node("crates", mesh=g.mesh("crate", [(crate(), paint)]),
           extensions={"EXT_mesh_gpu_instancing": {"attributes": crates}})
    for name, center, material in [("amber lamp", [6.0, 3.1, -6.4], amber), ("teal lamp", [11.2, 2.0, -2.0], teal)]:
        g.node(name, mesh=g.mesh(name, [(lamp(center), material), (cord(center), timber)]), extras={"lightmapped": False})
    g.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "directional", "name": "sun", "color": [1.0, 0.9, 0.74], "intensity": 32.0,
         "extras": {"angularDiameterDeg": 0.53}}]}}
    # The sun stands in the south-west, 38 degrees high: yaw, then pitch down.
    y, p = math.radians(-38) / 2, math.radians(-38) / 2
    rotation = [math.cos(y) * math.sin(p), math.sin(y) * math.cos(p), -math.sin(y) * math.sin(p),
                math.cos(y) * math.cos(p)]
    g.node("sun", rotation=[round(q, 9) for q in rotation], extensions={"KHR_lights_punctual": {"light": 0}})
    g.json["scenes"][0]["extras"] = {
        "environment": {"type": "gradient", "zenith": [1.3, 2.1, 4.0], "horizon": [3.6, 3.9, 4.3],
                        "ground": [0.35, 0.32, 0.28]},
        "camera": {"fovYDeg": 62, "position": [10.8, 2.2, 6.3], "target": [4.6, 1.6, -3.6]}}
    return g.bytes()


def main():
    default = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "scenes", "sample.glb")
    path = sys.argv[1] if len(sys.argv) > 1 else default
    with open(path, "wb") as file:
        file.write(build())


if __name__ == "__main__":
    main()
