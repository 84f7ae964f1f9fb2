"""blender -b --factory-startup --python cycles_reference.py -- job.json
Two independent halves of a reference by ../shared/reference/cycles_bake.py: every light is baked alone and added up, with as many
samples as a pilot says it is worth (n ~ sqrt(variance / cost)). Run by make_references.py.

job: {"glb", "threads", "camera": null, "groups": [{"spp": 1, "seed": 90, "out": scratch}], "seconds": CPU seconds a half,
"halves": [path, path], "first_seed": 100000}"""
import os

here = os.path.dirname(os.path.abspath(__file__))
path = os.path.abspath(os.path.join(here, *[".."] * 5, "shared", "reference", "cycles_bake.py"))
base = {"__file__": path, "__name__": "__main__"}
with open(path, encoding="utf-8") as file:
    exec(compile(file.read(), path, "exec"), base)  # leaves `bake`, `save`, the light groups `G` and `setup`, which turns on one group
np, job, bake = base["np"], base["job"], base["bake"]


def bake_group(group, samples, seed):
    base["setup"](*group)
    image, _, cpu = bake(samples, seed)
    return image, cpu


# The pilot: one sample, then three more, so that the cost of a bake without samples is known. The brightest thousandth of the differences is left out of
# the variance.
worth, fixed, cost = [], [], []
for i, group in enumerate(base["G"]):
    (a, one), (b, three) = bake_group(group, 1, 9100 + i), bake_group(group, 3, 9500 + i)
    square = np.sort(((a - b).mean(-1) ** 2).ravel())
    worth.append(square[: -square.size // 1000].mean() / (1 + 1 / 3))
    cost.append(max((three - one) / 2, 0.1 * one))
    fixed.append(max(one - cost[-1], 0))
worth, cost = np.array(worth), np.array(cost)
count = np.sqrt(worth / cost)
count = np.maximum(2, np.rint(count * (job["seconds"] - sum(fixed)) / (count * cost).sum())).astype(int)
print("SAMPLES", count.tolist(), "CPU s expected", float((count * cost).sum() + sum(fixed)), flush=True)
for half, out in enumerate(job["halves"]):
    total, seconds = 0, 0
    for i, group in enumerate(base["G"]):
        image, cpu = bake_group(group, int(count[i]), job["first_seed"] + 100000 * half + i)
        total, seconds = total + image, seconds + cpu
    base["save"](out, total, half=True)
    print("HALF", out, seconds, flush=True)
