"""Levels that nobody has tuned on: kinds of places, each another one with every seed. Without TEXCOORD_1, metres, +Y up.

A shape goes into the level's one object, by material; its front is where its normals point."""
import math
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "converge", "scenes"))
import mesh as scene_mesh  # noqa: E402
from mesh import unit  # noqa: E402

DARK = {"type": "constant", "radiance": [0, 0, 0]}
BLUE_SKY = {"type": "gradient", "zenith": [0.3, 0.5, 1.0], "horizon": [1.0, 1.0, 1.0], "ground": [0.1, 0.1, 0.1]}
SUN = {"color": [1.0, 0.95, 0.85], "extras": {"angularDiameterDeg": 0.53}}


def rotation(rng):
    """Of all, uniform."""
    w, x, y, z = unit(rng.normal(size=4))
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def icosphere(splits):
    """Unit corners and triangles of a sphere of 20 * 4^splits triangles."""
    g = (1 + math.sqrt(5)) / 2
    corners = [unit(p) for a in (-1, 1) for b in (-g, g) for p in ((a, b, 0), (0, a, b), (b, 0, a))]
    near = lambda i, j: np.linalg.norm(corners[i] - corners[j]) < 1.06
    faces = [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if near(i, j) and near(j, k) and near(i, k)]
    faces = [(i, j, k) if np.dot(np.cross(corners[j] - corners[i], corners[k] - corners[i]), corners[i]) > 0 else (i, k, j) for i, j, k in faces]
    for _ in range(splits):
        middles, finer = {}, []

        def middle(i, j):
            if (min(i, j), max(i, j)) not in middles:
                middles[min(i, j), max(i, j)] = len(corners)
                corners.append(unit(corners[i] + corners[j]))
            return middles[min(i, j), max(i, j)]

        for i, j, k in faces:
            ij, jk, ki = middle(i, j), middle(j, k), middle(k, i)
            finer += [(i, ij, ki), (j, jk, ij), (k, ki, jk), (ij, jk, ki)]
        faces = finer
    return np.array(corners), np.array(faces)


class Level:
    """Six materials m0 to m5 of random albedo, and what the kind adds."""

    def __init__(self, rng, albedo=(0.2, 0.8), environment=DARK):
        self.rng, self.environment = rng, environment
        self.materials, self.parts, self.lights = {}, {}, []
        for k in range(6):
            self.material(f"m{k}", rng.uniform(*albedo, 3))

    def material(self, name, albedo, emission=None, double_sided=False):
        light = {} if emission is None else {"emission": emission}
        self.materials[name] = {**scene_mesh.gltf_material(name, {"albedo": [float(a) for a in albedo], **light}), "doubleSided": double_sided}

    def some(self):
        return f"m{self.rng.integers(1, 6)}"

    def triangle(self, material, corners, normals=None):
        flat = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
        self.parts.setdefault(material, []).append((np.asarray(corners), [flat] * 3 if normals is None else normals))

    def quad(self, material, origin, u, v):
        o, u, v = (np.asarray(a, float) for a in (origin, u, v))
        self.triangle(material, np.array([o, o + u, o + u + v]))
        self.triangle(material, np.array([o, o + u + v, o + v]))

    def box(self, material, center, size, turn=np.eye(3), inward=False):
        for axis in range(3):
            for side in (-1, 1):
                n, u, v = np.zeros(3), np.zeros(3), np.zeros(3)
                n[axis], u[(axis + 1) % 3], v[(axis + 2) % 3] = side * size[axis] / 2, size[(axis + 1) % 3], size[(axis + 2) % 3]
                corner = np.asarray(center) + turn @ (n - u / 2 - v / 2)
                if (side < 0) != inward:
                    u, v = v, u
                self.quad(material, corner, turn @ u, turn @ v)

    def sphere(self, material, center, radius, splits=2, rough=0.0, inward=False):
        corners, faces = icosphere(splits)
        place = np.asarray(center) + corners * (radius * (1 + rough * self.rng.normal(size=len(corners))))[:, None]
        for face in faces:
            face = face[::-1] if inward else face
            self.triangle(material, place[face], None if rough else corners[face] * (-1 if inward else 1))

    def room(self, size):
        self.box("m0", [0, size[1] / 2, 0], size, inward=True)

    light = scene_mesh.Mesh.light

    def write(self, path):
        names, chunks, accessors, primitives = sorted(self.parts), [], [], []

        def accessor(values, kind, component, target):
            a = {"bufferView": len(chunks), "componentType": component, "count": len(values), "type": kind}
            if kind == "VEC3":
                a["min"], a["max"] = values.min(0).tolist(), values.max(0).tolist()
            chunks.append((values.tobytes(), target))
            accessors.append(a)
            return len(accessors) - 1

        for i, name in enumerate(names):
            vertex = np.concatenate([np.hstack([p, n]) for p, n in self.parts[name]]).astype(np.float32)
            vertex, index = np.unique(vertex.round(5), axis=0, return_inverse=True)
            primitives.append({"attributes": {"POSITION": accessor(vertex[:, :3].copy(), "VEC3", 5126, 34962), "NORMAL": accessor(vertex[:, 3:].copy(), "VEC3", 5126, 34962)},
                               "indices": accessor(index.ravel().astype(np.uint32), "SCALAR", 5125, 34963), "material": i})
        nodes = [{"mesh": 0, "name": "level", "extras": {"lightmapped": True}}] + [node for node, _ in self.lights]
        gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes))), "extras": {"environment": self.environment}}], "nodes": nodes,
                "meshes": [{"primitives": primitives}], "accessors": accessors, "materials": [self.materials[name] for name in names],
                "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"]}
        if self.lights:
            gltf["extensions"] = {"KHR_lights_punctual": {"lights": [light for _, light in self.lights]}}
        scene_mesh.write_glb(path, gltf, chunks)


def clutter(rng):
    """A room full of boxes in all directions under three panels."""
    level = Level(rng)
    level.room([10, 4, 8])
    for _ in range(25):
        level.box(level.some(), rng.uniform([-4, 0.8, -3], [4, 3, 3]), rng.uniform(0.2, 0.9, 3), rotation(rng))
    level.material("lamp", [0, 0, 0], [30, 26, 20])
    for _ in range(3):
        level.quad("lamp", rng.uniform([-4, 3.9, -3], [3, 3.95, 2]), [0.8, 0, 0], [0, 0, 0.4])
    return level


def bright(rng):
    """White spheres in a white room: fifteen bounces."""
    level = Level(rng, (0.9, 0.94))
    level.room([6, 3, 6])
    for _ in range(6):
        level.sphere("m1", rng.uniform([-2.2, 0.8, -2.2], [2.2, 2.2, 2.2]), rng.uniform(0.2, 0.6))
    level.material("lamp", [0, 0, 0], [10, 10, 10])
    level.sphere("lamp", [0, 2.5, 0], 0.1, 1)
    return level


def doorway(rng):
    """All light of the further room comes through a slit of a door."""
    level = Level(rng, (0.4, 0.8))
    level.room([8, 2.8, 4])
    gap = rng.uniform(0.15, 0.4)
    for z0, z1 in ((-2, 0), (gap, 2)):
        level.box("m1", [0, 1.4, (z0 + z1) / 2], [0.1, 2.8, z1 - z0])
    level.box("m2", [0, 2.4, gap / 2], [0.1, 0.8, gap])
    level.material("lamp", [0, 0, 0], [60, 55, 50])
    level.quad("lamp", [-3, 2.79, rng.uniform(-1.5, 0.5)], [1, 0, 0], [0, 0, 1])
    for _ in range(5):
        level.box(level.some(), [rng.uniform(1, 3.3), 0.45, rng.uniform(-1.4, 1.4)], rng.uniform(0.3, 0.9, 3))
    return level


def cave(rng):
    """Two rough hollows that cut each other, rocks, a lamp and a spot light."""
    level = Level(rng, (0.2, 0.6))
    for k in range(2):
        level.sphere(f"m{k}", [6.5 * k, 0, 0], 4, 3, 0.08, inward=True)
    for _ in range(10):
        level.sphere(level.some(), rng.uniform([-2.5, -3, -2.5], [8.5, 0, 2.5]), rng.uniform(0.2, 0.6), 1, 0.1)
    level.light("point", rng.uniform([-1, 0, -1], [0, 2, 1]), color=[1.0, 0.6, 0.3], intensity=20.0)
    level.light("spot", [7, 2, 0], [0.2, -1, 0.3], color=[0.4, 0.6, 1.0], intensity=200.0, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.5})
    return level


def night(rng):
    """A street of blocks with lit windows, neon tubes, lamps and spot lights under a dark sky."""
    level = Level(rng, (0.1, 0.6), {"type": "constant", "radiance": [0.01, 0.012, 0.02]})
    level.material("neon", [0, 0, 0], [20, 3, 12])
    level.material("window", [0.1, 0.1, 0.1], [2, 1.6, 0.9])
    level.quad("m0", [-20, 0, -20], [0, 0, 40], [40, 0, 0])
    for _ in range(12):
        (x, z), (w, d), h = rng.uniform(-15, 15, 2), rng.uniform(2, 5, 2), rng.uniform(3, 9)
        level.box(level.some(), [x, h / 2, z], [w, h, d])
        level.quad("window", [x - 0.4, h / 2, z + d / 2 + 0.01], [0.8, 0, 0], [0, 1, 0])
    for i in range(20):
        x, z = rng.uniform(-18, 18, 2)
        spot = {"spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.9}} if i % 2 else {}
        level.light("spot" if i % 2 else "point", [x, 4, z], [0, -1, 0], color=rng.uniform(0.5, 1, 3).tolist(), intensity=float(rng.uniform(20, 200)), **spot)
    for _ in range(8):
        x, z = rng.uniform(-15, 15, 2)
        level.box("neon", [x, 2.5, z], [2, 0.05, 0.05])
    return level


def shelves(rng):
    """Rows of books on shelves under long lamps: everything is as small as a texel."""
    level = Level(rng)
    level.room([8, 3, 6])
    for k in range(4):
        x = 2 * k - 3
        for y in np.arange(0.2, 2.6, 0.4):
            level.box("m1", [x, y, 0], [0.5, 0.02, 4])
        for z in (-2, 0, 2):
            level.box("m2", [x, 1.31, z], [0.5, 2.6, 0.03])
        for _ in range(30):
            level.box(level.some(), [x, 0.345 + 0.4 * rng.integers(0, 6), rng.uniform(-1.9, 1.9)], [0.3, 0.25, rng.uniform(0.05, 0.15)])
    level.material("lamp", [0, 0, 0], [25, 25, 22])
    for k in range(3):
        level.quad("lamp", [2 * k - 2.2, 2.98, -2], [0.3, 0, 0], [0, 0, 4])
    return level


def rooms(rng):
    """Six rooms without doors, each with a panel or a lamp."""
    level = Level(rng, (0.3, 0.8))
    level.material("lamp", [0, 0, 0], [18, 16, 14])
    for i in range(6):
        x, z = 4.4 * (i % 3), 4.4 * (i // 3)
        level.box(level.some(), [x, 1.4, z], [4, 2.8, 4], inward=True)
        for _ in range(4):
            level.box(level.some(), [x + rng.uniform(-1.4, 1.4), 0.45, z + rng.uniform(-1.4, 1.4)], rng.uniform(0.3, 0.9, 3))
        if rng.random() < 0.7:
            level.quad("lamp", [x - 0.3, 2.79, z - 0.3], [0.6, 0, 0], [0, 0, 0.6])
        else:
            level.light("point", [x, 2.2, z], color=[1.0, 0.8, 0.6], intensity=8.0)
    return level


def canopy(rng):
    """Sun and sky through a loose roof of plates and two-sided cards on posts."""
    level = Level(rng, (0.2, 0.6), BLUE_SKY)
    level.material("card", [0.3, 0.5, 0.2], double_sided=True)
    level.quad("m0", [-8, 0, -8], [0, 0, 16], [16, 0, 0])
    for _ in range(120):
        turn, at = rotation(rng), rng.uniform([-6, 2.5, -6], [6, 5, 6])
        if rng.random() < 0.5:
            level.box(level.some(), at, [0.8, 0.02, 0.5], turn)
        else:
            level.quad("card", at, turn @ [0.8, 0, 0], turn @ [0, 0.5, 0])
    for _ in range(10):
        x, z = rng.uniform(-6, 6, 2)
        level.box("m4", [x, 1.5, z], [0.25, 3, 0.25])
    level.light("directional", None, [rng.uniform(-0.6, 0.6), -1, 0.3], intensity=5.0, **SUN)
    return level


def spots(rng):
    """Sixty spot lights of 1 to 300 W/sr in a hall with boxes."""
    level = Level(rng, (0.1, 0.9))
    level.room([14, 5, 14])
    for _ in range(16):
        level.box(level.some(), [rng.uniform(-6, 6), 1.05, rng.uniform(-6, 6)], rng.uniform(0.5, 2, 3))
    for _ in range(60):
        level.light("spot", rng.uniform([-6.5, 3, -6.5], [6.5, 4.9, 6.5]), rng.normal(size=3) - [0, 1.5, 0], color=rng.uniform(0.3, 1, 3).tolist(),
                    intensity=float(10 ** rng.uniform(0, 2.5)), spot={"innerConeAngle": 0.1, "outerConeAngle": float(rng.uniform(0.2, 0.8))})
    return level


def tubes(rng):
    """Thin red and green tubes among spheres."""
    level = Level(rng, (0.3, 0.8))
    level.room([8, 4, 8])
    for name, emission in (("red", [70, 5, 10]), ("green", [1, 60, 20])):
        level.material(name, [0, 0, 0], emission)
        for _ in range(7):
            level.box(name, rng.uniform([-3.4, 0.6, -3.4], [3.4, 3.4, 3.4]), [0.015, 0.015, 1.0], rotation(rng))
    for _ in range(8):
        level.sphere(level.some(), rng.uniform([-3, 0.7, -3], [3, 3.3, 3]), rng.uniform(0.2, 0.6))
    return level


def partitions(rng):
    """Partitions that are two triangles back to back in the same place, as old levels have them."""
    level = Level(rng, (0.3, 0.8))
    level.room([9, 2.8, 6])
    for x in (-1.5, 1.5):
        for z0, z1 in ((-3, -0.6), (0.6, 3)):
            level.quad("m1", [x, 0, z0], [0, 0, z1 - z0], [0, 2.8, 0])
            level.quad("m2", [x, 0, z0], [0, 2.8, 0], [0, 0, z1 - z0])
    for _ in range(8):
        level.box(level.some(), [rng.uniform(-4, 4), 0.45, rng.uniform(-2.5, 2.5)], rng.uniform(0.3, 0.9, 3))
    level.material("lamp", [0, 0, 0], [25, 22, 20])
    for x in (-3.3, 2.7):
        level.quad("lamp", [x, 2.79, -0.3], [0.6, 0, 0], [0, 0, 0.6])
    return level


def shade(rng):
    """Bulbs in shades that are open at the top and have a slit below: most light falls on a hundredth of the texels."""
    level = Level(rng, (0.3, 0.8))
    level.room([8, 3, 7])
    level.material("bulb", [0, 0, 0], [300, 260, 200])
    for _ in range(5):
        x, y, z = rng.uniform([-3, 1.2, -2.6], [3, 2.2, 2.6])
        level.sphere("bulb", [x, y, z], 0.04, 1)
        for side in (-0.15, 0.15):
            level.box("m3", [x + side, y, z], [0.01, 0.3, 0.3])
            level.box("m3", [x, y, z + side], [0.3, 0.3, 0.01])
        level.box("m3", [x, y - 0.15, z + 0.03], [0.3, 0.01, 0.24])
    for _ in range(8):
        level.box(level.some(), [rng.uniform(-3, 3), 0.45, rng.uniform(-2.6, 2.6)], rng.uniform(0.3, 0.9, 3))
    return level


def cove(rng):
    """Strips behind lips light the ceiling, which lights the room."""
    level = Level(rng, (0.4, 0.85))
    level.room([7, 2.8, 5])
    level.material("strip", [0, 0, 0], [60, 52, 40])
    for side in (-1, 1):
        level.box("m1", [0, 2.45, side * 2.25], [7, 0.03, 0.5])
        level.box("m1", [0, 2.5, side * 2.0], [7, 0.12, 0.03])
        level.quad("strip", [-3.3, 2.48, side * 2.2 - 0.01], [0, 0, 0.02], [6.6, 0, 0])
    for _ in range(10):
        level.box(level.some(), [rng.uniform(-3, 3), 0.45, rng.uniform(-2, 2)], rng.uniform(0.3, 0.9, 3))
    return level


def gaps(rng):
    """Cupboards a finger or a hand from the walls, tables with thin tops, a carpet, pictures on the walls."""
    level = Level(rng, (0.3, 0.8))
    level.room([7, 2.7, 5])
    for _ in range(8):
        gap, x, width, height = rng.choice([0.01, 0.03, 0.08]), rng.uniform(-3, 3), rng.uniform(0.5, 1.0), rng.uniform(0.8, 2.2)
        level.box(level.some(), [x, height / 2 + 0.05, rng.choice([-1, 1]) * (2.25 - gap)], [width, height, 0.5])
    for _ in range(4):
        x, z = rng.uniform([-2.5, -1.2], [2.5, 1.2])
        level.box("m1", [x, 0.75, z], [1.2, 0.03, 0.7])
        for dx in (-0.55, 0.55):
            for dz in (-0.3, 0.3):
                level.box("m1", [x + dx, 0.37, z + dz], [0.05, 0.73, 0.05])
    level.box("m4", [0, 0.005, 0], [3, 0.01, 2])
    for k in range(5):
        level.box(level.some(), [1.3 * k - 3, 1.6, 2.49], [0.6, 0.4, 0.02])
    level.material("lamp", [0, 0, 0], [40, 36, 30])
    level.sphere("lamp", [0.5, 2.3, 0.2], 0.12)
    level.light("spot", [-2.5, 2.6, -1], [0.2, -1, 0.1], color=[1.0, 0.9, 0.8], intensity=60.0, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.6})
    return level


def terrain(rng):
    """Hills, rough trees and a hut with a door under sun and sky."""
    level = Level(rng, (0.1, 0.5), BLUE_SKY)
    height = lambda x, z: 2 * math.sin(0.13 * x + 1) * math.cos(0.11 * z) + 0.7 * math.sin(0.5 * x) * math.sin(0.43 * z)
    place = lambda x, z: np.array([x, height(x, z), z])
    rise = lambda x, z: unit(np.cross(place(x, z + 0.05) - place(x, z - 0.05), place(x + 0.05, z) - place(x - 0.05, z)))
    for x in np.arange(-30, 30, 1.5):
        for z in np.arange(-30, 30, 1.5):
            a, b, c, d = (x, z), (x, z + 1.5), (x + 1.5, z + 1.5), (x + 1.5, z)
            for corners in ((a, b, c), (a, c, d)):
                level.triangle("m0", np.array([place(*p) for p in corners]), [rise(*p) for p in corners])
    for _ in range(25):
        (x, z), radius = rng.uniform(-27, 27, 2), rng.uniform(0.8, 2)
        level.box("m4", [x, height(x, z) + 1.2, z], [0.3, 3, 0.3])
        level.sphere("m5", [x, height(x, z) + 2.6 + 0.8 * radius, z], radius, 2, 0.12)
    floor = height(5, 5) + 0.3
    for dx, dz, size in ((2, 0, (0.2, 3, 4)), (-2, 0, (0.2, 3, 4)), (0, -2, (4, 3, 0.2)), (-0.8, 2, (2.4, 3, 0.2))):
        level.box("m2", [5 + dx, floor + 1.2, 5 + dz], size)
    level.box("m3", [5, floor + 2.8, 5], [4.6, 0.2, 4.6])
    level.light("directional", None, [0.5, -0.7, 0.3], intensity=5.0, **SUN)
    return level


def sconces(rng):
    """Bare lamps two centimetres from walls, and a candle on a table."""
    level = Level(rng, (0.3, 0.8))
    level.room([8, 3, 6])
    for _ in range(6):
        x, side = rng.uniform(-3.5, 3.5), rng.choice([-1, 1])
        level.light("point", [x, 1.8, side * 2.98], color=[1.0, 0.7, 0.4], intensity=0.8)
        level.box("m2", [x, 1.6, side * 2.95], [0.2, 0.02, 0.1])
    level.box("m1", [0, 0.72, 0], [1.5, 0.05, 0.8])
    level.light("point", [0, 0.765, 0], color=[1.0, 0.8, 0.5], intensity=1.0)
    for _ in range(6):
        level.box(level.some(), [rng.uniform(-3, 3), 0.35, rng.uniform(-2, 2)], rng.uniform(0.3, 0.7, 3))
    return level


def neon(rng):
    """Pure red and pure blue light on two sides of a partition."""
    level = Level(rng, (0.05, 0.5))
    level.room([8, 3, 8])
    level.material("blue", [0, 0, 0], [0, 0, 60])
    level.material("red", [0, 0, 0], [50, 0, 0])
    level.box("m1", [0, 1.5, -1.2], [0.1, 3, 5.6])
    level.quad("blue", [-3, 2.98, -1], [1, 0, 0], [0, 0, 0.1])
    level.quad("red", [2, 2.98, 1], [1, 0, 0], [0, 0, 0.1])
    for _ in range(10):
        level.box(level.some(), [rng.uniform(-3.5, 3.5), 0.45, rng.uniform(-3.5, 3.5)], rng.uniform(0.3, 0.9, 3))
    return level


def tower(rng):
    """A shaft of 18 m with small windows and steps, under sun and sky."""
    level = Level(rng, (0.3, 0.7), BLUE_SKY)
    height = 18
    for side in (-1, 1):
        level.box("m1", [side * 2.6, height / 2, 0], [0.2, height, 5.4])
    level.box("m2", [0, height / 2, -2.6], [5, height, 0.2])
    for y in (-0.1, height + 0.1):
        level.box("m0", [0, y, 0], [5.4, 0.2, 5.4])
    windows = np.arange(2, height - 1, 3)
    for low, high in zip([0, *(windows + 0.5)], [*windows, height]):
        level.box("m2", [0, (low + high) / 2, 2.6], [5, high - low, 0.2])
    for y in windows:
        for side in (-1, 1):
            level.box("m2", [side * 1.4, y + 0.25, 2.6], [2.2, 0.5, 0.2])
    for k in range(30):
        level.box("m3", [1.7 * math.cos(0.6 * k), 0.5 + 0.55 * k, 1.7 * math.sin(0.6 * k)], [1.2, 0.1, 1.2])
    level.light("directional", None, [rng.uniform(-0.4, 0.4), -0.7, -0.8], intensity=6.0, **SUN)
    return level


# Texels per metre, so that each has 10,000 to 30,000.
KINDS = {clutter: 6, bright: 10, doorway: 9, cave: 6, night: 2.5, shelves: 8, rooms: 7, canopy: 7, spots: 5, tubes: 6, partitions: 8, shade: 7, cove: 8, gaps: 9,
         terrain: 1.2, sconces: 8, neon: 8, tower: 5}
