#!/usr/bin/python3
"""The references of this folder's scenes: two halves by Cycles (package blender) and the mask of the texels that are compared.

make_references.py [--seconds 450] [--mask-only | --add] sunlit level

Writes <scene>_A.exr, <scene>_B.exr (half-float RGB, irradiance [W/m^2]) and <scene>_mask.png: 0 uncovered, 128 covered, 192 interior (the 3 x 3
texels around it are covered), 255 interior and clean (less than 2 % of the hemisphere sees a back face first). With --add the new halves are averaged with those
that are there, weighted by the CPU seconds of each (kept in <scene>_runs.json); every run has seeds of its own."""
import argparse
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np
import OpenImageIO as oiio

HERE = os.path.dirname(os.path.abspath(__file__))
CYCLES = os.path.abspath(os.path.join(HERE, *[".."] * 5, "shared", "reference", "cycles_bake.py"))


def blender(script, job):
    with tempfile.NamedTemporaryFile("w", suffix=".json", encoding="utf-8") as file:
        json.dump({"threads": 2, "camera": None, **job}, file)
        file.flush()
        done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", script, "--", file.name], stdout=subprocess.PIPE, text=True, check=False)
    print("\n".join(line for line in done.stdout.splitlines() if line.startswith(("SAMPLES", "HALF", "GROUPS", "BACKFACE"))), flush=True)
    if done.returncode != 0:
        sys.exit(done.stdout[-4000:])


def read_glb(path):
    data = open(path, "rb").read()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + size]), data[28 + size:]


def coverage(path):
    """Texels whose centre lies in a triangle of the lightmapped mesh."""
    gltf, data = read_glb(path)
    side = gltf["scenes"][0]["extras"]["lightmap"]["width"]

    def accessor(i, kind, width):
        a = gltf["accessors"][i]
        return np.frombuffer(data, kind, a["count"] * width, gltf["bufferViews"][a["bufferView"]]["byteOffset"]).reshape(-1, width)

    covered = np.zeros((side, side), bool)
    for primitive in gltf["meshes"][0]["primitives"]:
        uv = accessor(primitive["attributes"]["TEXCOORD_1"], np.float32, 2).astype(float) * side
        for corners in uv[accessor(primitive["indices"], np.uint32, 1).reshape(-1, 3)]:
            x0, y0 = np.maximum(np.floor(corners.min(0)).astype(int), 0)
            x1, y1 = np.minimum(np.ceil(corners.max(0)).astype(int), side)
            x, y = np.meshgrid(np.arange(x0, x1) + 0.5, np.arange(y0, y1) + 0.5)
            edges = [(b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) for a, b in zip(corners, np.roll(corners, -1, 0))]
            covered[y0:y1, x0:x1] |= np.all([e >= -1e-6 for e in edges], 0) | np.all([e <= 1e-6 for e in edges], 0)
    return covered


def make_mask(name, folder):
    level = os.path.join(folder, name + ".glb")
    covered = coverage(level)
    padded = np.pad(covered, 1)
    height, width = covered.shape
    interior = np.all([padded[y:y + height, x:x + width] for y in range(3) for x in range(3)], 0)
    with tempfile.TemporaryDirectory() as scratch:
        out = os.path.join(scratch, "back.exr")
        blender(CYCLES, {"glb": level, "backface": {"spp": 64, "out": out}})
        back = oiio.ImageBuf(out).get_pixels(oiio.FLOAT)[..., 0]
    values = np.where(interior & (back < 0.02), 255, np.where(interior, 192, np.where(covered, 128, 0)))
    oiio.ImageBuf(np.ascontiguousarray(values[..., None].astype(np.uint8))).write(os.path.join(folder, name + "_mask.png"))
    print(f"{name}: {covered.sum()} covered, {interior.sum()} interior, {(values == 255).sum()} clean", flush=True)


def make_halves(name, folder, seconds, add):
    at = lambda suffix: os.path.join(folder, name + suffix)
    runs = json.load(open(at("_runs.json"), encoding="utf-8")) if add else []
    with tempfile.TemporaryDirectory() as scratch:
        new = [os.path.join(scratch, half + ".exr") for half in "AB"]
        blender(os.path.join(HERE, "cycles_reference.py"), {
            "glb": at(".glb"), "seconds": seconds, "halves": new, "first_seed": 100000 * (2 * len(runs) + 1),
            "groups": [{"spp": 1, "seed": 90, "out": os.path.join(scratch, "pilot.exr")}]})
        before = sum(run["seconds"] for run in runs)
        for path, kept in zip(new, (at("_A.exr"), at("_B.exr"))):
            image = oiio.ImageBuf(path).get_pixels(oiio.FLOAT)
            if add:
                image = (before * oiio.ImageBuf(kept).get_pixels(oiio.FLOAT) + seconds * image) / (before + seconds)
            out = oiio.ImageBuf(np.ascontiguousarray(image))
            out.set_write_format("half")
            out.specmod().attribute("compression", "zip")
            out.write(kept)
    with open(at("_runs.json"), "w", encoding="utf-8") as file:
        json.dump(runs + [{"seconds": seconds}], file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--folder", default=HERE)
    parser.add_argument("--seconds", type=float, default=450)
    parser.add_argument("--mask-only", action="store_true")
    parser.add_argument("--add", action="store_true")
    arguments = parser.parse_args()
    for name in arguments.scenes:
        if not arguments.add:
            make_mask(name, arguments.folder)
        if not arguments.mask_only:
            make_halves(name, arguments.folder, arguments.seconds, arguments.add)


if __name__ == "__main__":
    main()
