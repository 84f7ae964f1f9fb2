#!/usr/bin/env bash
# kill -9 at random moments over coordinator and workers while they bake a real level: the result has the bytes of a
# quiet bake. level_chaos.sh BIN_DIR SCENE KILLS [bake flags...]
set -euo pipefail
readonly bin="$1" scene="$2" kills="$3"
shift 3
readonly flags=("$@")
dir="$(mktemp -d)"
readonly dir
readonly port="${BAKEWELL_BENCH_PORT:-17731}"
server=""
workers=()
RANDOM=7

stop_all() { [[ -z "$server" ]] || kill -9 "$server" "${workers[@]}" 2>/dev/null || true; rm -rf "$dir"; }
trap stop_all EXIT

start_server() {
  "$bin/bakewell-server" --data "$dir/data" serve --listen "127.0.0.1:$port" --http "" --heartbeat-timeout 2 \
    >"$dir/server.out" 2>>"$dir/server.log" &
  server=$!
}

start_worker() {
  "$bin/bakewell-worker" --server "localhost:$port" --threads 1 --name "w$1" 2>>"$dir/worker.log" &
  workers[$1]=$!
}

# Kills one process in four, the server among them, and starts it again.
kill_one() {
  local victim=$((RANDOM % 4))
  if [[ $victim -eq 3 ]]; then
    kill -9 "$server"; wait "$server" 2>/dev/null || true; start_server
  else
    kill -9 "${workers[$victim]}"; wait "${workers[$victim]}" 2>/dev/null || true; start_worker "$victim"
  fi
}

"$bin/bakewell" bake "$scene" -o "$dir/quiet" "${flags[@]}" >/dev/null 2>&1
start_server
for i in 0 1 2; do start_worker "$i"; done
"$bin/bakewell" submit "$scene" --server "localhost:$port" --wait -o "$dir/out" --client-key chaos "${flags[@]}" \
  >"$dir/submit.out" 2>&1 &
readonly client=$!
done_kills=0
while [[ $done_kills -lt $kills ]] && kill -0 "$client" 2>/dev/null; do
  sleep "0.$((RANDOM % 7 + 1))"
  kill_one
  done_kills=$((done_kills + 1))
done
wait "$client" || { cat "$dir/submit.out" "$dir/server.log"; echo "the job failed after $done_kills kills"; exit 1; }
for file in "$dir"/quiet/*; do
  cmp "$file" "$dir/out/$(basename "$file")"
done
[[ -z "$(ls "$dir/data/incoming")" ]] || { echo "temporary files are left"; exit 1; }
echo "$done_kills kills while $(basename "$scene") baked: every file as in the quiet bake"
tail -n 1 "$dir/submit.out"
