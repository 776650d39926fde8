#!/usr/bin/env bash
# Runs libFuzzer on every target, or on the named ones, one for each processor at a time. usage: tests/tools/fuzz.sh [NAME...]
#   SONARD_FUZZ_RUNS     inputs for each target (500000)
#   SONARD_FUZZ_SECONDS  time limit of each target (900); a target that reaches it is reported as SHORT and fails
# Useful inputs are kept in build/fuzz/corpus/NAME. An input that ends a target is kept in build/fuzz/findings/NAME; copy it to
# tests/fuzz/corpus/NAME with the fix, so that every later test run tries it.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

runs=${SONARD_FUZZ_RUNS:-500000}
longest=${SONARD_FUZZ_SECONDS:-900}

need_packages "${build_packages[@]}" "${clang_packages[@]}" && configure fuzz && build fuzz fuzz_targets || exit
names=("$@")
if [ ${#names[@]} -eq 0 ]; then
  mapfile -t names < <(ninja -C build/fuzz -t targets all | sed -n 's/: CXX_EXECUTABLE_LINKER.*//p' | sed -n 's,^tests/fuzz/\(.*\)_fuzz$,\1,p')
fi
[ ${#names[@]} -gt 0 ] || { echo "no fuzz target" >&2; exit 1; }

# Leaks of third-party libraries are no findings; the file gives the reason for each.
export LSAN_OPTIONS="suppressions=$PWD/tests/tools/lsan.supp"

# figure NAME LOG: prints one number of libFuzzer's final statistics.
figure() { sed -n "s/^stat::$1: *//p" "$2" | tail -n 1; }

# one NAME PLACE: runs the target, prints its result at once and writes it to NAME.result. Returns 1 after a fault, or if there
# were fewer inputs than the bound.
one() {
  local name=$1 corpus=build/fuzz/corpus/$1 findings=build/fuzz/findings/$1 log=build/fuzz/$1.log
  local result tried status before=$SECONDS
  mkdir -p "$corpus" "$findings"
  local bound=$runs promised=500000 words=500,000 patience=20
  if [ "$name" = mesh_file ]; then
    bound=$((runs / 100)) patience=700 promised=5000 words="5,000: the importer takes a hundred times as long"
  elif [ "$name" = conversations ]; then
    bound=$((runs / 10)) promised=50000 words="50,000: each is minutes of a sonar's time"
  fi
  local given=(-runs="$bound" -max_total_time="$longest" -timeout="$patience" -rss_limit_mb=2560 -entropic=0 -print_final_stats=1
    -artifact_prefix="$findings/")
  [ -f "tests/fuzz/dictionaries/$name.dict" ] && given+=("-dict=tests/fuzz/dictionaries/$name.dict")
  given+=("$corpus")
  [ -d "tests/fuzz/corpus/$name" ] && given+=("tests/fuzz/corpus/$name")
  "build/fuzz/tests/fuzz/${name}_fuzz" "${given[@]}" >"$log" 2>&1 </dev/null &
  # shellcheck disable=SC2064  # expands $! now, to the process of this target
  trap "kill $! 2>/dev/null; exit 1" TERM
  wait $!
  status=$?
  tried=$(figure number_of_executed_units "$log")
  tried=${tried:-0}
  result="$tried inputs in $((SECONDS - before)) s, $(grep -oE 'cov: [0-9]+' "$log" | tail -n 1 | cut -d' ' -f2) places reached"
  local verdict=0 ending=
  if [ $status -ne 0 ]; then
    result="FAULT, input kept in $findings; $result" ending=$(tail -n 40 "$log")$'\n' verdict=1
  elif [ "$tried" -lt "$bound" ]; then
    result="SHORT of $bound, raise SONARD_FUZZ_SECONDS; $result" verdict=1
  fi
  printf '%-20s %s\n' "$name" "$result" >"build/fuzz/$name.result"
  printf '%s-- [%s] %s\n   %s\n' "$ending" "$2" "$name" "$result"
  # The table compares with the promised bounds, not with the values requested here.
  python3 tests/reliability/record.py "fuzz-$name" "$tried$([ $status -eq 0 ] || echo ', with a fault')" "$words" \
    "$([ $status -eq 0 ] && [ "$tried" -ge "$promised" ] && echo yes || echo no)" "tests/tools/fuzz.sh $name"
  return $verdict
}

failed=0
running=0
trap 'kill $(jobs -p) 2>/dev/null; exit 130' INT TERM  # background jobs do not receive Ctrl-C
ended() { wait -n || failed=$((failed + 1)); running=$((running - 1)); }
for i in "${!names[@]}"; do
  [ $running -lt "$(nproc)" ] || ended
  rm -f "build/fuzz/${names[$i]}.result"
  one "${names[$i]}" "$((i + 1))/${#names[@]}" &
  running=$((running + 1))
done
while [ $running -gt 0 ]; do ended; done
say "fuzz targets"
for name in "${names[@]}"; do cat "build/fuzz/$name.result"; done
[ $failed -eq 0 ] || { echo "$failed of ${#names[@]} targets had a fault or tried too few inputs"; exit 1; }
