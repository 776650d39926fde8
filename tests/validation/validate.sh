#!/usr/bin/env bash
# Builds sonard, renders the experiments, and writes tables and pictures of the validation into build/validation, and the summary
# docs/validation.md. usage: tests/validation/validate.sh [--partial] [--only CHAPTER ...] | --summary
# Chapters: tank pitched-sonar two-cylinders local-search differences coverage cost parts capture tell-apart oracles.
# Costs need an otherwise idle machine.
# Takes under fifteen minutes on two cores; --summary rewrites the summary from the tables in a moment. The table of oracles is
# from the last ./test.sh, and must be complete unless --partial is given; capture and tell-apart need SONARD_CAPTURES. Chapters
# without data are kept; the summary is written if all chapters exist, else the exit code is 1.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

case "${1:-}" in
  -h | --help) sed -n '2,8s/^# //p' "$0"; exit 0 ;;
  --summary) exec python3 tests/validation/validate.py --summary ;;
esac

# The first Python in PATH may not find the system's packages.
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
# Only the classifier needs sklearn; without it that chapter is skipped.
if [ -n "${SONARD_CAPTURES:-}" ] && ! "$python" -c 'import sklearn' 2>/dev/null; then
  need_packages python3-sklearn || echo "continuing without python3-sklearn"
fi
if [ -z "${SONARD_PROGRAM:-}" ]; then
  setup_and_build sonard sonard_bench || exit
  SONARD_PROGRAM=build/release/daemon/sonard
fi
say "validation"
exec "$python" tests/validation/validate.py --program "$SONARD_PROGRAM" --oracles "${SONARD_ORACLES:-build/release/oracles}" "$@"
