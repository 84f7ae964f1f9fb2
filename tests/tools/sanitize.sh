#!/usr/bin/env bash
# Runs the farm's unit, integration and fault tests with a sanitizer: sanitize.sh asan-ubsan|tsan [gtest filter]. Fails on a
# report of any process, also of those that the tests start and kill; they stay in build/PRESET/reports.
# For tsan absl, gRPC and TBB are built with instrumentation (sanitize/instrumented.sh), and nothing is suppressed: what other
# libraries do is not looked at. What asan-ubsan leaves out is in sanitize/leak.supp, libraries only, with a reason a line.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
readonly root
readonly preset="${1:?asan-ubsan or tsan}" filter="${2:-*}"
readonly here="$root/tests/tools/sanitize" reports="$root/build/$preset/reports"
readonly programs=(unit_server_store unit_server_sched unit_server_job integration_farm fault_farm integration_level_farm)

cd "$root"
cmake --preset "$preset" >/dev/null
nice ninja -C "build/$preset" "${programs[@]}"
if [[ "$preset" == tsan ]]; then
  "$here/instrumented.sh" "build/tsan/instrumented"
  export LD_LIBRARY_PATH="$root/build/tsan/instrumented/lib"
fi
rm -rf "$reports"
mkdir -p "$reports"
export ASAN_OPTIONS="detect_stack_use_after_return=1:strict_string_checks=1:detect_leaks=1:log_path=$reports/asan"
export LSAN_OPTIONS="suppressions=$here/leak.supp:print_suppressions=0"
export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1:log_path=$reports/ubsan"
export TSAN_OPTIONS="history_size=7:second_deadlock_stack=1:ignore_noninstrumented_modules=1:log_path=$reports/tsan"
status=0
for program in "${programs[@]}"; do
  "build/$preset/bin/$program" --gtest_filter="$filter" --gtest_brief=1 || { echo "$preset: $program failed" >&2; status=1; }
done
found="$(find "$reports" -type f | wc -l)"
[[ "$found" -eq 0 ]] || { echo "$preset: $found processes have findings, in $reports" >&2; status=1; }
exit "$status"
