"""Levels of any size: k x k rooms of 8 x 8 m with doors between them, a window to the sky, a lamp and boxes in each; every face a grid of n x n quads that
swell by up to 2 cm."""
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "converge", "scenes"))
import mesh as scene_mesh  # noqa: E402

X, Y, Z = np.eye(3)
SIDE, HEIGHT, THICK = 8.0, 3.0, 0.1


class GridMesh(scene_mesh.Mesh):
    """A mesh whose faces are grids of quads that share their corners; every piece of a face with holes has a chart of its own."""

    def __init__(self, page, texels_per_metre, quads):
        super().__init__("level", page, texels_per_metre)
        self.quads, self.grids = quads, []

    def face(self, origin, u, v, material, holes=()):
        if material is None:
            return
        size = [scene_mesh.length(u), scene_mesh.length(v)]
        s, t = [scene_mesh.cuts(size[axis], [h[2 * axis + k] for h in holes for k in (0, 1)], np.inf) for axis in (0, 1)]
        for s0, s1 in zip(s, s[1:]):
            for t0, t1 in zip(t, t[1:]):
                if any(h[0] < (s0 + s1) / 2 < h[1] and h[2] < (t0 + t1) / 2 < h[3] for h in holes):
                    continue
                self.chart((s1 - s0, t1 - t0))
                self.grids.append((origin + u * (s0 / size[0]) + v * (t0 / size[1]), u * ((s1 - s0) / size[0]), v * ((t1 - t0) / size[1])))

    def pack(self):
        turned = [chart["size"][1] > chart["size"][0] for chart in self.charts]
        return super().pack(), turned

    def write(self, path):
        corner, turned = self.pack()
        n = self.quads
        i, k = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n)
        s, t = i.ravel()[:, None], k.ravel()[:, None]
        swell = 0.02 * np.sin(np.pi * s) * np.sin(np.pi * t) * np.sin(9 * np.pi * s + 5 * np.pi * t)
        first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
        grid = (first + np.array([0, 1, n + 2, 0, n + 2, n + 1])).ravel()
        position, uv, index = [], [], []
        for g, (origin, u, v) in enumerate(self.grids):
            normal = np.cross(u, v)
            w, h = self.charts[g]["size"]
            a, b = (t, s) if turned[g] else (s, t)
            position.append(origin + s * u + t * v + swell * normal / scene_mesh.length(normal))
            uv.append(np.concatenate([corner[g][0] + a * w, corner[g][1] + b * h], 1) / self.page)
            index.append(grid + g * (n + 1) ** 2)
        arrays = [np.concatenate(position).astype(np.float32), np.concatenate(uv).astype(np.float32), np.concatenate(index).astype(np.uint32)]
        accessors = [{"bufferView": i, "componentType": kind, "count": a.shape[0], "type": name}
                     for i, (a, kind, name) in enumerate(zip(arrays, (5126, 5126, 5125), ("VEC3", "VEC2", "SCALAR")))]
        accessors[0].update(min=arrays[0].min(0).tolist(), max=arrays[0].max(0).tolist())
        nodes = [{"mesh": 0, "name": "level", "extras": {"lightmapped": True}}] + [node for node, _ in self.lights]
        environment = {"type": "gradient", "zenith": [0.3, 0.5, 1.0], "horizon": [0.9, 0.95, 1.0], "ground": [0.1, 0.1, 0.1]}
        scene_mesh.write_glb(path, {
            "asset": {"version": "2.0"}, "scene": 0, "nodes": nodes, "accessors": accessors,
            "scenes": [{"nodes": list(range(len(nodes))), "extras": {"environment": environment, "lightmap": {"width": self.page, "height": self.page}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_1": 1}, "indices": 2, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.58, 0.55, 1], "metallicFactor": 0}}],
            "extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": [light for _, light in self.lights]}}},
            [(a.tobytes(), None) for a in arrays])
        return sum(len(x) for x in index) // 3


def make(path, rooms=2, quads=1, texels_per_metre=4.0, page=256):
    """Writes a level of rooms x rooms rooms, 2 quads^2 triangles a face. Returns the number of triangles. The page must hold the charts."""
    rng = np.random.default_rng(3)
    level = GridMesh(page, texels_per_metre, quads)
    whole = rooms * SIDE
    for i in range(rooms):
        for k in range(rooms):
            x, z = i * SIDE, k * SIDE
            level.face(np.array([x, 0, z + SIDE]), SIDE * X, -SIDE * Z, "any")
            level.face(np.array([x, HEIGHT, z]), SIDE * X, SIDE * Z, "any", [(3, 5, 3, 4)])
            for side in range(4):
                foot = np.array([x + rng.uniform(1.5, 6.5), -0.02, z + rng.uniform(1.5, 6.5)])
                level.box(foot, rng.uniform(0.4, 1.2, 3), rng.uniform(0, 3), "any")
            level.light("point", np.array([x + 4, 2.5, z + 4]), intensity=float(rng.uniform(2, 6)), color=rng.uniform(0.6, 1, 3).tolist())
    for line in range(rooms + 1):
        inner = 0 < line < rooms
        for k in range(rooms):
            door = [(3.4, 4.6, 0, 2.1)] if inner else []
            level.plate(np.array([line * SIDE, -0.02, k * SIDE]), SIDE * Z, (HEIGHT + 0.04) * Y, THICK, "any", holes=door, rims="")
            level.plate(np.array([k * SIDE, -0.02, line * SIDE]), SIDE * X, (HEIGHT + 0.04) * Y, THICK, "any", holes=door, rims="")
    level.light("directional", direction=np.array([-0.3, -0.9, -0.35]), intensity=4.0, extras={"angularDiameterDeg": 0.53})
    return level.write(path)
