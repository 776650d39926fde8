#!/usr/bin/env bash
# What takes too long for every run, and is run before a release: the loads, a mission of ten minutes, the page for 20, full fuzzing, the whole
# functional suite under the address and undefined-behaviour sanitizers, and what has threads under the thread sanitizer. Run by
# ./test.sh --long, or alone; two to four hours on two cores. Every step is run, also after one that failed; a table ends it.
# usage: tests/tools/long_checks.sh [STEP...]
#   SONARD_FUZZ_RUNS, SONARD_FUZZ_SECONDS   see tests/tools/fuzz.sh
#   SONARD_RELIABILITY                      where figures are kept (build/reliability)
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh
export SONARD_RELIABILITY=${SONARD_RELIABILITY:-$PWD/build/reliability}

wished=("$@")
rows=()
failures=0
step() {  # step NAME COMMAND...: runs it, when wished, and remembers how it ended
  local name=$1 before=$SECONDS result=passed
  shift
  [ ${#wished[@]} -eq 0 ] || [[ " ${wished[*]} " == *" $name "* ]] || return 0
  say "$name: $*"
  "$@" || { result=FAILED failures=$((failures + 1)); }
  rows+=("$(printf '%-10s %-7s %6d s   %s' "$name" "$result" $((SECONDS - before)) "$*")")
}

step load tests/load/load.sh
step mission env SONARD_BUILD=build/release python3 -B tests/acceptance/mission_test.py --long
step page env SONARD_BUILD=build/release python3 -B tests/acceptance/page_figures.py
step tsan tests/tools/sanitized_tests.sh tsan
step asan tests/tools/sanitized_tests.sh asan-all
step fuzz tests/tools/fuzz.sh

[ ${#rows[@]} -gt 0 ] || { echo "no such step: ${wished[*]}; there are load, mission, page, tsan, asan, fuzz" >&2; exit 64; }
say "long checks"
printf '%s\n' "${rows[@]}"
echo "figures: $SONARD_RELIABILITY"
[ $failures -eq 0 ]
