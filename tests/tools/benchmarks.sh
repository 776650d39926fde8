#!/usr/bin/env bash
# Runs the benchmarks and writes docs/benchmarks.md with its pictures. Its detailed tables go to the build folder.
# usage: tests/tools/benchmarks.sh [--instruction-sets] [BUILD_FOLDER]
#   --instruction-sets  only that chapter of the tables: the rates with this processor's instruction sets and smaller ones
# Needs an otherwise idle machine and ten to fifteen minutes. BUILD_FOLDER (default build/release) must hold a built sonard.
set -eu -o pipefail
cd "$(dirname "$0")/../.." || exit 70
case "${1:-}" in
  -h | --help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
esac
sets_only=
if [ "${1:-}" = --instruction-sets ]; then
  sets_only=1
  shift
fi
build=${1:-build/release}
bench=$build/tests/bench/sonard_bench
[ -x "$bench" ] || { echo "no $bench; build it first, or name another build folder" >&2; exit 66; }
threads=$(nproc)
each=(--threads "$threads")
[ "$threads" = 1 ] || each=(--threads 1 --threads "$threads")

# The hot loops (--simd) and the ray tracer (SONARD_EMBREE_ISA) are limited together, from the best instruction set of this
# processor down.
levels=(avx2:avx2 portable:sse4.2)
! grep -qw avx512f /proc/cpuinfo 2>/dev/null || levels=(avx512:avx512 "${levels[@]}")
sets=()
for level in "${levels[@]}"; do
  sets+=("$build/benchmarks-${level%%:*}.json")
  SONARD_EMBREE_ISA=${level#*:} "$bench" --simd "${level%%:*}" --scene local-search --threads "$threads" --pings 200 \
    --case P1 --case P2 --case P3a --case P3b --case P3c --case P3d --case P4a --case P4b --json "${sets[-1]}"
done
if [ -n "$sets_only" ]; then
  python3 tests/bench/write_benchmarks.py --instruction-sets "${sets[@]}" "$build"
else
  json=$build/benchmarks.json
  # A missed ratio (exit code 1) is shown in the page; any other failure ends the script. Demos have ports below 1024, which are
  # allowed in a separate network.
  "$build/tests/own_network/in_own_network" "$bench" --scene local-search "${each[@]}" --pings 200 --curves --json "$json" || [ $? -eq 1 ]
  python3 tests/bench/write_benchmarks.py "$json" "${sets[@]}" docs "$build"
fi
echo "docs/benchmarks.md is written; tables and results are in $build/benchmarks*"
