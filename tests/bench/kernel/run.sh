#!/usr/bin/env bash
# Kernels by themselves; see README.md.   run.sh [LEVEL.glb...]
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)"
readonly root
readonly scenes="$root/../shared/reference/scenes"
[[ $# -gt 0 ]] || set -- "$scenes/cornell.glb" "$scenes/office.glb" "$scenes/manylights.glb"
out="$(mktemp)"
readonly out
trap 'rm -f "$out"' EXIT
"$root/build/release/bin/bench_kernel" --benchmark_min_time=0.1 --benchmark_repetitions=7 --benchmark_enable_random_interleaving=true \
  --benchmark_out="$out" --benchmark_out_format=json "$@" >/dev/null
/usr/bin/python3 "$root/tests/bench/kernel/table.py" "$out"
