#!/usr/bin/python3
"""table.py RESULTS.json: what bench_kernel measured, as a Markdown table: nanoseconds a unit, median of the repetitions (quartiles)."""
import json
import sys

import numpy as np

UNITS = {"photon": "photon, emitted and traced", "density": "density estimate, a side of a cell", "rasterise": "texel rasterised", "gather/8": "texel gathered, 8 samples",
         "gather/64": "texel gathered, 64 samples", "filter": "texel filtered", "finish": "texel finished (page, gutter)", "accumulate": "sample accumulated (irradiance, 9 SH x RGB)",
         "light_tree": "light drawn from the tree"}


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        runs = [b for b in json.load(file)["benchmarks"] if b["run_type"] == "iteration"]
    times = {}
    for run in sorted(runs, key=lambda r: r["family_index"]):
        level, kernel = run["name"].split("/", 1)
        times.setdefault(level, {}).setdefault(kernel, []).append(run["ns"])
    text = lambda values: "" if values is None else f"{np.median(values):.0f} ({np.percentile(values, 25):.0f}-{np.percentile(values, 75):.0f})"
    print("| rays of a gather, ns | ours | bare Embree | bare in packets of 8 | ours / bare, rays a second |\n|---|---|---|---|---|")
    for level, kernels in times.items():
        for kind, name in (("nearest", "gather and bounce"), ("any", "shadow")):
            ours, bare, packets = [kernels[f"rays/{kind}/{who}"] for who in ("ours", "bare", "bare8")]
            print(f"| {level}, {name} | {text(ours)} | {text(bare)} | {text(packets)} | {np.median(bare) / np.median(ours):.2f} |")
    print("\n| ns a | " + " | ".join(times) + " |\n|---|" + "---|" * len(times))
    for kernel, unit in UNITS.items():
        print(f"| {unit} | " + " | ".join(text(kernels.get(kernel)) for kernels in times.values()) + " |")


if __name__ == "__main__":
    main()
