#!/usr/bin/env python3
"""What tasks, store and wire cost: CPU seconds of the bare kernels, of the embedded bake, and of a server with two workers.

overhead.py BIN_DIR SCENE [--quality high] [--resolution 256] [--runs 3]. CPU time is user and system time of all
processes (getrusage of the ended children). The three take turns; the table has medians, and the median of the ratios
to the bare kernels of the same turn. With --together the three of a turn run at the same time: what else the machine
does then slows them alike, and their ratio is less of a lottery. Fails where the files differ.

With --instructions every process runs once under cachegrind and the table has the instructions that it executed outside
of the system: hardly two runs differ by 0.1 %, whatever else the machine does. It takes 50 times as long.
"""
import argparse
import concurrent.futures
import datetime
import filecmp
import os
import pathlib
import signal
import statistics
import subprocess
import sys
import tempfile

PORT = int(os.environ.get("BAKEWELL_BENCH_PORT", "17741"))


class Children:
    """CPU seconds, or 1e9 instructions, of children that were started here, once they have ended."""

    def __init__(self, args):
        self.counts = tempfile.TemporaryDirectory() if args.instructions else None
        self.cpu = 0.0

    def start(self, *words, **options):
        if self.counts:
            words = ("valgrind", "--tool=cachegrind", "--cache-sim=no",
                     f"--cachegrind-out-file={self.counts.name}/%p", "--log-file=/dev/null", *words)
        return subprocess.Popen(words, **{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **options})

    def wait(self, child):
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        assert child.returncode in (0, -signal.SIGTERM), (child.args, child.returncode)
        self.cpu += usage.ru_utime + usage.ru_stime

    def run(self, *words):
        self.wait(self.start(*words))

    def total(self):
        if not self.counts:
            return self.cpu
        files = list(pathlib.Path(self.counts.name).iterdir())
        assert files, "cachegrind counted nothing"
        return sum(int(file.read_text().rsplit("summary:", 1)[1]) for file in files) / 1e9


def bare(args, folder):
    children = Children(args)
    children.run(args.bin / "bare_bake", args.scene, folder, args.quality, str(args.resolution))
    return children.total()


def flags(args):
    return ["--quality", args.quality, "--resolution", str(args.resolution)]


def embedded(args, folder):
    children = Children(args)
    children.run(args.bin / "bakewell", "bake", args.scene, "-o", folder, *flags(args))
    return children.total()


def farm(args, folder):
    children = Children(args)
    address = f"localhost:{PORT}"
    with tempfile.TemporaryDirectory() as data:
        server = children.start(args.bin / "bakewell-server", "--data", data, "serve", "--listen", f"127.0.0.1:{PORT}",
                                "--http", "", stdout=subprocess.PIPE)
        assert server.stdout.readline().startswith(b"ready")
        workers = [children.start(args.bin / "bakewell-worker", "--server", address, "--threads", "1", stderr=subprocess.PIPE)
                   for _ in range(2)]
        children.run(args.bin / "bakewell", "submit", args.scene, "--server", address, "--wait", "-o", folder, *flags(args))
        for process in workers + [server]:
            process.send_signal(signal.SIGTERM)
            children.wait(process)
        for worker in workers:
            print("worker:", worker.stderr.read().decode().strip().rsplit("] ", 1)[-1], file=sys.stderr)
    return children.total()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--quality", default="high")
    parser.add_argument("--resolution", type=int, default=0, help="0: the scene's")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--together", action="store_true")
    parser.add_argument("--instructions", action="store_true")
    args = parser.parse_args()
    unit = "1e9 instructions" if args.instructions else "CPU s"
    ways = {"bare kernels": bare, "bake": embedded, "server and 2 workers": farm}
    cpu = {name: [] for name in ways}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(args.runs):
            with concurrent.futures.ThreadPoolExecutor(len(ways) if args.together else 1) as turn:
                done = {name: turn.submit(way, args, pathlib.Path(folder) / name.replace(" ", "-")) for name, way in ways.items()}
            for name, seconds in done.items():
                cpu[name].append(seconds.result())
        first = pathlib.Path(folder) / "bare-kernels"
        for name in list(ways)[1:]:
            for file in sorted(first.iterdir()):
                other = pathlib.Path(folder) / name.replace(" ", "-") / file.name
                assert filecmp.cmp(file, other, shallow=False), f"{other} differs"
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True,
                            cwd=pathlib.Path(__file__).parent).stdout.strip()
    print(f"| {args.scene.stem} {args.quality}, {args.runs} runs, {commit}, {datetime.date.today()} | {unit}, median (min) | to bare |")
    print("|---|---|---|")
    for name in ways:
        print(f"{name}:", " ".join(f"{seconds:.2f}" for seconds in cpu[name]), file=sys.stderr)
    for name in ways:
        ratio = statistics.median(a / b for a, b in zip(cpu[name], cpu["bare kernels"]))
        print(f"| {name} | {statistics.median(cpu[name]):.2f} ({min(cpu[name]):.2f}) | {ratio:.3f} |")


if __name__ == "__main__":
    main()
