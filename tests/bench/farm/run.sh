#!/usr/bin/env bash
# The farm's long tests: load, a million finished tasks, 100 kills over synthetic work and over a real level.
#   run.sh [seconds of load]
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)"
readonly root
readonly bin="$root/build/release/bin"
readonly seconds="${1:-60}"
data="$(mktemp -d)"
readonly data
trap 'rm -rf "$data"' EXIT

cmake --build "$root/build/release" --target bare_bake farm_load fault_farm bakewell bakewell-server bakewell-worker
echo "# 1,000 workers, 200 jobs of 5,000 tasks, about 1,000 completions a second"
"$bin/farm_load" "$data/paced" --seconds "$seconds" --run-ms 1000
echo "# as fast as it goes, empty database"
"$bin/farm_load" "$data/fast" --seconds "$seconds" --run-ms 0 --workers 200
echo "# as fast as it goes, a million finished tasks"
"$bin/farm_load" "$data/past" --seconds "$seconds" --run-ms 0 --workers 200 --known 1000000
echo "# CPU time beside the bare kernels"
python3 "$root/tests/bench/farm/overhead.py" "$bin" "$root/../shared/reference/scenes/office.glb" --quality high --resolution 96 --together
echo "# farms of several sizes"
"$root/tests/bench/farm/same_bytes.sh" "$bin" "$root/tests/scenes/sample.glb" "1 2 8" --quality medium --resolution 128
echo "# chaos"
BAKEWELL_CHAOS_KILLS=100 "$bin/fault_farm" --gtest_filter='Chaos.*'
"$root/tests/bench/farm/level_chaos.sh" "$bin" "$root/tests/scenes/sample.glb" 100 --quality high --resolution 256
