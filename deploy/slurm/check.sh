#!/bin/bash
# Bakes a level on workers that Slurm starts, on a one-node Slurm of its own (../shared/tools/slurm; packages slurm-wlm,
# munge; as root), and compares every file with the embedded bake.  check.sh BIN_DIR SCENE [bake flags...]
set -euo pipefail
bin="$(cd "$1" && pwd)"
scene="$(realpath "$2")"
shift 2
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
tools="${BAKEWELL_SLURM_TOOLS:-$here/../../../shared/tools/slurm}"
dir="$(mktemp -d)"
chmod 755 "$dir"
server=0
stop() {
  kill "$server" 2>/dev/null || true
  scancel -u root 2>/dev/null || true
  for daemon in slurmd slurmctld munged; do kill "$(cat "$dir/slurm/$daemon.pid")" 2>/dev/null || true; done
  sleep 1
  rm -rf "$dir"
}
trap stop EXIT
"$bin/bakewell" bake "$scene" -o "$dir/embedded" "$@" >/dev/null 2>&1
bash "$tools/up.sh" "$dir/slurm"
export SLURM_CONF="$dir/slurm/slurm.conf"
"$bin/bakewell-server" --data "$dir/data" serve --listen 127.0.0.1:17741 --http 127.0.0.1:17742 >"$dir/out" 2>"$dir/log" &
server=$!
cd "$dir"
export BAKEWELL_BIN="$bin" BAKEWELL_SERVER=localhost:17741 BAKEWELL_IDLE_EXIT=3
"$bin/bakewell" submit "$scene" --server localhost:17741 --wait -o "$dir/farm" "$@" >"$dir/submit" 2>&1 &
client=$!
sleep 1
bash "$here/autoscale.sh" http://127.0.0.1:17742/metrics 2 1
until [[ -n "$(squeue -h -t R)" ]] || ! kill -0 "$client" 2>/dev/null; do sleep 0.2; done
sleep 2
bash "$here/autoscale.sh" http://127.0.0.1:17742/metrics 2 1
squeue
wait "$client"
for file in "$dir"/embedded/*; do
  cmp "$file" "$dir/farm/$(basename "$file")"
done
"$bin/bakewell" workers --server localhost:17741
echo "every file as in the embedded bake; waiting for the idle workers to leave"
for _ in $(seq 60); do [[ -z "$(squeue -h)" ]] && break; sleep 0.5; done
[[ -z "$(squeue -h)" ]] && echo "no worker is left in Slurm"
