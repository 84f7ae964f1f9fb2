#!/usr/bin/env bash
# A bake on farms of several sizes gives every file of the embedded one. same_bytes.sh BIN_DIR SCENE "1 2 8" [bake flags...]
# Then the same scene again, which runs no task: how long that submit takes.
set -euo pipefail
readonly bin="$1" scene="$2" sizes="$3"
shift 3
readonly flags=("$@")
dir="$(mktemp -d)"
readonly dir
readonly port="${BAKEWELL_BENCH_PORT:-17751}" address="localhost:${BAKEWELL_BENCH_PORT:-17751}"
farm=()

stop_farm() { [[ ${#farm[@]} -eq 0 ]] || { kill "${farm[@]}" 2>/dev/null || true; wait "${farm[@]}" 2>/dev/null || true; farm=(); }; }
trap 'stop_farm; rm -rf "$dir"' EXIT

submit() { "$bin/bakewell" submit "$scene" --server "$address" --wait -o "$1" "${flags[@]}" >"$dir/submit.out" 2>&1 || { cat "$dir/submit.out"; exit 1; }; }

"$bin/bakewell" bake "$scene" -o "$dir/embedded" "${flags[@]}" >/dev/null 2>&1
for workers in $sizes; do
  "$bin/bakewell-server" --data "$dir/data-$workers" serve --listen "127.0.0.1:$port" --http "" >"$dir/server.out" 2>"$dir/server.log" &
  farm=($!)
  for ((i = 0; i < workers; ++i)); do
    "$bin/bakewell-worker" --server "$address" --threads 1 --name "w$i" 2>>"$dir/worker.log" &
    farm+=($!)
  done
  submit "$dir/$workers"
  diff -r "$dir/embedded" "$dir/$workers"
  start="$(date +%s%N)"
  submit "$dir/$workers-again"
  took_ms=$((($(date +%s%N) - start) / 1000000))
  diff -r "$dir/embedded" "$dir/$workers-again"
  echo "$workers workers: every file as embedded; $(head -n 1 "$dir/submit.out" | tr -s ' '); again, with load and fetch: $took_ms ms"
  stop_farm
done
