#!/usr/bin/env bash
# Builds the tests of everything that reads foreign bytes or files, and of the daemon, with the address and undefined-behaviour
# sanitizers, and runs them. usage: tests/tools/sanitized_tests.sh [targets...]; the default is the list below.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

# Paths under tests/ that run here; what only computes is left to the release build.
wanted='^tests/(protocol|daemon|clients)/|^tests/core/text/|/core_load_scene_test|/core_shapes_test'

need_packages "${build_packages[@]}" && configure asan || exit
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  mapfile -t targets < <(ninja -C build/asan -t targets all | sed -n 's/: CXX_EXECUTABLE_LINKER.*//p' | grep -E "$wanted" | grep '_test$')
fi
[ ${#targets[@]} -gt 0 ] || { echo "no test program matches $wanted" >&2; exit 1; }
build asan "${targets[@]}" || exit

failed=0
for target in "${targets[@]}"; do
  program=$(find build/asan -path "*/${target##*/}" -type f -perm -u+x | head -n 1)
  echo "-- ${target##*/}"
  # Allocation limits of the parsers' tests: a refused huge length must not be a sanitizer's failure.
  ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 "$program" --gtest_brief=1 || failed=1
done
exit $failed
