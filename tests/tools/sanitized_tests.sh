#!/usr/bin/env bash
# Builds tests with sanitizers and runs them. usage: tests/tools/sanitized_tests.sh [asan|asan-all|tsan] [targets...]
#   asan      address and undefined behaviour: what reads foreign bytes or files in the daemon and below it, the ray tracer, the core
#             of the BlueView libraries, and the fuzz targets over their seeds and made-up inputs; the default, and what .ci/run does
#   asan-all  the same over the whole functional suite, the shipped programs and the BlueView call sequences among it
#   tsan      threads: protocol, control, daemon, clients, the BlueView call sequences, the pool, and the CPU pipeline over analytic
#             rays in place of Embree, alone (analytic_rays_test) and under a whole daemon (daemon_analytic_test, with the daemon's)
# With targets only those test programs. Reports are in the output; the exit status is 1 when there was any. Figures of sanitized
# programs are kept nowhere: SONARD_RELIABILITY gets the one line that says how all this ended.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

kind=asan
case "${1:-}" in
  asan | asan-all | tsan) kind=$1; shift ;;
  -h | --help) sed -n '2,9s/^# //p' "$0"; exit 0 ;;
esac
preset=${kind%-all}

# Paths under tests/ of what runs, and of what does not.
left_out='^$'
case $kind in
  asan)
    wanted='^tests/(protocol|daemon)/.*_test$|^tests/core/(text|motion)/.*_test$|/core_(load_scene|shapes|ray_scene)_test$|/bvtsdk_core_test$|^tests/fuzz/.*_fuzz$'
    # What reads nothing foreign: engines, their choice and their turns, and command lines.
    left_out='/daemon_(analytic|command_line|engine)_test$'
    ;;
  asan-all)
    wanted='^tests/.*(_test|_fuzz)$'
    # What computes for long. The stages it sounds are run by the other tests of its folder; these repeat them over thousands of
    # pings, or over every product, to measure a figure.
    left_out='/(everything|coverage_oracles|statistics_oracles|specular_statistics|stage_oracles|texture|multipath_cells|truths)_test$'
    ;;
  tsan) wanted='^tests/(protocol|daemon|clients)/.*_test$|/base_test$|/analytic_rays_test$' ;;
esac
# Through ctest: the shipped programs. Not among them, with the reasons:
#   render, determinism, reproducibility, mission, picture, capture_comparison, trajectory   compute for long; rendering, pictures,
#                                                      recordings and what is played are sounded by the test programs
#   service, package, container                        judge unit, archive and image files, not a program of ours at run time
#   bench, demo                                        measure speed and memory, by the same engine as the others
#   load.descriptors                                   the undefined behaviour sanitizer looks at memory through a pipe, and takes
#                                                      every object for a bad one when there is no descriptor left for it
#   the Python client alone and without numpy          no program of ours takes part
acceptance=(commands protocol mirror blueview_link aris_link waterlinked_link ping_link life_cycle control reload status fault doctor view completion scene_command
  dissector driver_example first_minutes recording live_view)
programs="^acceptance\.($(IFS='|'; echo "${acceptance[*]}"))\$"
programs+='|^load\.real_pings$|^python_client\.with_daemon$|^bvtsdk\.sequences$'
[ "$kind" != tsan ] || programs='^bvtsdk\.sequences$'

need_packages "${build_packages[@]}" && configure "$preset" || exit
targets=("$@")
more=()
if [ ${#targets[@]} -eq 0 ]; then
  mapfile -t targets < <(ninja -C "build/$preset" -t targets all | sed -n 's/: CXX_EXECUTABLE_LINKER.*//p' |
    grep -E "$wanted" | grep -vE "$left_out")
  [ "$kind" = asan ] || more=(sonard sonarctl dump_oculus bvtsdk_programs in_own_network)
fi
[ ${#targets[@]} -gt 0 ] || { echo "no test program matches $wanted" >&2; exit 1; }
build "$preset" "${targets[@]}" "${more[@]}" || exit

figures=${SONARD_RELIABILITY:-}
unset SONARD_RELIABILITY
# A refused huge length must not be a sanitizer's failure. Suppressions: third-party libraries only, with their reasons.
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1
export LSAN_OPTIONS="suppressions=$PWD/tests/tools/lsan.supp"
export UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS="halt_on_error=1:second_deadlock_stack=1:suppressions=$PWD/tests/tools/tsan.supp"

failed=()
started=$SECONDS
for i in "${!targets[@]}"; do
  name=${targets[$i]##*/}
  program=$(find "build/$preset" -name "$name" -type f -perm -u+x | head -n 1)
  echo "-- [$((i + 1))/${#targets[@]}] $name"
  case $name in
    *_fuzz)
      input=${name%_fuzz}
      given=(-runs=20000)
      [ "$input" != mesh_file ] || given=(-runs=200)  # the importer takes a hundred times as long as the rest
      [ -f "tests/fuzz/dictionaries/$input.dict" ] && given+=("-dict=tests/fuzz/dictionaries/$input.dict")
      [ -d "tests/fuzz/corpus/$input" ] && given+=("tests/fuzz/corpus/$input")
      "$program" "${given[@]}" || failed+=("$name")
      ;;
    load_test) "$program" --quick --gtest_brief=1 </dev/null || failed+=("$name") ;;
    *) "$program" --gtest_brief=1 </dev/null || failed+=("$name") ;;
  esac
done
if [ ${#more[@]} -gt 0 ]; then
  ctest --test-dir "build/$preset" -R "$programs" --output-on-failure --no-tests=error </dev/null || failed+=("programs")
fi

printf '\n%d programs under %s in %d s, failed: %s\n' ${#targets[@]} "$kind" $((SECONDS - started)) "${failed[*]:-none}"
if [ ${#more[@]} -gt 0 ]; then
  SONARD_RELIABILITY=$figures python3 tests/reliability/record.py "$preset" \
    "${#targets[@]} test programs and the shipped ones, ${#failed[@]} with a report" "no report" \
    "$([ ${#failed[@]} -eq 0 ] && echo yes || echo no)" "tests/tools/sanitized_tests.sh $kind"
fi
[ ${#failed[@]} -eq 0 ]
