"""Meshes whose rectangular faces are lightmap charts, and their glTF. Metres, +Y up, one atlas page, row 0 is v = 0.

A face (origin, u, v) is the parallelogram origin + s u + t v; its front is the side that u x v points to. Its chart is a whole number of
texels, so that its borders are texel borders; charts are two texels apart."""
import json
import math
import struct
import zlib

import numpy as np

GUTTER = 2
LONGEST_EDGE_M = 3.0


def vec(*a):
    return np.array(a, float)


def length(a):
    return float(np.linalg.norm(a))


def unit(a):
    return np.asarray(a, float) / length(a)


class Mesh:
    def __init__(self, name, page, texels_per_metre):
        self.name, self.page, self.texels_per_metre = name, page, texels_per_metre
        self.charts = []     # {"size": (w, h), "quads": [(corners 4x3, texels 4x2, material)]}
        self.occluders = []  # (corners 4x3, uv0 4x2, material)
        self.lights = []     # glTF nodes and lights, in pairs

    def chart(self, size_m):
        size = tuple(max(1, round(s * self.texels_per_metre)) for s in size_m)
        self.charts.append({"size": size, "quads": []})
        return self.charts[-1]

    def face(self, origin, u, v, material, holes=()):
        """A rectangle with holes [(s0, s1, t0, t1)] in metres along u and v. Material None: no face. Names with a leading '_': an
        occluder, without a chart."""
        if material is None:
            return
        size_m = length(u), length(v)
        chart = None if material.startswith("_") else self.chart(size_m)
        longest = LONGEST_EDGE_M if chart else math.inf
        s, t = [cuts(size_m[axis], [h[2 * axis + k] for h in holes for k in (0, 1)], longest) for axis in (0, 1)]
        for s0, s1 in zip(s, s[1:]):
            for t0, t1 in zip(t, t[1:]):
                middle = (s0 + s1) / 2, (t0 + t1) / 2
                if any(h[0] < middle[0] < h[1] and h[2] < middle[1] < h[3] for h in holes):
                    continue
                at = np.array([(s0, t0), (s1, t0), (s1, t1), (s0, t1)]) / size_m
                corners = origin + at[:, :1] * u + at[:, 1:] * v
                if chart:
                    chart["quads"].append((corners, at * chart["size"], material))
                else:
                    self.occluders.append((corners, at, material))

    def triangle(self, a, b, c, material):
        """A triangle with a chart of its own; its longest edge, ab, lies on a texel border."""
        x = unit(b - a)
        foot = float(np.dot(c - a, x))
        size_m = length(b - a), length(c - a - foot * x)
        at = np.array([(0, 0), (1, 0), (foot / size_m[0], 1), (foot / size_m[0], 1)])
        if material.startswith("_"):
            self.occluders.append((np.array([a, b, c, c]), at, material))
            return
        chart = self.chart(size_m)
        chart["quads"].append((np.array([a, b, c, c]), at * chart["size"], material))

    def plate(self, origin, u, v, thickness, front, back=None, rim=None, holes=(), rims="lrbt"):
        """A wall or a slab around the rectangle (origin, u, v): a front, a back, the jambs of its holes (where they do not end at its border) and those rims
        (left, right: at the ends of u; bottom, top: of v) that are not buried in something."""
        back, rim = back or front, rim or front
        x, y = unit(u), unit(v)
        n = thickness * np.cross(x, y)
        low = origin - n / 2
        across = [(length(u) - h[1], length(u) - h[0], h[2], h[3]) for h in holes]
        self.face(low + n, u, v, front, holes)
        self.face(low + u, -u, v, back, across)
        sides = {"l": (low, n, v), "r": (low + u, v, n), "b": (low, u, n), "t": (low + v, n, u)}
        for side in rims:
            self.face(*sides[side], rim)
        for s0, s1, t0, t1 in holes:
            p, du, dv = low + x * s0 + y * t0, x * (s1 - s0), y * (t1 - t0)
            if s0 > 0:
                self.face(p, dv, n, rim)
            if s1 < length(u):
                self.face(p + du, n, dv, rim)
            if t0 > 0:
                self.face(p, n, du, rim)
            if t1 < length(v):
                self.face(p + dv, du, n, rim)

    def box(self, foot, size, yaw, material, top=None, bottom=None):
        """A box that stands on `foot`, the middle of its lower face, turned about the vertical."""
        x, z = vec(math.cos(yaw), 0, -math.sin(yaw)) * size[0], vec(math.sin(yaw), 0, math.cos(yaw)) * size[2]
        y, low = vec(0, size[1], 0), foot - x / 2 - z / 2
        self.face(low + z, x, y, material)
        self.face(low + x, -x, y, material)
        self.face(low, z, y, material)
        self.face(low + x + z, -z, y, material)
        self.face(low + y + z, x, -z, top or material)
        self.face(low, x, z, bottom)

    def column(self, foot, radius, height, material, sides=8):
        corners = [foot + radius * vec(math.cos(a), 0, -math.sin(a)) for a in 2 * math.pi * (np.arange(sides) + 0.5) / sides]
        for a, b in zip(corners, corners[1:] + corners[:1]):
            self.face(a, b - a, vec(0, height, 0), material)

    def light(self, kind, position=None, direction=None, **light):
        node = {"name": f"{kind}{len(self.lights)}", "extensions": {"KHR_lights_punctual": {"light": len(self.lights)}}}
        if position is not None:
            node["translation"] = [float(x) for x in position]
        if direction is not None:
            node["rotation"] = rotation_from_minus_z(unit(direction))
        self.lights.append((node, {"type": kind, "name": node["name"], **light}))

    def pack(self):
        """Tallest first, each as low as it can lie. Returns each chart's corner; fails where the page is too small."""
        for chart in self.charts:
            w, h = chart["size"]
            if h > w:
                chart["size"] = (h, w)
                chart["quads"] = [(c, t[:, ::-1], m) for c, t, m in chart["quads"]]
        order = sorted(range(len(self.charts)), key=lambda i: (-self.charts[i]["size"][1], -self.charts[i]["size"][0], i))
        filled, corner = np.full(self.page - GUTTER, GUTTER), {}
        for i in order:
            w, h = [side + GUTTER for side in self.charts[i]["size"]]
            rows = np.lib.stride_tricks.sliding_window_view(filled, w).max(1)
            x = int(rows.argmin())
            corner[i] = (x + GUTTER, int(rows[x]))
            filled[x:x + w] = rows[x] + h
        if filled.max() > self.page:
            raise SystemExit(f"{self.name}: the charts need {filled.max()} rows of {self.page}")
        return corner

    def write(self, path, materials, environment, camera, leaves=None):
        """materials: name -> {"albedo": rgb, "emission": rgb or none, "leaves": True for the masked texture}."""
        corner = self.pack()
        names = sorted(materials)
        lit, shade = {}, {}
        for i, chart in enumerate(self.charts):
            for corners, texels, material in chart["quads"]:
                lit.setdefault(material, []).append((corners, texels / self.page, (texels + corner[i]) / self.page))
        for corners, at, material in self.occluders:
            shade.setdefault(material, []).append((corners, at, None))
        gltf, chunks = {"accessors": []}, []

        def accessor(values, kind, component, target):
            a = {"bufferView": len(chunks), "componentType": component, "count": len(values), "type": kind}
            if kind == "VEC3":
                a["min"], a["max"] = values.min(0).tolist(), values.max(0).tolist()
            chunks.append((values.tobytes(), target))
            gltf["accessors"].append(a)
            return len(gltf["accessors"]) - 1

        def primitive(material, quads):
            position = np.concatenate([q[0] for q in quads]).astype(np.float32)
            normal = np.concatenate([np.repeat(unit(np.cross(q[0][1] - q[0][0], q[0][2] - q[0][0]))[None], 4, 0) for q in quads]).astype(np.float32)
            index = np.concatenate([4 * i + np.array([0, 1, 2] if same(q[0][2], q[0][3]) else [0, 1, 2, 0, 2, 3]) for i, q in enumerate(quads)]).astype(np.uint32)
            attributes = {"POSITION": accessor(position, "VEC3", 5126, 34962), "NORMAL": accessor(normal, "VEC3", 5126, 34962),
                          "TEXCOORD_0": accessor(np.concatenate([q[1] for q in quads]).astype(np.float32), "VEC2", 5126, 34962)}
            if quads[0][2] is not None:
                attributes["TEXCOORD_1"] = accessor(np.concatenate([q[2] for q in quads]).astype(np.float32), "VEC2", 5126, 34962)
            return {"attributes": attributes, "indices": accessor(index, "SCALAR", 5125, 34963), "material": names.index(material), "mode": 4}

        meshes = [{"name": name, "primitives": [primitive(m, group[m]) for m in sorted(group)]}
                  for name, group in ((self.name, lit), ("occluders", shade)) if group]
        nodes = [{"mesh": i, "name": m["name"], "extras": {"lightmapped": i == 0}} for i, m in enumerate(meshes)]
        nodes += [node for node, _ in self.lights]
        gltf.update(
            asset={"version": "2.0", "generator": "make_scenes.py", "copyright": "CC0"}, meshes=meshes, nodes=nodes, scene=0,
            materials=[gltf_material(n, materials[n]) for n in names],
            scenes=[{"name": self.name, "nodes": list(range(len(nodes))), "extras": {
                "environment": environment, "camera": camera, "licence": "CC0",
                "lightmap": {"width": self.page, "height": self.page, "texelsPerMetre": self.texels_per_metre}}}],
            extensionsUsed=["KHR_lights_punctual", "KHR_materials_emissive_strength"],
            extensions={"KHR_lights_punctual": {"lights": [light for _, light in self.lights]}})
        if leaves is not None:
            gltf.update(images=[{"bufferView": len(chunks), "mimeType": "image/png"}], textures=[{"source": 0, "sampler": 0}],
                        samplers=[{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33071}])
            chunks.append((png(leaves), None))
        write_glb(path, gltf, chunks)
        texels = sum(c["size"][0] * c["size"][1] for c in self.charts)
        triangles = [sum(a["count"] for p in m["primitives"] for a in [gltf["accessors"][p["indices"]]]) // 3 for m in meshes]
        print(f"{self.name}: triangles {triangles}, {len(self.charts)} charts, {texels} texels of {self.page ** 2}, {len(self.lights)} lights")


def same(a, b):
    return bool(np.all(a == b))


def cuts(size, inner, longest):
    """Where a side is cut: at the holes' edges, and then so that no piece is longer than `longest`."""
    edges = sorted({0.0, size, *(min(max(x, 0.0), size) for x in inner)})
    parts = [np.linspace(a, b, 1 + max(1, math.ceil((b - a) / longest)))[:-1] for a, b in zip(edges, edges[1:])]
    return [float(x) for part in parts for x in part] + [size]


def rotation_from_minus_z(d):
    """The quaternion (x, y, z, w) that turns -Z into d."""
    w = 1 - d[2]
    q = vec(1, 0, 0, 0) if w < 1e-9 else vec(d[1], -d[0], 0, w)
    return [float(x) for x in q / length(q)]


def gltf_material(name, m):
    pbr = {"baseColorFactor": [*m["albedo"], 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    out = {"name": name, "doubleSided": False, "pbrMetallicRoughness": pbr}
    if m.get("leaves"):
        pbr["baseColorTexture"] = {"index": 0}
        out.update(alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    if "emission" in m:
        strength = max(m["emission"])
        out.update(emissiveFactor=[x / strength for x in m["emission"]], extensions={"KHR_materials_emissive_strength": {"emissiveStrength": strength}})
    return out


def png(rgba):
    h, w, _ = rgba.shape
    rows = b"".join(b"\0" + row.tobytes() for row in rgba)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", w, h, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def write_glb(path, gltf, chunks):
    views, data = [], bytearray()
    for chunk, target in chunks:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(chunk), **({"target": target} if target else {})})
        data += chunk + bytes(-len(chunk) % 4)
    gltf.update(bufferViews=views, buffers=[{"byteLength": len(data)}])
    text = json.dumps(gltf, separators=(",", ":"), sort_keys=True).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<5I", 0x46546C67, 2, 28 + len(text) + len(data), len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<2I", len(data), 0x004E4942) + data)
