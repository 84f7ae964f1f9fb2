#!/usr/bin/python3
"""Cost and error against the number of lights: one hall with pillars under 10, 100, 1,000 and 10,000 point lights of the same flux
in all, at a fixed number of samples, against a bake of 16 times as many. Prints a Markdown table.

many_lights.py [--samples 64] [--counts 10 100 1000 10000]"""
import argparse
import base64
import json
import os
import random
import struct
import subprocess
import tempfile

import converge


def box(low, high, inward=False):
    """Corners and triangles of a box, facing outward."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    positions, indices = [], []
    for face in faces:
        first = len(positions)
        positions += [corners[i] for i in face]
        quad = [0, 2, 1, 0, 3, 2] if inward else [0, 1, 2, 0, 2, 3]
        indices += [first + i for i in quad]
    return positions, indices


def hall(count):
    """A glTF of a hall of 40 x 6 x 40 m with 16 pillars and `count` lights of random places and colours."""
    rng = random.Random(count)
    positions, indices = [], []
    parts = [box((0, 0, 0), (40, 6, 40), inward=True)]
    parts += [box((5 + 10 * i - 0.5, 0, 5 + 10 * k - 0.5), (5 + 10 * i + 0.5, 6, 5 + 10 * k + 0.5)) for i in range(4) for k in range(4)]
    for p, i in parts:
        indices += [len(positions) + k for k in i]
        positions += p
    data = b"".join(struct.pack("<3f", *p) for p in positions)
    at = len(data)
    data += struct.pack(f"<{len(indices)}I", *indices)
    lights = [{"type": "point", "intensity": 20000 / count, "color": [rng.uniform(0.5, 1) for _ in range(3)]} for _ in range(count)]
    nodes = [{"mesh": 0}] + [{"translation": [rng.uniform(0.5, 39.5), rng.uniform(2, 5.8), rng.uniform(0.5, 39.5)],
                              "extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(count)]
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(count + 1))}], "nodes": nodes,
        "extensionsUsed": ["KHR_lights_punctual"], "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3", "min": [0, 0, 0], "max": [40, 6, 40]},
                      {"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": at}, {"buffer": 0, "byteOffset": at, "byteLength": len(data) - at}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
    }


def bake(level, folder, samples):
    done = converge.bakewell("bake", level, "-o", folder, "--texels-per-metre", "2", "--no-filter",
                             "--target-error", "1e-9", "--samples", str(samples), "--photons", "500000")
    image = converge.load(os.path.join(folder, "lightmap-0.irradiance.exr"))
    gather = next(p["cpu_seconds"] for p in done["phases"] if p["phase"] == "gather")
    return gather, converge.statistics_of(folder), image


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--counts", type=int, nargs="+", default=[10, 100, 1000, 10000])
    arguments = parser.parse_args()
    print("| lights | gather CPU s | us a texel | shadow rays a texel | relRMSE % |\n|---|---|---|---|---|")
    for count in arguments.counts:
        with tempfile.TemporaryDirectory() as folder:
            level = os.path.join(folder, "hall.gltf")
            with open(level, "w", encoding="utf-8") as file:
                json.dump(hall(count), file)
            seconds, statistics, image = bake(level, os.path.join(folder, "few"), arguments.samples)
            _, _, truth = bake(level, os.path.join(folder, "many"), 16 * arguments.samples)
        covered = truth[..., 3] > 0
        a, b = image[..., :3][covered] @ converge.LUMINANCE, truth[..., :3][covered] @ converge.LUMINANCE
        texels = statistics["counters"]["texels/covered"]
        error = ((a - b) ** 2).mean() ** 0.5 / b.mean()
        print(f"| {count:,} | {seconds:.2f} | {1e6 * seconds / texels:.0f} | {statistics['counters']['gather/shadow_rays'] / texels:.0f} | {100 * error:.2f} |", flush=True)


if __name__ == "__main__":
    main()
