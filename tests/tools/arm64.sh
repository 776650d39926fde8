#!/usr/bin/env bash
# Builds sonard for 64-bit ARM on an amd64 Debian 12 and tests it under qemu-user, which takes about an hour; not part of .ci/run.
# usage: tests/tools/arm64.sh [--root DIR] [STEP...]
#   --root DIR  uses a separate Debian 12 system in DIR, which mmdebstrap makes if it is missing, and a clone of the last commit.
#               Without it the step setup adds the architecture arm64 to dpkg of this system and installs libraries of arm64. For
#               these apt may remove libraries of amd64, so use it in a bare system or a container.
#   STEP        setup, build, test, threads, demo, package; all in this order by default. setup and --root need root.
# The results are in build/arm64 (with --root in that folder below DIR/srv/sonard).
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh
# shellcheck source=tests/tools/bare_root.sh
. tests/tools/bare_root.sh
folder=build/arm64
emulated=$folder/emulated  # commands of this machine that run the programs

usage() { sed -n '2,8s/^# //p' "$0"; }
root=
case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  --root) root=${2:?--root DIR}; shift 2 ;;
esac
[ $# -gt 0 ] || set -- setup build test threads demo package
for step in "$@"; do
  case $step in setup | build | test | threads | demo | package) ;; *) usage >&2; exit 64 ;; esac
done
if [ -n "$root" ]; then
  make_bare_root bookworm "$root" || exit
  [[ " $* " != *" setup "* ]] || clone_into "$root" || exit
  in_root "$root" /srv/sonard/tests/tools/arm64.sh "$@"
  exit
fi

# Programs that run here come from amd64 packages, libraries from arm64 packages. "all" packages have one form.
setup() {
  [ "$(dpkg --print-architecture)" = amd64 ] || { echo "this script cross-builds on amd64; here ./run.sh builds" >&2; return 69; }
  local name names=(crossbuild-essential-arm64 qemu-user dpkg-dev file)
  dpkg --add-architecture arm64 && apt-get -q update || return 69
  for name in "${build_packages[@]}"; do
    case $name in
      g++) continue ;;
      cmake | ninja-build | python3 | protobuf-compiler) ;;
      *) [[ $(apt-cache show --no-all-versions "$name") == *'Architecture: all'* ]] || name+=:arm64 ;;
    esac
    names+=("$name")
  done
  DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends install "${names[@]}" "${page_packages[@]}" </dev/null
}

# Lists the tests of core, protocol, all makes and the emulator, without programs that repeat a stage many times to measure a
# figure.
tested() {
  awk -v folder="$PWD/$folder/" 'index($2, folder) == 1 && $1 ~ /^GTEST/ && $1 !~ /FIGURES/ {print substr($2, length(folder) + 1)}' \
    "$folder/tests/programs" | grep -E '^tests/(core|protocol|example_make)/|^tests/daemon/daemon_emulator_test$'
}

build_all() {
  local tests
  cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_TOOLCHAIN_FILE=tests/tools/arm64.cmake \
    -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" -DSONAR_WERROR="${SONAR_WERROR:-OFF}" >/dev/null </dev/null || return
  mapfile -t tests < <(tested)
  [ ${#tests[@]} -gt 0 ] || { echo "$folder has no tests to build" >&2; return 66; }
  NINJA_STATUS="[%f/%t] " cmake --build "$folder" --parallel "$(build_jobs)" --target installed "${tests[@]}" </dev/null |
    tests/tools/build_progress.py
  [ "${PIPESTATUS[0]}" = 0 ] && qemu-aarch64 "$folder/daemon/sonard" --version
}

make_commands() {
  local program
  for program in daemon/sonard clients/sonarctl importer/sonard-import-mesh; do
    mkdir -p "$emulated/${program%/*}"
    printf '#!/bin/sh\nexec qemu-aarch64 "%s/%s" "$@"\n' "$PWD/$folder" "$program" >"$emulated/$program"
    chmod +x "$emulated/$program"
  done
}

# Emulated programs also start the importer of meshes as a command of this machine.
export SONARD_IMPORT_MESH=$PWD/$emulated/importer/sonard-import-mesh

# If a program is missing, qemu-user starts nevertheless and ends with code 127.
export GTEST_FILTER=-ChildProcess.AProgramThatIsNotThereIsNamed:HostileMeshes.WithoutTheImporterTheSentenceSaysWhatIsMissing

# Runs each program as four shards, so that the longest one uses all processors. Prints one line for each shard that passes, and the
# whole output of each that fails.
run_tests() {
  local program programs
  make_commands
  mapfile -t programs < <(tested)
  [ -x "$folder/${programs[0]:-none}" ] || { echo "no tests in $folder: run the step build first" >&2; return 66; }
  for program in "${programs[@]}"; do printf '%s\0' "$program" 0 "$program" 1 "$program" 2 "$program" 3; done |
    xargs -0 -n 2 -P "${SONARD_TEST_JOBS:-$(nproc)}" bash -c '
    started=$SECONDS
    output=$(GTEST_TOTAL_SHARDS=4 GTEST_SHARD_INDEX=$1 timeout 3600 qemu-aarch64 "'"$folder"'/$0" --gtest_brief=1 2>&1 </dev/null)
    code=$?
    if [ $code = 0 ]; then
      printf "%s %d/4: %s, %d s\n" "${0##*/}" "$(($1 + 1))" "$(tail -n 1 <<<"$output")" $((SECONDS - started))
    else
      [ $code != 124 ] || output+="stopped after 3600 s"
      printf "%s %d/4 FAILED\n%s\n" "$0" "$(($1 + 1))" "$output"
      exit 1
    fi'
}

# Checks that pings have the same bytes on one, two and four threads.
threads() {
  local n
  make_commands
  for n in 1 2 4; do
    rm -rf "$folder/threads-$n"
    qemu-aarch64 "$folder/daemon/sonard" render scenes/sonard.yaml --out "$folder/threads-$n" --pings 2 --format npy --threads $n &&
      (cd "$folder/threads-$n" && sha256sum -- *.npy) >"$folder/threads-$n.sums" && [ -s "$folder/threads-$n.sums" ] &&
      cmp "$folder/threads-1.sums" "$folder/threads-$n.sums" || return
  done
  echo "two pings: the same bytes on 1, 2 and 4 threads"
}

demo() { make_commands && SONARD_DEMO_SLOWNESS=60 tests/tools/check_demo.sh "$emulated" "$folder/demo.png"; }

package() { (cd "$folder" && cpack -G DEB >/dev/null && ls -1 "$PWD"/*_arm64.deb); }

failed=()
for step in "$@"; do
  say "arm64: $step"
  case $step in
    setup) setup || exit ;;
    build) build_all || exit ;;
    test) run_tests || failed+=(test) ;;
    *) "$step" || failed+=("$step") ;;
  esac
done
[ ${#failed[@]} -eq 0 ] || { printf '\narm64 FAILED: %s\n' "${failed[*]}" >&2; exit 1; }
