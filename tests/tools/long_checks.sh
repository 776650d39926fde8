#!/usr/bin/env bash
# Checks that take too long for every run and are run before a release: the loads, starts, stops and reloads on a quiet computer,
# a mission of ten minutes, the page of the live view for 20 minutes, full fuzzing, the whole functional suite under the address
# and undefined-behaviour sanitizers, and programs with threads under the thread sanitizer. ./test.sh --long runs it; it takes two
# to four hours on two cores. Every step is run, also after one that failed; a table of the steps is printed last. The figures of
# all steps become the table of reliability. A figure that misses its bound is a failure. Without STEPs, a figure that was
# not measured is also a failure.
# usage: tests/tools/long_checks.sh [STEP...]
#   SONARD_FUZZ_RUNS, SONARD_FUZZ_SECONDS   see tests/tools/fuzz.sh
#   SONARD_RELIABILITY                      where figures and their table are kept (build/reliability)
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh
export SONARD_RELIABILITY=${SONARD_RELIABILITY:-$PWD/build/reliability}

wished=("$@")
rows=()
failures=0
step() {  # step NAME COMMAND...: runs the command if the step was requested, and stores the result
  local name=$1 before=$SECONDS result=passed
  shift
  [ ${#wished[@]} -eq 0 ] || [[ " ${wished[*]} " == *" $name "* ]] || return 0
  say "$name: $*"
  "$@" || { result=FAILED failures=$((failures + 1)); }
  rows+=("$(printf '%-10s %-7s %6d s   %s' "$name" "$result" $((SECONDS - before)) "$*")")
}

# alone SCRIPT [ARGUMENTS]: runs a script of tests/acceptance with the release build in a separate network.
alone() {
  SONARD_BUILD=$PWD/build/release build/release/tests/own_network/in_own_network python3 -B "tests/acceptance/$1.py" "${@:2}" </dev/null
}

# one_by_one NAME...: runs acceptance tests that record figures.
one_by_one() {
  local name failed=0
  for name in "$@"; do alone "${name}_test" || failed=1; done
  return $failed
}

if [ ${#wished[@]} -eq 0 ]; then  # a figure that is not measured now is shown as "not run"
  forget_figures || exit
fi
if [ ${#wished[@]} -eq 0 ] || [[ " ${wished[*]} " =~ \ (load|life|mission|page)\  ]]; then
  [ ${#wished[@]} -eq 0 ] || wished+=(build)
  step build setup_and_build sonard sonarctl load_test dump_oculus in_own_network
fi
step load tests/load/load.sh
step life one_by_one life_cycle reload service dissector farm
step mission alone mission_test --long
step page alone page_figures
step tsan tests/tools/sanitized_tests.sh tsan
step asan tests/tools/sanitized_tests.sh asan-all
step fuzz tests/tools/fuzz.sh

[ ${#rows[@]} -gt 0 ] || { echo "no such step: ${wished[*]}; there are load, life, mission, page, tsan, asan, fuzz" >&2; exit 64; }
strict=(--strict)
[ ${#wished[@]} -eq 0 ] || strict=()  # with only some steps, rows are missing
mkdir -p "$SONARD_RELIABILITY"
python3 tests/reliability/reliability_table.py "$SONARD_RELIABILITY" "${strict[@]}" >"${SONARD_RELIABILITY}/reliability.md" ||
  failures=$((failures + 1))
say "long checks"
printf '%s\n' "${rows[@]}"
echo "the table: ${SONARD_RELIABILITY}/reliability.md"
[ $failures -eq 0 ]
