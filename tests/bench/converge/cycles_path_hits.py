"""blender -b --factory-startup --python cycles_path_hits.py -- job.json
../shared/reference/cycles_bake.py with one difference: emitters are found by scattered rays only, never sampled as lights. Slower, and
free of the light that Cycles loses when it samples an emitter at grazing angles (see README.md)."""
import os

here = os.path.dirname(os.path.abspath(__file__))
path = os.path.abspath(os.path.join(here, "..", "..", "..", "..", "shared", "reference", "cycles_bake.py"))
with open(path, encoding="utf-8") as file:
    source = file.read()
marker = "\ntarget = None\n"
assert source.count(marker) == 1, path + " has changed"
source = source.replace(marker, "\nfor material in mats: material.cycles.sample_as_light = False\n" + marker)
exec(compile(source, path, "exec"), {"__file__": path, "__name__": "__main__"})
