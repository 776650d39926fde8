#!/usr/bin/env bash
# Runs libFuzzer on every target, or on those named, one after the other. usage: tests/tools/fuzz.sh [NAME...]
#   SONARD_FUZZ_RUNS     inputs for each target (500000)
#   SONARD_FUZZ_SECONDS  the longest for each (900)
# What was found worth keeping stays in build/fuzz/corpus/NAME; an input that ends a target, in build/fuzz/findings/NAME: put it
# into tests/fuzz/corpus/NAME with the fix, and every test run from then on tries it.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

runs=${SONARD_FUZZ_RUNS:-500000}
longest=${SONARD_FUZZ_SECONDS:-900}

need_packages "${build_packages[@]}" clang-14 libclang-rt-14-dev && configure fuzz && build fuzz fuzz_targets || exit
names=("$@")
if [ ${#names[@]} -eq 0 ]; then
  mapfile -t names < <(ninja -C build/fuzz -t targets all | sed -n 's/: CXX_EXECUTABLE_LINKER.*//p' | sed -n 's,^tests/fuzz/\(.*\)_fuzz$,\1,p')
fi
[ ${#names[@]} -gt 0 ] || { echo "no fuzz target" >&2; exit 1; }

# figure NAME LOG: one number of libFuzzer's last words.
figure() { sed -n "s/^stat::$1: *//p" "$2" | tail -n 1; }

failed=()
rows=()
for i in "${!names[@]}"; do
  name=${names[$i]}
  corpus=build/fuzz/corpus/$name findings=build/fuzz/findings/$name log=build/fuzz/$name.log
  mkdir -p "$corpus" "$findings"
  # The importer of mesh files takes a hundred times as long as the rest.
  bound=$([ "$name" = mesh_file ] && echo $((runs / 100)) || echo "$runs")
  given=(-runs="$bound" -max_total_time="$longest" -timeout=20 -rss_limit_mb=2560 -entropic=0 -print_final_stats=1
    -artifact_prefix="$findings/")
  [ -f "tests/fuzz/dictionaries/$name.dict" ] && given+=("-dict=tests/fuzz/dictionaries/$name.dict")
  given+=("$corpus")
  [ -d "tests/fuzz/corpus/$name" ] && given+=("tests/fuzz/corpus/$name")
  echo "-- [$((i + 1))/${#names[@]}] $name"
  before=$SECONDS
  "build/fuzz/tests/fuzz/${name}_fuzz" "${given[@]}" >"$log" 2>&1 </dev/null
  status=$?
  tried=$(figure number_of_executed_units "$log")
  told="${tried:-0} inputs in $((SECONDS - before)) s, $(grep -oE 'cov: [0-9]+' "$log" | tail -n 1 | cut -d' ' -f2) places reached"
  if [ $status -ne 0 ]; then
    failed+=("$name")
    told="FAULT, input kept in $findings; $told"
    tail -n 40 "$log"
  elif [ "${tried:-0}" -lt "$bound" ]; then
    told="$told, fewer than $bound: raise SONARD_FUZZ_SECONDS"
  fi
  echo "   $told"
  rows+=("$(printf '%-20s %s' "$name" "$told")")
  python3 tests/reliability/record.py "fuzz-$name" "${tried:-0}$([ $status -eq 0 ] || echo ', with a fault')" "$bound" \
    "$([ $status -eq 0 ] && [ "${tried:-0}" -ge "$bound" ] && echo yes || echo no)" "tests/tools/fuzz.sh $name"
done
say "fuzz targets"
printf '%s\n' "${rows[@]}"
[ ${#failed[@]} -eq 0 ]
