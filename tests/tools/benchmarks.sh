#!/usr/bin/env bash
# Measures everything that docs/benchmarks.md says and writes it, with its pictures. usage: tests/tools/benchmarks.sh [BUILD_FOLDER]
# Wants a quiet machine; takes five to ten minutes. BUILD_FOLDER (default build/release) must hold a built sonard.
set -eu -o pipefail
cd "$(dirname "$0")/../.." || exit 70
build=${1:-build/release}
sonard=$build/daemon/sonard
[ -x "$sonard" ] || { echo "no $sonard; build it first, or name another build folder" >&2; exit 66; }
threads=$(nproc)
each=(--threads "$threads")
[ "$threads" = 1 ] || each=(--threads 1 --threads "$threads")
json=$build/benchmarks.json
# A ratio that is missed (exit code 1) is in the page; anything else ends here.
"$sonard" bench --scene local-search "${each[@]}" --pings 200 --curves --json "$json" || [ $? -eq 1 ]
python3 tests/bench/write_benchmarks.py "$json" docs
echo "docs/benchmarks.md is written; figures are in $json"
