#!/usr/bin/python3
"""Cost against texels, triangles, size of the scene and lights: four sizes each, with the exponent of a power law through them.

scaling.py [--axes texels triangles size lights] [--samples 32] [--out FOLDER]

Bakes levels of levels.py (lights: the hall of ../converge/many_lights.py) at a fixed number of samples and photons a texel. Writes table.md, results.json and scaling.png."""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "converge"))
import converge  # noqa: E402
import levels  # noqa: E402
import many_lights  # noqa: E402

PHASES = ("load", "chart", "texels", "photons", "density", "gather", "finish", "write")


def bake(level, samples, photons_per_texel, texels_hint, options=()):
    """One row: CPU seconds by phase, rays, peak memory of the process."""
    with tempfile.TemporaryDirectory() as folder:
        done = converge.bakewell("bake", level, "-o", folder, "--target-error", "1e-9", "--samples", str(samples),
                                 "--photons", str(max(1024, int(photons_per_texel * texels_hint))), *options)
        counters = converge.statistics_of(folder)["counters"]
    return {"cpu_s": {p["phase"]: p["cpu_seconds"] for p in done["phases"]}, "texels": counters["texels/covered"], "rays": done["rays"],
            "traversed": counters["gather/rays"] + counters["gather/shadow_rays"] + counters["gather/bounce_rays"], "peak_mb": done["peak_memory_bytes"] / 2**20}


def rows_of(axis, samples):
    with tempfile.TemporaryDirectory() as folder:
        level = os.path.join(folder, "level.glb")
        if axis == "texels":
            for scale in (1, 2, 4, 8):
                density, page = 2.0 * scale, 128 * scale
                levels.make(level, rooms=2, quads=2, texels_per_metre=density, page=page)
                row = bake(level, samples, 8, 1500 * density ** 2 / 4)
                yield {"x": row["texels"], **row}
        if axis == "triangles":
            for quads in (2, 6, 20, 62):
                triangles = levels.make(level, rooms=2, quads=quads, texels_per_metre=4.0, page=256)
                row = bake(level, samples, 8, 14000)
                yield {"x": triangles, **row}
        if axis == "size":
            for rooms in (1, 2, 4, 8):
                levels.make(level, rooms=rooms, quads=2, texels_per_metre=3.0, page=64 * rooms + 64)
                row = bake(level, samples, 8, 2000 * rooms ** 2)
                yield {"x": rooms ** 2, **row}
        if axis == "lights":
            for count in (10, 100, 1000, 10000):
                hall = os.path.join(folder, "hall.gltf")
                with open(hall, "w", encoding="utf-8") as file:
                    json.dump(many_lights.hall(count), file)
                row = bake(hall, samples, 8, 20000, ["--texels-per-metre", "2", "--no-filter"])
                yield {"x": count, **row}


def cost_per_texel(row):
    return 1e6 * sum(row["cpu_s"].values()) / row["texels"]


def exponent(rows, value):
    """Of the power law through value(row) over x."""
    x, y = np.log([r["x"] for r in rows]), np.log([max(value(r), 1e-9) for r in rows])
    return float(np.polyfit(x, y, 1)[0])


def table(results):
    lines = []
    for axis, rows in results.items():
        lines += [f"| {axis} | texels | " + " | ".join(PHASES) + " | CPU s | Mrays | us a texel | peak MB |", "|---" * (len(PHASES) + 6) + "|"]
        for r in rows:
            phases = " | ".join(f"{r['cpu_s'].get(p, 0):.2f}" for p in PHASES)
            lines.append(f"| {r['x']:,} | {r['texels']:,} | {phases} | {sum(r['cpu_s'].values()):.2f} | {r['rays'] / 1e6:.1f} | {cost_per_texel(r):.0f} | {r['peak_mb']:.0f} |")
        powers = [exponent(rows, lambda r, p=p: r["cpu_s"].get(p, 0)) for p in PHASES]
        lines.append("| exponent | | " + " | ".join(f"{p:.2f}" for p in powers) + f" | {exponent(rows, lambda r: sum(r['cpu_s'].values())):.2f} | "
                     f"{exponent(rows, lambda r: r['rays']):.2f} | {exponent(rows, cost_per_texel):.2f} | {exponent(rows, lambda r: r['peak_mb']):.2f} |")
        lines.append("")
    return "\n".join(lines)


def plot(results, folder):
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError:
        print("no plot: python3-matplotlib is not installed")
        return
    figure, axes = plt.subplots(1, len(results), figsize=(4.5 * len(results), 3.6), squeeze=False)
    for axis, (name, rows) in zip(axes[0], results.items()):
        for phase in ("texels", "photons", "density", "gather", "finish"):
            axis.loglog([r["x"] for r in rows], [1e6 * max(r["cpu_s"].get(phase, 0), 1e-4) / r["texels"] for r in rows], ".-", label=phase, linewidth=1)
        axis.loglog([r["x"] for r in rows], [cost_per_texel(r) for r in rows], "ko-", label="all")
        axis.set(title=name, xlabel=name, ylabel="CPU us a texel")
        axis.grid(True, which="both", alpha=0.3)
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(os.path.join(folder, "scaling.png"), dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--axes", nargs="+", default=["texels", "triangles", "size", "lights"])
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--out", default=os.path.join(converge.ROOT, "build", "bench", "scaling"))
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    results = {}
    for axis in arguments.axes:
        results[axis] = []
        for row in rows_of(axis, arguments.samples):
            results[axis].append(row)
            print(axis, f"{row['x']:,}", f"{row['texels']:,} texels, {sum(row['cpu_s'].values()):.2f} CPU s, {row['peak_mb']:.0f} MB", flush=True)
    text = table(results)
    with open(os.path.join(arguments.out, "table.md"), "w", encoding="utf-8") as file:
        file.write(text)
    with open(os.path.join(arguments.out, "results.json"), "w", encoding="utf-8") as file:
        json.dump(results, file, indent=1)
    plot(results, arguments.out)
    print(text + "written to " + arguments.out)


if __name__ == "__main__":
    main()
