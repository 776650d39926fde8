#!/usr/bin/env bash
# Finds tests that fail sometimes: repeats tests in random order, 8 at a time, with a busy loop on each processor.
# usage: tests/tools/repeat_tests.sh [RUNS [ctest arguments...]]      3 runs; build/release, or the folder in SONARD_BUILD
# The last lines name each test that failed in any run, and nothing else. Output of each run: BUILD/repeat/run-N.log.
# SONARD_BUSY_LOOPS: the number of busy loops; default: one for each processor.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
case "${1:-}" in
  -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;;
esac
runs=3
if [[ "${1:-}" =~ ^[1-9][0-9]*$ ]]; then
  runs=$1
  shift
fi
build=${SONARD_BUILD:-build/release}
logs=$build/repeat
mkdir -p "$logs" && rm -f "$logs"/run-*.log || exit 73

busy=()
trap 'kill "${busy[@]}" 2>/dev/null' EXIT
for ((i = 0; i < ${SONARD_BUSY_LOOPS:-$(nproc)}; i++)); do
  while :; do :; done &
  busy+=($!)
done

status=0
for ((run = 1; run <= runs; run++)); do
  started=$SECONDS
  ctest --test-dir "$build" --schedule-random --parallel 8 --output-on-failure --no-tests=error "$@" </dev/null >"$logs/run-$run.log" 2>&1 || status=1
  result=$(grep -E '^[0-9]+% tests passed' "$logs/run-$run.log") || { tail -n 5 "$logs/run-$run.log" >&2; exit 1; }
  printf 'run %d of %d: %s, %d s, load %s\n' "$run" "$runs" "$result" $((SECONDS - started)) "$(cut -d' ' -f1 /proc/loadavg)"
done

if [ $status -eq 0 ]; then
  echo "no test failed in $runs runs"
  exit 0
fi
# ctest ends with a list of lines such as "	 12 - acceptance.control (Timeout)".
awk -v runs="$runs" '
  FNR == 1 { listed = 0 }
  /^The following tests FAILED:/ { listed = 1; next }
  listed && /^[ \t]+[0-9]+ - / {
    sub(/^[ \t]+[0-9]+ - /, ""); sub(/ \([^()]*\)[^()]*$/, "")
    if (!count[$0]++) first[$0] = FILENAME
  }
  END { for (name in count) printf "FAILED in %d of %d runs: %s (%s)\n", count[name], runs, name, first[name] }' "$logs"/run-*.log | sort
exit 1
