#!/usr/bin/env bash
# Runs the farm's integration and fault tests with a sanitizer: sanitize.sh asan-ubsan|tsan [gtest filter].
# Embree, TBB, gRPC and their libraries come from Debian without instrumentation: what is said of them and of them only is
# in sanitize/*.supp, with a reason a line.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
readonly root
readonly preset="${1:?asan-ubsan or tsan}" filter="${2:-*}"
readonly here="$root/tests/tools/sanitize" programs=(integration_farm fault_farm integration_level_farm)

cd "$root"
cmake --preset "$preset" >/dev/null
nice ninja -C "build/$preset" "${programs[@]}"
export ASAN_OPTIONS="detect_stack_use_after_return=1:strict_string_checks=1:detect_leaks=1"
export LSAN_OPTIONS="suppressions=$here/leak.supp:print_suppressions=0"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1"
export TSAN_OPTIONS="suppressions=$here/thread.supp:history_size=7:second_deadlock_stack=1"
status=0
for program in "${programs[@]}"; do
  "build/$preset/bin/$program" --gtest_filter="$filter" --gtest_brief=1 || { echo "$preset: $program failed" >&2; status=1; }
done
exit "$status"
