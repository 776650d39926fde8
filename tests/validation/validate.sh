#!/usr/bin/env bash
# Makes docs/validation.md and its pictures anew: builds sonard, renders the experiments, under fifteen minutes on two cores.
# usage: tests/validation/validate.sh [--partial] [--only CHAPTER ...]
# Chapters: tank two-cylinders local-search differences coverage cost parts capture oracles. Costs want a machine that does nothing else.
# The table of oracles is that of the last ./test.sh, whole, or --partial says that part of it will do; the captured ping needs
# SONARD_CAPTURES. What has no data keeps its chapter.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

case "${1:-}" in
  -h | --help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
esac

# A Python that lies in front of the system's does not see the system's packages.
python_with_matplotlib() {
  local candidate
  for candidate in python3 /usr/bin/python3; do
    "$candidate" -c 'import matplotlib, numpy, PIL' 2>/dev/null && echo "$candidate" && return
  done
  return 1
}
if ! python=$(python_with_matplotlib); then
  need_packages python3-matplotlib python3-pil || exit
  python=$(python_with_matplotlib) || { echo "no python3 that finds matplotlib, numpy and PIL" >&2; exit 69; }
fi
if [ -z "${SONARD_PROGRAM:-}" ]; then
  setup_and_build sonard || exit
  SONARD_PROGRAM=build/release/daemon/sonard
fi
say "validation"
exec "$python" tests/validation/validate.py --program "$SONARD_PROGRAM" --oracles "${SONARD_ORACLES:-build/release/oracles}" "$@"
