#!/usr/bin/env python3
"""compare.py ROOT WORK [--quick] [--only a,b] [--write]: every mesh of WORK/mesh through xatlas and bakewell, judged by uv_eval.

A row's faults must all be 0; the exit code is 1 where bakewell has any."""
import json
import math
import os
import statistics
import struct
import subprocess
import sys
import time

ROOT, WORK = sys.argv[1], sys.argv[2]
TOOLS = os.path.join(ROOT, "..", "shared", "tools")
UNWRAP = os.path.join(ROOT, "build", "release", "bin", "bench_unwrap")
RIVAL_MAX_VERTICES, RIVAL_TIMEOUT_S = 65535, 300
CURVED = {"torus_20k", "sphere_20k", "organic_20k"}
FAULTS = ("overlap_texels_inter", "overlap_texels_intra", "flips", "unmapped", "nan", "oob_corners", "texels_gap_lt_padding")


def judge(path, page=0):
    return json.loads(subprocess.run([os.path.join(WORK, "uv_eval"), path, "--page", str(page)], capture_output=True, text=True, check=True).stdout)


def rival(name, brute):
    """One row of the rival, or None where it cannot take the mesh (16-bit indices) or needs longer than the limit."""
    out = os.path.join(WORK, "out", "xatlas_%s_%d.obj" % (name, brute))
    try:
        run = subprocess.run(["node", os.path.join(TOOLS, "xatlas_js.cjs"), mesh_path(name), out, str(brute)],
                             cwd=os.path.join(WORK, "npm"), capture_output=True, text=True, timeout=RIVAL_TIMEOUT_S)
        figures = json.loads(run.stdout.strip().split("\n")[-1])
        return dict(judge(out), cpu=figures["cpu_s"], pages=figures["atlasCount"])
    except (subprocess.TimeoutExpired, ValueError, IndexError):
        return None


def ours(name, source, *flags):
    out = os.path.join(WORK, "out", "bakewell_%s.obj" % name)
    run = subprocess.run([UNWRAP, "unwrap", source, "-o", out, "--json", *flags], capture_output=True, text=True, timeout=900)
    if run.returncode:
        raise SystemExit("%s: %s" % (name, run.stderr))
    figures = json.loads(run.stdout)
    pages = [judge(out, page) for page in range(figures["pages"])]
    row = dict(pages[0], cpu=figures["chart_cpu_s"] + figures["pack_cpu_s"], wall=figures["wall_s"], pages=figures["pages"],
               tpu=figures["texels_per_unit"])
    for key in FAULTS:
        row[key] = sum(p[key] for p in pages)
    return row


def mesh_path(name):
    return os.path.join(WORK, "mesh", name + ".obj")


def vertex_count(path):
    with open(path) as file:
        return sum(line.startswith("v ") for line in file)


def scaled(name, factor):
    path = os.path.join(WORK, "out", "scaled_%s_%g.obj" % (name, factor))
    with open(mesh_path(name)) as source, open(path, "w") as out:
        for line in source:
            if line.startswith("v "):
                # From the float that the reader sees, so that a power of two changes no bit of the mantissa.
                floats = struct.unpack("3f", struct.pack("3f", *map(float, line.split()[1:4])))
                line = "v %.17g %.17g %.17g\n" % tuple(x * factor for x in floats)
            out.write(line)
    return path


def charts_of(path):
    """Per face, in the order of its corners, the least face of its chart (-1: none): the same for the same charts."""
    group, face_group, seen = None, {}, {}
    with open(path) as file:
        for text in file:
            if text.startswith("g "):
                group = text.strip()
            elif text.startswith("f "):
                corners = tuple(int(word.split("/")[0]) for word in text.split()[1:])
                seen[corners] = seen.get(corners, 0) + 1
                face_group[corners, seen[corners]] = group
    least = {}
    for face in sorted(face_group):
        least.setdefault(face_group[face], face)
    return {face: -1 if name.startswith("g none") else least[name] for face, name in face_group.items()}


def faults(row):
    found = ["%s %d" % (key, row[key]) for key in FAULTS if row[key]]
    if max(row["chart_dens_max"] - 1, 1 - row["chart_dens_min"]) > 0.01:
        found.append("density %.3f-%.3f" % (row["chart_dens_min"], row["chart_dens_max"]))
    return found


def variants(name, base):
    """The promises that one plain run cannot show: scale, resolution, blocks, fixed density on several pages."""
    found, fills = [], []
    charts = charts_of(os.path.join(WORK, "out", "bakewell_%s.obj" % name))
    for factor in (0.001, 1000, 0.01, 100, 1 / 1024, 1024):
        row = ours(name + "_scaled", scaled(name, factor))
        found += ["x%g: %s" % (factor, f) for f in faults(row)]
        fills.append("%d / %.3f" % (row["charts"], row["util_touched"]))
        if charts_of(os.path.join(WORK, "out", "bakewell_%s_scaled.obj" % name)) != charts:
            found.append("x%g: not the same charts" % factor)
        # A power of two changes no bit of the input's mantissas: the same texels. Others round it: a texel at a chart's rim may go.
        if factor in (1 / 1024, 1024) and (row["charts"], row["util_touched"], row["L2"]) != (base["charts"], base["util_touched"], base["L2"]):
            found.append("x%g: not the same atlas" % factor)
    row = ours(name + "_512", mesh_path(name), "--resolution", "512", "--block-align")
    found += ["512 blocks: " + f for f in faults(row)]
    if row["W"] > 512 or row["H"] > 512:
        found.append("resolution exceeded: %dx%d" % (row["W"], row["H"]))
    row = ours(name + "_pages", mesh_path(name), "--resolution", "512", "--texels-per-unit", "%.9g" % (0.6 * base["tpu"]))
    found += ["pages: " + f for f in faults(row) if not f.startswith("density") or row["pages"] == 1]
    return found, fills


def cell(row, key, text="%.3f"):
    return text % row[key] if row else "-"


def measure(name, quick):
    plain = ours(name, mesh_path(name), "--picture", os.path.join(WORK, "out", name + ".png"))
    brute = ours(name + "_brute", mesh_path(name), "--brute-force")
    found = faults(plain) + ["brute: " + f for f in faults(brute)]
    small = plain["tris"] <= 200000
    fills = []
    if small and not quick:
        more, fills = variants(name, plain)
        found += more
    fits = vertex_count(mesh_path(name)) <= RIVAL_MAX_VERTICES
    return {"name": name, "plain": plain, "brute": brute, "faults": found, "fills": fills,
            "rival": rival(name, 0) if fits else None, "rival_brute": rival(name, 1) if fits and small else None}


HEAD = ("| mesh | triangles | charts xatlas / ours | util xatlas default, brute / ours default, brute | L2 xatlas / ours | "
        "CPU s xatlas / ours | ours x0.001, x1000: charts / util | faults xatlas / ours |\n|---|---|---|---|---|---|---|---|\n")


def line(r):
    x, xb, p, b = r["rival"], r["rival_brute"], r["plain"], r["brute"]
    return "| %s | %d | %s / %d | %s, %s / %.3f, **%.3f** | %s / %.4f | %s / %.2f | %s | %s / %s |\n" % (
        r["name"], p["tris"], cell(x, "charts", "%d"), p["charts"], cell(x, "util_touched"), cell(xb, "util_touched"), p["util_touched"],
        b["util_touched"], cell(x, "L2", "%.4f"), p["L2"], cell(x, "cpu", "%.2f"), p["cpu"], ", ".join(r["fills"][:2]) or "-",
        "; ".join(faults(x)) or "0" if x else "-", "; ".join(r["faults"]) or "0")


def verdicts(rows):
    both = [r for r in rows if r["rival"] and r["rival_brute"]]
    text = []
    if both:
        gain = [r["brute"]["util_touched"] - r["rival_brute"]["util_touched"] for r in both]
        gain_default = [r["plain"]["util_touched"] - r["rival_brute"]["util_touched"] for r in both]
        charts = [r["plain"]["charts"] / r["rival"]["charts"] for r in both]
        stretch = [r["name"] for r in both if r["plain"]["L2"] > r["rival"]["L2"] + 5e-5]
        text.append("- Utilisation above xatlas' bruteForce: least %+.3f, median %+.3f (with our default effort: least %+.3f, median %+.3f)."
                    % (min(gain), statistics.median(gain), min(gain_default), statistics.median(gain_default)))
        text.append("- Charts, ours / xatlas': median %.2f. L2 above xatlas': %s." % (statistics.median(charts), ", ".join(stretch) or "none"))
    timed = [r for r in rows if r["rival"] and r["plain"]["tris"] > 10000]
    if timed:
        text.append("- CPU, ours / xatlas' default, above 10,000 triangles: " + ", ".join(
            "%s %.2f" % (r["name"], r["plain"]["cpu"] / r["rival"]["cpu"]) for r in timed) + ".")
    sizes = [r for r in rows if r["name"].startswith("organic_")]
    for r in sizes:
        n = r["plain"]["tris"]
        text.append("- %s: %.2f CPU s, %.0f ns per n log2 n." % (r["name"], r["plain"]["cpu"], 1e9 * r["plain"]["cpu"] / (n * math.log2(n))))
    return "\n".join(text) + "\n"


def main():
    only = [a for i, a in enumerate(sys.argv) if sys.argv[i - 1] == "--only"]
    names = sorted(f[:-4] for f in os.listdir(os.path.join(WORK, "mesh")) if f.endswith(".obj"))
    if only:
        names = [n for n in names if n in only[0].split(",")]
    if not names:
        raise SystemExit("no mesh to measure")
    rows = []
    for name in sorted(names, key=lambda n: os.path.getsize(mesh_path(n))):
        rows.append(measure(name, "--quick" in sys.argv))
        print(line(rows[-1]), end="", flush=True)
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    table = "Commit %s, %s, %d cores, defaults of both, padding 2.\n\n%s%s\n%s" % (
        commit, time.strftime("%Y-%m-%d"), os.cpu_count(), HEAD, "".join(map(line, rows)), verdicts(rows))
    print("\n" + table)
    with open(os.path.join(WORK, "table.md"), "w") as out:
        out.write(table)
    if "--write" in sys.argv:
        readme = os.path.join(ROOT, "tests", "bench", "chart", "README.md")
        before, rest = open(readme).read().split("<!-- table -->\n", 1)
        open(readme, "w").write(before + "<!-- table -->\n" + table + "<!-- end -->\n" + rest.split("<!-- end -->\n", 1)[1])
    sys.exit(1 if any(r["faults"] for r in rows) else 0)


if __name__ == "__main__":
    main()
