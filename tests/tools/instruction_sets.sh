#!/usr/bin/env bash
# Runs the ray, pipeline and cell tests as older processors would: SONARD_SIMD limits the hot loops, SONARD_EMBREE_ISA limits the
# ray tracer. usage: tests/tools/instruction_sets.sh [BUILD_FOLDER [SIMD:EMBREE_ISA...]]
#   BUILD_FOLDER     default build/release; its tests must be built
#   SIMD:EMBREE_ISA  default: avx2:avx2 where the processor has AVX-512, and portable:sse4.2. Embree's packets then have
#                    8 and 4 rays; with AVX-512 they have 16.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
case "${1:-}" in
  -h | --help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
esac
build=${1:-build/release}
[ $# -eq 0 ] || shift
if [ $# -eq 0 ]; then
  set -- portable:sse4.2
  ! grep -qw avx512f /proc/cpuinfo 2>/dev/null || set -- avx2:avx2 "$@"
fi

# The programs of kind LEVELS (tests/CMakeLists.txt). They exclude programs that measure a figure over thousands of pings or over
# all products, and programs whose cases select the instruction set.
mapfile -t programs < <(tests/tools/run_programs.py "$build" --list LEVELS)
[ ${#programs[@]} -gt 0 ] || exit 66
unset SONARD_ORACLES SONARD_RELIABILITY  # only figures with the full instruction set are recorded

started=$SECONDS
failed=0
for level in "$@"; do
  export SONARD_SIMD=${level%%:*} SONARD_EMBREE_ISA=${level#*:}
  printf -- '-- %d programs, hot loops %s, Embree %s\n' ${#programs[@]} "$SONARD_SIMD" "$SONARD_EMBREE_ISA"
  SONARD_TEST_SECONDS=600 tests/tools/run_programs.py "$build" "${programs[@]}" || failed=1
done
printf '\n%d programs at %d levels in %d s: %s\n' ${#programs[@]} $# $((SECONDS - started)) "$([ $failed -eq 0 ] && echo passed || echo FAILED)"
exit $failed
