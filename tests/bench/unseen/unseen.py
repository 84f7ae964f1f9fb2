#!/usr/bin/python3
"""What bakes of levels that nobody tuned on are off by, against the path tracer.

unseen.py [--seed 1] [--kinds clutter cave ...] [--paths 512] [--out FOLDER]

Another seed, other levels. Each is path-traced twice, baked at every quality and at 2 %, and compared (relRMSE by the cross measure, over all texels
that have light). Writes table.md; the levels and their bakes stay in FOLDER."""
import argparse
import os
import sys

import numpy as np
import OpenImageIO as oiio

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "converge"))
import converge  # noqa: E402
import levels  # noqa: E402

ASKED = {"preview": 8, "medium": 4, "2 %": 2, "high": 1}
FLOOR = 0.05  # of the mean: what the p95 of relative errors counts from


def luminance(path):
    return oiio.ImageBuf(path).get_pixels(oiio.FLOAT)[..., :3] @ np.array([0.2126, 0.7152, 0.0722])


def rows_of(kind, density, arguments):
    name, folder = kind.__name__, os.path.join(arguments.out, kind.__name__)
    os.makedirs(folder, exist_ok=True)
    level = os.path.join(folder, "level.glb")
    kind(np.random.default_rng([arguments.seed, *name.encode()])).write(level)
    common = [level, "--uv", "generate", "--texels-per-metre", str(density), "--resolution", "512"]
    truth = []
    for half in (1, 2):
        out = os.path.join(folder, f"reference{half}")
        converge.bakewell("reference", *common, "-o", out, "--spp", str(arguments.paths), "--seed", str(half))
        truth.append(luminance(os.path.join(out, "reference-0.irradiance.exr")))
    lit = (truth[0] > 0) & (truth[1] > 0)
    a, b = truth[0][lit], truth[1][lit]
    mean = (a + b) / 2
    for asked in ASKED:
        out = os.path.join(folder, asked.replace(" %", "_percent"))
        options = ["--target-error", "0.02"] if asked == "2 %" else ["--quality", asked]
        done = converge.bakewell("bake", *common, "-o", out, "--seed", str(arguments.seed), *options)
        value = luminance(os.path.join(out, "lightmap-0.irradiance.exr"))[lit]
        came = np.sqrt(max(0, ((value - a) * (value - b)).mean())) / mean.mean()
        p95 = np.percentile(np.abs(value - mean) / np.maximum(mean, FLOOR * mean.mean()), 95)
        yield [name, str(lit.sum()), asked, f"{100 * came:.2f}", f"{100 * came / ASKED[asked]:.2f}", f"{100 * done['estimated_error']:.2f}",
               f"{100 * (value.mean() / mean.mean() - 1):+.2f}", f"{100 * p95:.1f}", f"{done['rays'] / 1e6:.1f}", f"{sum(p['cpu_seconds'] for p in done['phases']):.2f}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    names = [kind.__name__ for kind in levels.KINDS]
    parser.add_argument("--kinds", nargs="+", choices=names, default=names)
    parser.add_argument("--paths", type=int, default=512, help="a texel, of each of the two references")
    parser.add_argument("--out", default="unseen")
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    with open(os.path.join(arguments.out, "table.md"), "w", encoding="utf-8") as table:
        def say(cells):
            line = "| " + " | ".join(cells) + " |"
            print(line, flush=True)
            print(line, file=table, flush=True)

        head = ["level", "texels", "asked", "came %", "came / asked", "own estimate %", "bias %", "p95 %", "Mrays", "CPU s"]
        say(head)
        say(["---"] * len(head))
        for kind, density in levels.KINDS.items():
            if kind.__name__ in arguments.kinds:
                for row in rows_of(kind, density, arguments):
                    say(row)


if __name__ == "__main__":
    main()
