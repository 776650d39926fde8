#!/usr/bin/env bash
# What takes too long for every run: each fuzz target for a while, and the daemon's tests under the thread sanitizer.
# Run by ./test.sh --long, or alone. SONARD_FUZZ_SECONDS (60): time for each fuzz target.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

need_packages "${build_packages[@]}" clang-14 libclang-rt-14-dev || exit

# built_tests FOLDER: the GoogleTest programs a build folder holds under tests/, fuzz targets excluded.
built_tests() { find "build/$1/tests" -path '*/fuzz' -prune -o -type f -name '*_test*' -perm -u+x -print | sort; }

say "thread sanitizer: the daemon and the compute threads"
configure tsan || exit
build tsan tsan_tests || exit
for program in $(built_tests tsan); do
  echo "-- $program"
  TSAN_OPTIONS="halt_on_error=1 suppressions=$PWD/tests/tools/tsan.supp" "$program" --gtest_brief=1 || exit 1
done

say "fuzz targets, ${SONARD_FUZZ_SECONDS:-60} s each"
configure fuzz || exit
build fuzz fuzz_targets || exit
for program in $(find build/fuzz/tests/fuzz -type f -name 'fuzz_*' -perm -u+x | sort); do
  echo "-- $program"
  corpus=$(mktemp -d)
  "$program" -max_total_time="${SONARD_FUZZ_SECONDS:-60}" -rss_limit_mb=2048 -print_final_stats=0 -verbosity=0 "$corpus" || exit 1
  rm -rf "$corpus"
done
