#!/usr/bin/env bash
# Sets up, builds and runs the tests. usage: ./test.sh [--long] [ctest arguments...]
#   --long   runs also the load tests, full fuzzing and all sanitizers (tests/tools/long_checks.sh) before a release; takes hours;
#            their table is in build/reliability; a figure that misses its bound or was not measured is a failure
# Tests that read recordings of real devices take their folder from SONARD_CAPTURES and are skipped without it.
set -u -o pipefail
cd "$(dirname "$0")" || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

long=
case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
  --long) long=1; shift ;;
esac

timed "build" setup_and_build || exit
for packages in "${test_packages[*]}" "${browser_packages[*]}"; do
  # shellcheck disable=SC2086
  need_packages $packages || echo "going on without: the tests that need them are skipped"
done
# Most long tests wait for sockets, pictures or time to pass, so two at a time for each processor use it better than one.
say "running the tests (recordings: ${SONARD_CAPTURES:-none, set SONARD_CAPTURES to a folder of them})"
timed "tests" ctest --test-dir build/release --parallel "${SONARD_TEST_JOBS:-$(($(nproc) * 2))}" --output-on-failure --no-tests=error \
  --output-junit "$PWD/build/release/tests.xml" "$@" </dev/null
status=$?
# The figures of the oracles of docs/acoustics.md. A run of only some tests need not have figures for all of them.
partial=()
[ $# -eq 0 ] || partial=(--partial)
say "the oracles of the acoustic model"
python3 tests/oracles/oracle_table.py build/release/oracles "${partial[@]}" || [ $status -ne 0 ] || status=1
if [ -n "$long" ]; then
  before_long=$status
  tests/tools/long_checks.sh || status=1
  echo "tests: $([ "$before_long" -eq 0 ] && echo passed || echo "FAILED, see above")"
fi
exit $status
