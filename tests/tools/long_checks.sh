#!/usr/bin/env bash
# What takes too long for every run: each fuzz target for a while, and the daemon's tests under the thread sanitizer.
# Run by ./test.sh --long, or alone. SONARD_FUZZ_SECONDS (60): time for each fuzz target.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

need_packages "${build_packages[@]}" clang-14 libclang-rt-14-dev || exit

# What runs in more than one thread: the daemon over loopback, and the pool.
threaded_tests=(daemon_loopback_test base_test)

say "thread sanitizer: ${threaded_tests[*]}"
configure tsan || exit
build tsan "${threaded_tests[@]}" || exit
for test in "${threaded_tests[@]}"; do
  program=$(find build/tsan/tests -name "$test" -type f)
  echo "-- $program"
  TSAN_OPTIONS="halt_on_error=1 suppressions=$PWD/tests/tools/tsan.supp" "$program" --gtest_brief=1 || exit 1
done

say "fuzz targets, ${SONARD_FUZZ_SECONDS:-60} s each"
configure fuzz || exit
build fuzz fuzz_targets || exit
for program in build/fuzz/tests/fuzz/*_fuzz; do
  name=$(basename "$program")
  echo "-- $name"
  found=$(mktemp -d)
  seeds=tests/fuzz/corpus/${name%_fuzz}
  [ -d "$seeds" ] || seeds=
  # shellcheck disable=SC2086 # no seeds, no argument
  "$program" -max_total_time="${SONARD_FUZZ_SECONDS:-60}" -rss_limit_mb=2048 -verbosity=0 -print_final_stats=1 "$found" $seeds || exit 1
  rm -rf "$found"
done
