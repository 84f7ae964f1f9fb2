#!/usr/bin/python3
"""Time against error on the scenes of ../shared/reference and of scenes/: bakewell at several budgets, its own path tracer, and Blender's Cycles.

converge.py [--quick] [--scenes cornell office manylights sunlit level] [--out FOLDER]

Per row: CPU seconds, rays, relRMSE (against noise: the cross measure of two reference halves), p95, bias. Then the CPU seconds
that each needs to reach 10, 5, 3, 2 and 1 % (interpolated on the log-log curve; beyond the curve's end along a slope of -1/2,
marked ~), the ratios, and the z-test of the path tracer against the reference. Cycles bakes the same texels in the same session
(Debian package blender; left out with a remark where it is not installed). Writes table.md, results.json and plots (where matplotlib
is installed). BAKEWELL_PROGRAM names another program than build/release/bin/bakewell."""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import OpenImageIO as oiio

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
REFERENCE = os.path.join(ROOT, "..", "shared", "reference")
OWN_SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scenes")
SCENES = ("cornell", "office", "manylights", "sunlit", "level")
PROGRAM = os.path.join(ROOT, "build", "release", "bin", "bakewell")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
LARGE_PAGE = 256 * 256  # texels; --quick makes do with the first rows of larger ones
TARGETS = (0.10, 0.05, 0.03, 0.02, 0.01)


def load(path):
    pixels = oiio.ImageBuf(path).get_pixels(oiio.FLOAT)
    if pixels is None or pixels.size == 0:
        sys.exit("cannot read " + path)
    return pixels.astype(np.float64)


class Scene:
    def __init__(self, name):
        self.name = name
        if os.path.exists(os.path.join(OWN_SCENES, name + ".glb")):
            at = lambda ending: os.path.join(OWN_SCENES, name + ending)
            self.level, self.mask = at(".glb"), load(at("_mask.png"))[..., 0] > 0.99
            self.a, self.b = self.luminance(at("_A.exr")), self.luminance(at("_B.exr"))
            self.mean = (self.a + self.b) / 2
            return
        at = lambda *parts: os.path.join(REFERENCE, *parts)
        self.level = at("scenes", name + ".glb")
        self.mask = (load(at("masks", name + ".png"))[..., 0] > 0.99) & (load(at("masks", name + "_backface.exr"))[..., 0] < 0.02)
        self.mean, self.a, self.b = [self.luminance(at("reference", name + suffix + ".exr")) for suffix in ("", "_A", "_B")]

    @staticmethod
    def luminance(path):
        return load(path)[..., :3] @ LUMINANCE

    def figures(self, path):
        value = (load(path)[..., :3] @ LUMINANCE)[self.mask]
        a, b, mean = self.a[self.mask], self.b[self.mask], self.mean[self.mask]
        m = mean.mean()
        return {
            "relRMSE": math.sqrt(max(((value - a) * (value - b)).mean(), 0)) / m,
            "p95": float(np.percentile(np.abs(value - mean) / (mean + 0.01 * m), 95)),
            "bias": float(value.mean() / m - 1),
        }

    def covered(self, folder):
        """The shares of charts, of those with 16 texels or more that are measured, whose error is below the bound that the bake states, and
        whose error is not above it by more than two standard errors of the cross measure (the reference's noise over a chart of some
        hundred texels is several per cent of its mean)."""
        pixels = load(os.path.join(folder, "lightmap-0.irradiance.exr"))
        value, inside = pixels[..., :3] @ LUMINANCE, []
        with open(os.path.join(folder, "lightmap-0.charts.json"), encoding="utf-8") as file:
            charts = json.load(file)["charts"]
        label = components(pixels[..., 3] > 0)
        for chart in charts:
            box = np.s_[chart["y0"]:chart["y1"], chart["x0"]:chart["x1"]]
            # Rectangles overlap; a chart is the component that touches its rectangle's sides and has as many texels.
            for part in np.unique(label[box]):
                here = (label == part) & self.mask
                if part < 0 or (label == part).sum() != chart["texels"] or here.sum() < 16 or chart["error_bound"] is None:
                    continue
                square = ((value - self.a) * (value - self.b))[here] / self.mean[here].mean() ** 2
                excess = square.mean() - chart["error_bound"] ** 2
                inside.append((excess <= 0, excess <= 2 * square.std() / math.sqrt(square.size)))
        return [float(share) for share in np.mean(inside, axis=0)] if inside else None

    def z_test(self, folder):
        """z-scores of a path-traced reference against the other, over blocks of 8 x 8 texels. The other's standard error comes from two
        halves, one degree of freedom a texel (a quotient by it has a median square of 1, not 0.455), and single texels of a path
        tracer have heavy tails; sums over a block have neither trouble."""
        value = load(os.path.join(folder, "reference-0.irradiance.exr"))[..., :3] @ LUMINANCE
        error = load(os.path.join(folder, "reference-0.stderr.exr"))[..., 0]
        count = self.blocks(np.ones(value.shape))
        full = count >= 0.5 * count.max()
        variance = self.blocks((self.a - self.b) ** 2 / 4 + error ** 2)[full]
        z = self.blocks(value - self.mean)[full][variance > 0] / np.sqrt(variance[variance > 0])
        return {"blocks": int(z.size), "median_z2": float(np.median(z ** 2)), "mean_z2": float((z ** 2).mean()), "beyond_3": float((np.abs(z) > 3).mean())}

    def blocks(self, value, side=8):
        """Sums of `value` over the measured texels of each block."""
        height, width = value.shape
        return np.where(self.mask, value, 0).reshape(height // side, side, width // side, side).sum((1, 3))


def components(covered):
    """Numbers of the eight-connected parts of a mask, -1 outside."""
    label = np.where(covered, np.arange(covered.size).reshape(covered.shape), -1)
    while True:
        grown, padded = label, np.pad(label, 1, constant_values=-1)
        for dy in range(3):
            for dx in range(3):
                grown = np.maximum(grown, padded[dy:dy + label.shape[0], dx:dx + label.shape[1]])
        grown = np.where(covered, grown, -1)
        if (grown == label).all():
            return label
        label = grown


def run(command, level, folder, options):
    done = bakewell(command, level, "-o", folder, "--uv", "keep", *options)
    return {"cpu_s": sum(phase["cpu_seconds"] for phase in done["phases"]), "rays": done["rays"], "estimated": done["estimated_error"]}


def bakewell(*words):
    """Runs the program; what it says when it is done (the last line of --json)."""
    words = [os.environ.get("BAKEWELL_PROGRAM", PROGRAM), *words, "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(" ".join(words) + "\n" + done.stdout[-2000:] + done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def statistics_of(folder):
    with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as file:
        return json.load(file)["statistics"]


def measure(scene, label, command, options, keep=None):
    with tempfile.TemporaryDirectory() as temporary:
        folder = keep or temporary
        row = {"scene": scene.name, "who": label, **run(command, scene.level, folder, options)}
        image = "lightmap-0.irradiance.exr" if command == "bake" else "reference-0.irradiance.exr"
        row.update(scene.figures(os.path.join(folder, image)))
        if command == "reference":
            row["z"] = scene.z_test(folder)
        else:
            row["covered"] = scene.covered(folder)
    print(format_row(row), flush=True)
    return row


def run_cycles(script, level, bakes):
    """Cycles' bakes of a level, [(samples a texel, seed, file)]. Returns the CPU seconds of each, without Blender's start."""
    with tempfile.TemporaryDirectory() as folder:
        job = {"glb": level, "threads": 2, "camera": None, "log": os.path.join(folder, "log"),
               "bakes": [{"spp": n, "seed": seed, "out": path} for n, seed, path in bakes]}
        with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as file:
            json.dump(job, file)
        words = ["blender", "-b", "--factory-startup", "--python", script, "--", file.name]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if not os.path.exists(job["log"]):
            sys.exit(" ".join(words) + "\n" + done.stdout + done.stderr)
        with open(job["log"], encoding="utf-8") as file:
            return [json.loads(line)["cpu_s"] for line in file]


def bake_with_cycles(scene, counts):
    if shutil.which("blender") is None:
        print("no rows of Cycles: install the package blender", flush=True)
        return []
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        out = [os.path.join(folder, f"{n}.exr") for n in counts]
        seconds = run_cycles(os.path.join(REFERENCE, "cycles_bake.py"), scene.level, [(n, 1001, path) for n, path in zip(counts, out)])
        for n, path, cpu in zip(counts, out, seconds):
            rows.append({"scene": scene.name, "who": f"Cycles {n} spp", "cpu_s": cpu, "rays": None, "estimated": None, **scene.figures(path)})
            print(format_row(rows[-1]), flush=True)
    return rows


def examine_cornell():
    """cornell against Cycles without light sampling: whose are the 0.35 % by which everybody is above the reference?"""
    scene = Scene("cornell")
    texels = scene.mask.sum()
    with tempfile.TemporaryDirectory() as folder:
        halves = [os.path.join(folder, name) for name in ("a.exr", "b.exr")]
        run_cycles(os.path.join(os.path.dirname(os.path.abspath(__file__)), "cycles_path_hits.py"), scene.level, [(4096, seed, path) for seed, path in zip((7, 8), halves)])
        a, b = [load(path)[..., :3] @ LUMINANCE for path in halves]
        noise = np.sqrt(((a - b) ** 2 / 4)[scene.mask].mean() / texels) / scene.mean[scene.mask].mean()
        print(f"Cycles, path hits only, against the reference: {100 * (((a + b) / 2)[scene.mask].mean() / scene.mean[scene.mask].mean() - 1):+.2f} % +- {100 * noise:.2f} %")
        scene.a, scene.b, scene.mean = a, b, (a + b) / 2
        run("bake", scene.level, folder, ["--quality", "high"])
        print(f"bakewell high against Cycles, path hits only: {100 * scene.figures(os.path.join(folder, 'lightmap-0.irradiance.exr'))['bias']:+.2f} %")
        run("reference", scene.level, folder, ["--spp", "1024"])
        print("path tracer against Cycles, path hits only:", scene.z_test(folder))


def format_row(r):
    rays = "" if r["rays"] is None else f"{r['rays'] / 1e6:.1f}"
    estimated = "" if r["estimated"] is None else f"{100 * r['estimated']:.2f}"
    covered = "" if r.get("covered") is None else " / ".join(f"{100 * share:.0f}" for share in r["covered"])
    return (f"| {r['scene']} | {r['who']} | {r['cpu_s']:.2f} | {rays} | {100 * r['relRMSE']:.2f} | "
            f"{100 * r['p95']:.1f} | {100 * r['bias']:+.2f} | {estimated} | {covered} |")


def seconds_to(rows, target):
    """CPU seconds to an error on a curve of rows, and whether that lies outside it."""
    points = sorted((r["cpu_s"], r["relRMSE"]) for r in rows)
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e0 >= target >= e1 and e0 > e1:
            share = math.log(e0 / target) / math.log(e0 / e1)
            return t0 * (t1 / t0) ** share, False
    t, e = points[-1] if points[-1][1] > target else points[0]
    return t * (e / target) ** 2, True


def slope(rows):
    points = np.array([(math.log(r["rays"]), math.log(r["relRMSE"])) for r in rows])
    return float(np.polyfit(points[:, 0], points[:, 1], 1)[0])


def budgets(counts):
    """Fixed sample counts, photons growing with them, so that the curve shows the estimator and not the stopping rule."""
    return [(f"bakewell N={n}", "bake", ["--target-error", "1e-9", "--samples", str(n), "--photons", str(4000 * n)]) for n in counts]


def bench_scene(name, quick):
    scene = Scene(name)
    large = scene.mask.size > LARGE_PAGE
    shorter = lambda rows: (rows[:-1] if quick else rows)[:1 if quick and large else None]
    fixed = [measure(scene, *budget) for budget in budgets([16, 64] if quick and large else [4, 16, 64, 256] if quick else [4, 8, 16, 32, 64, 128, 256, 512, 1024])]
    qualities = [measure(scene, f"bakewell {q}", "bake", ["--quality", q]) for q in (["preview"] if quick and large else ["preview", "medium", "high"])]
    if not (quick and large):
        qualities.insert(2, measure(scene, "bakewell, 2 % asked", "bake", ["--target-error", "0.02"]))
    paths = [measure(scene, f"reference {n} spp", "reference", ["--spp", str(n)]) for n in shorter([64, 256, 1024])]
    cycles = bake_with_cycles(scene, shorter([16, 64, 256]))
    return {"fixed": fixed, "quality": qualities, "reference": paths, "cycles": cycles}


def table(results):
    lines = ["| scene | who | CPU s | Mrays | relRMSE % | p95 % | bias % | own estimate % | charts within bound % |", "|---|---|---|---|---|---|---|---|---|"]
    for groups in results.values():
        lines += [format_row(r) for rows in groups.values() for r in rows]
    lines += ["", "CPU seconds to an error (~: extrapolated along a slope of -1/2), and how many times more the others need than bakewell:", "",
              "| scene | error | bakewell, fixed N | bakewell, qualities | path tracer | ratio | Cycles | ratio |", "|---|---|---|---|---|---|---|---|"]
    for name, groups in results.items():
        for target in TARGETS:
            fixed, quality, paths = [seconds_to(groups[g], target) for g in ("fixed", "quality", "reference")]
            cycles = seconds_to(groups["cycles"], target) if groups["cycles"] else None
            best = min([t for t, outside in (fixed, quality) if not outside] or [quality[0]])
            text = [("~" if outside else "") + f"{t:.2f}" for t, outside in (fixed, quality, paths)]
            text.append(f"{paths[0] / best:.0f}")
            text += [("~" if cycles[1] else "") + f"{cycles[0]:.0f}", f"{cycles[0] / best:.0f}"] if cycles else ["", ""]
            lines.append(f"| {name} | {100 * target:.0f} % | " + " | ".join(text) + " |")
    lines += ["", "Slope of log error over log rays at fixed N (-0.5 is Monte Carlo), and the path tracer's z-scores against the reference over blocks of 8 x 8 texels "
              "(where both standard errors are right: median of z^2 0.455, mean 1, beyond 3 0.27 %):", "",
              "| scene | slope | blocks | median z^2 | mean z^2 | beyond 3 |", "|---|---|---|---|---|---|"]
    for name, groups in results.items():
        z = groups["reference"][-1]["z"]
        lines.append(f"| {name} | {slope(groups['fixed']):.2f} | {z['blocks']} | {z['median_z2']:.3f} | {z['mean_z2']:.3f} | {100 * z['beyond_3']:.2f} % |")
    return "\n".join(lines) + "\n"


def plot(results, folder):
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError:
        print("no plots: python3-matplotlib is not installed")
        return
    figure, axes = plt.subplots(1, len(results), figsize=(5 * len(results), 4), squeeze=False)
    for axis, (name, groups) in zip(axes[0], results.items()):
        for label, group in (("bakewell, fixed N", "fixed"), ("bakewell, qualities", "quality"), ("path tracer", "reference"), ("Cycles", "cycles")):
            rows = groups[group]
            axis.loglog([r["cpu_s"] for r in rows], [r["relRMSE"] for r in rows], "o-", label=label)
        axis.set(title=name, xlabel="CPU seconds", ylabel="relRMSE (cross)")
        axis.grid(True, which="both", alpha=0.3)
        axis.legend()
    figure.tight_layout()
    figure.savefig(os.path.join(folder, "converge.png"), dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer budgets, some minutes in all")
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--path-hits", action="store_true", help="only: Cycles on cornell without light sampling, to see its own bias")
    parser.add_argument("--out", default=os.path.join(ROOT, "build", "bench", "converge"))
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    if arguments.path_hits:
        examine_cornell()
        return
    results = {name: bench_scene(name, arguments.quick) for name in arguments.scenes}
    text = table(results)
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False).stdout.strip()
    with open(os.path.join(arguments.out, "table.md"), "w", encoding="utf-8") as file:
        file.write(f"Commit {commit}, {os.cpu_count()} threads, seed 0.\n\n" + text)
    with open(os.path.join(arguments.out, "results.json"), "w", encoding="utf-8") as file:
        json.dump({"commit": commit, "results": results}, file, indent=1)
    plot(results, arguments.out)
    print(text + "\nwritten to " + arguments.out)


if __name__ == "__main__":
    main()
