#!/usr/bin/env bash
# Builds tests with sanitizers and runs them. usage: tests/tools/sanitized_tests.sh [--build] [asan|asan-all|tsan] [targets...]
#   --build   only builds them
#   asan      address and undefined behaviour: the code that reads foreign bytes or files in the daemon and below it, the ray tracer,
#             the core of the BlueView libraries, and the fuzz targets over their seeds and made-up inputs; the default, and part
#             of .ci/run.
#             Engines, their choice and their turns are left out, because they read no foreign data
#   asan-all  the same over the whole functional suite, including the shipped programs and the BlueView call sequences
#   tsan      threads: protocol, control, daemon, clients, the BlueView call sequences, the pool, and the CPU pipeline over analytic
#             rays in place of Embree, alone (core_analytic_rays_test) and under a whole daemon (daemon_analytic_test)
# With targets it runs only those test programs. Reports are in the output; the exit status is 1 if there was any. Figures of
# sanitized programs are not stored; SONARD_RELIABILITY gets only one line with the result of the whole run.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

only_build=
if [ "${1:-}" = --build ]; then only_build=1; shift; fi
kind=asan
case "${1:-}" in
  asan | asan-all | tsan) kind=$1; shift ;;
  -h | --help) sed -n '2,12s/^# //p' "$0"; exit 0 ;;
esac
preset=${kind%-all}

# ctest runs the shipped programs. These tests are omitted, for these reasons:
#   render, determinism, reproducibility, mission, picture, capture_comparison, trajectory   compute for long; rendering, pictures,
#                                                      recordings and replays are covered by the test programs
#   service, package, container                        check unit, archive and image files, not a program of ours at run time
#   bench, demo                                        measure speed and memory of the same engine as the others
#   load.descriptors                                   the undefined behaviour sanitizer reads memory through a pipe, and reports
#                                                      every object as invalid if no descriptor is left for the pipe
#   the Python client alone and without numpy          they run no program of ours
acceptance=(commands protocol mirror blueview_link aris_link waterlinked_link ping_link ping_tools life_cycle control reload status fault doctor view completion scene_command
  dissector driver_example first_minutes recording live_view)
programs="^acceptance\.($(IFS='|'; echo "${acceptance[*]}"))\$"
programs+='|^load\.real_pings$|^python_client\.with_daemon$|^bvtsdk\.sequences$'
[ "$kind" != tsan ] || programs='^bvtsdk\.sequences$'

need_packages "${build_packages[@]}" && configure_sanitized "$preset" || exit
targets=("$@")
more=()
if [ ${#targets[@]} -eq 0 ]; then
  case $kind in  # the kinds of tests/CMakeLists.txt
    asan) kinds=(SANITIZED) ;;
    asan-all) kinds=(GTEST LOAD SANITIZED --without FIGURES) ;;
    tsan) kinds=(THREADS) ;;
  esac
  mapfile -t targets < <(tests/tools/run_programs.py "build/$preset" --list "${kinds[@]}")
  [ "$kind" = asan ] || more=(sonard sonarctl dump_oculus bvtsdk_programs in_own_network)
fi
[ ${#targets[@]} -gt 0 ] || { echo "no test program is of kind $kind" >&2; exit 1; }
timed "sanitizers: build" build "$preset" "${targets[@]}" "${more[@]}" || exit
[ -z "$only_build" ] || exit 0

figures=${SONARD_RELIABILITY:-}
unset SONARD_RELIABILITY
# A refused huge length must not be a sanitizer's failure. Suppressions: third-party libraries only, with their reasons.
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1
export LSAN_OPTIONS="suppressions=$PWD/tests/tools/lsan.supp"
export UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS="halt_on_error=1:second_deadlock_stack=1:suppressions=$PWD/tests/tools/tsan.supp"

failed=()
started=$SECONDS
timed "sanitizers: tests" tests/tools/run_programs.py "build/$preset" "${targets[@]}" || failed+=("test programs")
if [ ${#more[@]} -gt 0 ]; then
  ctest --test-dir "build/$preset" -R "$programs" --output-on-failure --no-tests=error </dev/null || failed+=("shipped programs")
fi

printf '\n%d test programs under %s in %d s: %s\n' ${#targets[@]} "$kind" $((SECONDS - started)) "$([ ${#failed[@]} -eq 0 ] && echo passed || echo FAILED)"
if [ ${#more[@]} -gt 0 ]; then
  SONARD_RELIABILITY=$figures python3 tests/reliability/record.py "$preset" \
    "${#targets[@]} test programs and the shipped ones, reports of: ${failed[*]:-none}" "no report" \
    "$([ ${#failed[@]} -eq 0 ] && echo yes || echo no)" "tests/tools/sanitized_tests.sh $kind"
fi
[ ${#failed[@]} -eq 0 ]
