# Prepares a machine and builds: sourced by run.sh, test.sh and .ci/run, from the repository root. It is quick if nothing has
# changed.
# shellcheck shell=bash

# Packages that the programs need on Debian 12, 13 and Ubuntu 22.04, 24.04, and further packages that the build of the tests
# needs. All are in the main archives of these systems.
product_packages=(
  g++ cmake ninja-build python3 libboost-dev libembree-dev libtbb-dev libyaml-cpp-dev libassimp-dev libtinyxml2-dev libpng-dev libtiff-dev zlib1g-dev
  libexpected-dev libspdlog-dev libcli11-dev nlohmann-json3-dev libprotobuf-dev protobuf-compiler libfftw3-dev libsnappy-dev libnats-dev
)
build_packages=("${product_packages[@]}" libeigen3-dev libgtest-dev libgmock-dev)

# Sanitized programs and fuzzers are compiled with the system's clang (14 on Debian 12, 19 on Debian 13) and linked with lld.
# clang needs half to two thirds of g++'s time, and lld a quarter of the linking time, and two compilers check the code.
clang_packages=(clang libclang-rt-dev lld)

# Packages for the page of the live view; without them the daemon is built without the page.
page_packages=(esbuild libjs-three)

# Packages that only tests use. Without them some tests are skipped with a message.
test_packages=(
  tshark systemd dpkg-dev file strace python3-numpy python3-pil nats-server
)
browser_packages=(chromium)

say() { printf '\n== %s\n' "$*"; }

# timed NAME COMMAND...: runs the command and appends its duration in seconds to the file that SONARD_SECONDS names, for .ci/run.
timed() {
  local name=$1 from=$SECONDS status
  shift
  "$@"
  status=$?
  [ -z "${SONARD_SECONDS:-}" ] || printf '%6d s  %s\n' $((SECONDS - from)) "$name" >>"$SONARD_SECONDS"
  return $status
}

# begin_aside LOG COMMAND...: starts the command at the lowest priority; it ends with this shell.
begin_aside() {
  local log=$1
  shift
  set -m  # gives the command a separate process group
  nice -n 19 "$@" >"$log" 2>&1 </dev/null &
  aside=$!
  set +m
  trap 'kill -- "-$aside" 2>/dev/null' EXIT
}

# end_aside: waits for the command of begin_aside, at normal priority if that is allowed; returns its status.
end_aside() {
  renice -n 0 -g "$aside" >/dev/null 2>&1
  wait "$aside"
  local status=$?
  trap - EXIT
  return $status
}

# need_packages NAME...: installs missing packages with apt, with a message. If the archives lack some, it installs the rest,
# lists the lacking ones and fails.
need_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "not a Debian-like system: it must have the equivalents of these packages: $*"
    return 0
  fi
  local name missing=()
  for name in "$@"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null)" = installed ] || missing+=("$name")
  done
  [ ${#missing[@]} -gt 0 ] || return 0

  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || {
      echo "missing packages, and neither root nor sudo to install them. As root: apt-get install ${missing[*]}" >&2
      return 69
    }
    as_root=(sudo)
  fi
  say "installing ${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 update </dev/null
  local unknown=() known=()
  for name in "${missing[@]}"; do
    if [[ $(LC_ALL=C apt-cache policy "$name") =~ Candidate:\ [^\(] ]]; then known+=("$name"); else unknown+=("$name"); fi
  done
  [ ${#known[@]} -eq 0 ] || "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends \
    -o DPkg::Lock::Timeout=300 -o Acquire::Retries=3 -o Dpkg::Use-Pty=0 install "${known[@]}" </dev/null || {
    echo "apt-get could not install ${known[*]}: see its message above. Without a network, install them by hand" >&2
    return 69
  }
  [ ${#unknown[@]} -eq 0 ] || {
    echo "not in the package archives of this system: ${unknown[*]}. CONTRIBUTING.md lists other systems" >&2
    return 69
  }
}

# forget_figures: removes the figures that earlier runs left in the folder SONARD_RELIABILITY.
forget_figures() {
  [ "$(realpath -m "$SONARD_RELIABILITY")" != "$(realpath -m tests/reliability/by_hand)" ] || {
    echo "SONARD_RELIABILITY is tests/reliability/by_hand, whose figures no run can make again: name another folder" >&2
    return 64
  }
  rm -f "$SONARD_RELIABILITY"/*.json
}

# build_jobs: prints the number of parallel compilers. It is one per processor, but no more than fit into memory (a large file
# needs 1.2 GB).
build_jobs() {
  local processors memory_kb by_memory
  processors=$(nproc 2>/dev/null || echo 2)
  memory_kb=$(awk '/^MemAvailable:/ {print $2}' /proc/meminfo 2>/dev/null)
  by_memory=$((${memory_kb:-4000000} / 1200000))
  [ "$by_memory" -ge 1 ] || by_memory=1
  echo $((processors < by_memory ? processors : by_memory))
}

# Without this setting ccache does not cache compilations with precompiled headers.
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros}

# configure PRESET [cmake arguments...]: configures build/PRESET. It prints only notes, or the whole log after a failure.
configure() {
  local log preset=$1 python=() status
  shift
  log=$(mktemp)
  # Debian's packages of NumPy and Pillow are for Debian's own Python, which is not always the first in PATH.
  if command -v dpkg-query >/dev/null && [ -x /usr/bin/python3 ]; then python=(-DPython3_EXECUTABLE=/usr/bin/python3); fi
  for _ in as_it_is anew; do
    cmake --preset "$preset" -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" "${python[@]}" "$@" >"$log" 2>&1 </dev/null
    status=$?
    # If the compiler changes, CMake drops every other setting, including the sanitizers.
    grep -q '^You have changed variables that require your cache to be deleted' "$log" || break
    rm -f "build/$preset/CMakeCache.txt"
  done
  if [ $status -eq 0 ]; then
    grep -E '^-- (sonard|  )|Warning' "$log" || true
    rm -f "$log"
  else
    cat "$log" >&2
    rm -f "$log"
    echo "configuring preset $preset failed: see above" >&2
    return 1
  fi
}

# clang_sanitizes: succeeds if there is a clang++ that links a sanitized program.
clang_sanitizes() {
  local program status
  program=$(mktemp)
  clang++ -fsanitize=address,undefined -fuse-ld=lld -x c++ -o "$program" - <<<'int main() {}' >/dev/null 2>&1
  status=$?
  rm -f "$program"
  return $status
}

# configure_sanitized PRESET: configures with clang, or with the default compiler if clang is not available. With the default
# compiler warnings are not errors, because the code of sanitizers causes false warnings of g++.
configure_sanitized() {
  need_packages "${clang_packages[@]}"
  if clang_sanitizes; then
    configure "$1" -DSONAR_WERROR="${SONAR_WERROR:-OFF}"
  else
    echo "no clang that links sanitized programs (${clang_packages[*]}): compiling with $(c++ --version | head -n 1)" >&2
    configure "$1" -DCMAKE_C_COMPILER=cc -DCMAKE_CXX_COMPILER=c++ -DCMAKE_EXE_LINKER_FLAGS= -DSONAR_WERROR=OFF
  fi
}

# build PRESET [targets...]: builds in build/PRESET and shows the progress.
build() {
  local preset=$1
  shift
  NINJA_STATUS="[%f/%t] " cmake --build "build/$preset" --parallel "$(build_jobs)" ${1:+--target "$@"} </dev/null | tests/tools/build_progress.py
  return "${PIPESTATUS[0]}"
}

# setup_and_build [targets...]: makes the release build; without targets it builds everything, tests included. If product_only is
# set, it neither installs packages for tests nor configures tests, unless an earlier run did. Settings of an earlier run by
# .ci/run do not persist: a plain run builds everything.
setup_and_build() {
  local packages=("${build_packages[@]}") testing=ON
  if [ -n "${product_only:-}" ] && [ ! -f build/release/tests/programs ]; then packages=("${product_packages[@]}") testing=OFF; fi
  need_packages "${packages[@]}" || return
  need_packages "${page_packages[@]}" || echo "continuing without them: this sonard will have no page for browsers"
  say "building in build/release"
  configure release -DSONAR_WERROR="${SONAR_WERROR:-OFF}" -DBUILD_TESTING=$testing -DSONAR_TESTS_LEFT_OUT="${SONAR_TESTS_LEFT_OUT:-}" &&
    build release "$@"
}
