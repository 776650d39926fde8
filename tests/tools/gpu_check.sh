#!/usr/bin/env bash
# Checks the CUDA engine on a machine with a device. That machine needs only a driver: no package, no CMake, no compiler.
#   gpu_check.sh build [FOLDER, default build/gpu]      builds programs, module and tests, on a machine with the CUDA toolkit
#   gpu_check.sh pack [FOLDER] [ARCHIVE]                 packs them with their libraries, default FOLDER/gpu_pack.tar.gz
#   gpu_check.sh prove [ARCHIVE]                         proves that the pack runs in an empty root, with host loops as the device
#   gpu_check.sh run [ARCHIVE] [PART...]                 runs on the machine with the device; writes found.tar.gz and a page of
#                                                        the measurements in $OUT (default gpu-found)
# Parts: facts smoke check ceiling rates page (those by default), kernels sanitize soak memory. Each takes less than ten minutes;
# `page` uses the results of facts, check and rates. If a part fails, the others still run; exit code 1 if a part failed, 77
# without a device. GPU_CHECK_ARCHITECTURES=90 builds for compute 9.0 only; GPU_CHECK_REFERENCE_MS=30 is the time of a frame of
# the public reference code on this device, for the ratio P11; GPU_CHECK_THREADS="1 4" are the numbers of threads.
set -uo pipefail

default_build=build/gpu
device_tests="cuda_device_same_rays_test cuda_device_embree_rays_test"
# Libraries that every Linux machine has with its loader and that must not be mixed.
c_library='/(ld-linux[^/]*|libc|libm|libdl|librt|libpthread|libresolv|libstdc\+\+|libgcc_s)\.so[.0-9]*$'
page_name=benchmarks-gpu
default_parts="facts smoke check ceiling rates page"

do_build() {
  local build=${1:-$default_build} nvcc
  nvcc=$(command -v nvcc || ls /usr/local/cuda/bin/nvcc 2>/dev/null) || { echo "gpu_check: no nvcc: install the CUDA toolkit" >&2; return 69; }
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSONAR_CUDA=REQUIRED -DCMAKE_CUDA_COMPILER="$nvcc" \
    ${GPU_CHECK_ARCHITECTURES:+-DCMAKE_CUDA_ARCHITECTURES="$GPU_CHECK_ARCHITECTURES"} || return
  # shellcheck disable=SC2086
  ninja -C "$build" ${NINJA_JOBS:+-j"$NINJA_JOBS"} $device_tests cuda_seam_test host_module sonard sonard_bench sonard_cuda
}

libraries_of() { for f in "$@"; do ldd "$f"; done | awk '$3 ~ /^\// {print $3}' | sort -u; }

do_pack() (
  set -e
  build=${1:-$default_build} archive=${2:-${1:-$default_build}/gpu_pack.tar.gz}
  stage=$(mktemp -d)
  trap 'rm -rf "$stage"' EXIT
  pack=$stage/gpu_pack
  mkdir -p "$pack/bin" "$pack/lib" "$pack/lib-if-missing"
  for program in daemon/sonard daemon/libsonard_cuda.so tests/bench/sonard_bench tests/cuda/cuda_seam_test tests/cuda/libhost_module.so; do
    cp "$build/$program" "$pack/bin/"
  done
  for test in $device_tests; do cp "$build/tests/cuda/$test" "$pack/bin/"; done
  libraries_of "$pack"/bin/* | grep -vE "$c_library" | while read -r library; do cp -L "$library" "$pack/lib/"; done
  for library in libstdc++.so.6 libgcc_s.so.1; do
    cp -L "$(libraries_of "$pack/bin/sonard" | grep "/$library\$")" "$pack/lib-if-missing/"
  done
  strip --strip-unneeded "$pack"/bin/* "$pack"/lib/* 2>/dev/null || true
  "$(sed -n 's/^CMAKE_CUDA_COMPILER:[A-Z]*=//p' "$build/CMakeCache.txt")" --version | grep -oE 'release [0-9.]+, V[0-9.]+' >"$pack/toolkit"
  cp -r scenes tests/tools/gpu_check.sh tests/bench/write_gpu_benchmarks.py "$pack/"
  tar -C "$stage" -cf - gpu_pack | gzip -9 >"$archive"
  bytes=$(stat -c %s "$archive")
  echo "gpu_check: $archive, $((bytes / 1000000)) MB"
  [ "$bytes" -lt 57000000 ] || { echo "gpu_check: more than 57 MB are too much to transfer" >&2; exit 1; }
)

# The root has only the pack, the C library and its loader: no /usr, no /proc, no shell.
do_prove() (
  set -e
  archive=${1:-$default_build/gpu_pack.tar.gz}
  root=$(mktemp -d)
  trap 'rm -rf "$root"' EXIT
  tar -xzf "$archive" -C "$root"
  for library in $(libraries_of "$root"/gpu_pack/bin/* | grep -E "$c_library" | grep -vE '/lib(stdc\+\+|gcc_s)\.so') /lib64/ld-linux-x86-64.so.2; do
    mkdir -p "$root/$(dirname "$library")"
    cp -L "$library" "$root/$library"
  done
  inside() { unshare -r chroot "$root" "/gpu_pack/bin/$1" "${@:2}"; }
  export LD_LIBRARY_PATH=/gpu_pack/lib:/gpu_pack/lib-if-missing SONARD_CUDA_MODULE=/gpu_pack/bin/libhost_module.so
  inside sonard --version
  inside sonard_bench --engine cuda --scene demo --scenes-dir /gpu_pack/scenes --case P1 --pings 1 --threads 1
  echo "gpu_check: the pack runs in an empty root"
)

# ---- the rest runs on the machine with the device

begin_run() {
  out=$(mkdir -p "${OUT:-gpu-found}" && cd "${OUT:-gpu-found}" && pwd)
  found=$out/found
  mkdir -p "$found"
  local at=${GPU_CHECK_UNPACKED:-/tmp/gpu_check}
  mkdir -p "$at" && tar -xzf "$1" -C "$at" || return
  pack=$at/gpu_pack
  export SONARD_CUDA_MODULE=$pack/bin/libsonard_cuda.so
  # cuFFT is in the toolkit or in a Python package; without it the CPU computes exact pulses.
  local name
  name=$(grep -aoE 'libcufft\.so\.[0-9]+' "$SONARD_CUDA_MODULE" | head -1)
  cufft=$(find /usr/local /opt /usr/lib /root /home -name "${name:-libcufft.so.12}" -print -quit 2>/dev/null)
  libraries=$pack/lib${cufft:+:${cufft%/*}}
  [[ $(ldconfig -p 2>/dev/null) == *libstdc++.so.6* ]] || libraries=$libraries:$pack/lib-if-missing
  # shellcheck disable=SC2012
  sanitizer=$(command -v compute-sanitizer || ls /usr/local/cuda*/bin/compute-sanitizer 2>/dev/null | head -1)
  # shellcheck disable=SC2012
  ncu=$(command -v ncu || ls /usr/local/cuda*/bin/ncu /opt/nvidia/nsight-compute/*/ncu 2>/dev/null | head -1)
  threads=${GPU_CHECK_THREADS:-1 2 4 8 16}
  failures=0
}

# limited SECONDS COMMAND...: runs a command with the pack's libraries. A command that hangs is ended, so that a part ends within
# ten minutes.
limited() {
  local left=$((part_ends - SECONDS)) wanted=$1
  [ "$left" -gt 5 ] || { echo "no time left for: ${*:2}"; return 124; }
  LD_LIBRARY_PATH="$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" timeout -k 5 $((wanted < left ? wanted : left)) "${@:2}"
}
bench() { limited "$1" "$pack/bin/sonard_bench" --engine cuda --scene local-search --scenes-dir "$pack/scenes" "${@:2}"; }
thread_options() { for n in $threads; do printf -- '--threads %s ' "$n"; done; }
fail() { echo "FAILED: $*"; failures=$((failures + 1)); }
ask() { nvidia-smi --query-gpu="$1" --format=csv,noheader -i "${CUDA_VISIBLE_DEVICES:-0}" 2>/dev/null; }
digests() { grep -oE '[0-9a-f]{64}' "$1"; }

facts() {
  nvidia-smi
  nvidia-smi --query-gpu=name,driver_version,clocks.sm,clocks.max.sm,clocks.mem,mig.mode.current,compute_mode --format=csv
  lscpu | grep -E 'Model name|^CPU\(s\)'
  echo "cuFFT: ${cufft:-none}  compute-sanitizer: ${sanitizer:-none}  ncu: ${ncu:-none}"
  for f in "$pack"/bin/*; do limited 20 ldd "$f" | grep 'not found' && fail "$f lacks a library"; done
  {
    echo "memory=$(ask memory.total)"
    echo "driver=$(ask driver_version)"
    echo "toolkit=$(cat "$pack/toolkit")"
    echo "clocks as found=SM $(ask clocks.sm), at most $(ask clocks.max.sm); memory $(ask clocks.mem)"
  } >"$found/facts.txt"
}

smoke() { bench 120 --case P1 --pings 64 --threads 1 || fail "P1 did not run: rc=$?"; }

# Runs the tests that host loops pass, and compares P9 with host loops: the bytes are equal if device and processor round in the
# same way.
check() {
  local test skipped
  for test in cuda_seam_test $device_tests; do
    limited 280 "$pack/bin/$test" --gtest_filter='OnDevice*:*NamesTheDevice*:*FindsCufft*' >"$found/$test.txt" 2>&1 ||
      fail "$test: rc=$?"
    # Only tests that need cuFFT may be skipped; any other skip is a failure.
    skipped=$(grep -E '^\[  SKIPPED \].*\(' "$found/$test.txt" | grep -vE 'SumsPulses|FindsCufft' || true)
    [ -z "$skipped" ] || fail "$test skipped: $skipped"
    grep -hE '^\[  (PASSED|FAILED|SKIPPED)|relative L2|Failure|no libcufft' "$found/$test.txt"
  done
  bench 120 --case P9 --threads 1 >"$found/p9_device.txt" || fail "P9 on the device"
  SONARD_CUDA_MODULE=$pack/bin/libhost_module.so bench 240 --case P9 --threads 1 >"$found/p9_host.txt" || fail "P9 with host loops"
  if diff <(digests "$found/p9_host.txt") <(digests "$found/p9_device.txt") >/dev/null; then
    echo "digests of device and host loops: equal" | tee "$found/digests.txt"
  else
    echo "digests of device and host loops: different" | tee "$found/digests.txt"  # not a failure: the last bit of a sine may differ
  fi
}

# Measures the rate that the processor allows if the device needs no time.
ceiling() {
  # shellcheck disable=SC2046
  SONARD_TEST_DEVICE_IDLE=1 SONARD_CUDA_MODULE=$pack/bin/libhost_module.so bench 500 --case P10 --pings 128 $(thread_options) |
    tee "$found/ceiling.txt" | grep -E 'P10|P11' || fail "P10 on an idle device"
}

rates() {
  # shellcheck disable=SC2046
  bench 380 --case P10 --pings 512 $(thread_options) ${GPU_CHECK_REFERENCE_MS:+--reference-ms "$GPU_CHECK_REFERENCE_MS"} \
    --json "$found/batches.json" | grep -E 'P1[01]' || fail "P10"
  bench 170 --case P1 --case P3a --case P3b --case P3c --case P3d --case P5 --case P9 --pings 400 --threads 1 \
    --json "$found/single.json" || fail "one ping at a time"
}

page() {
  command -v python3 >/dev/null || { fail "no python3 here: write_gpu_benchmarks.py makes the page from the archive"; return; }
  python3 -B "$pack/write_gpu_benchmarks.py" "$found" "$out/${page_name}.md" || fail "the page"
}

# Measures time, instructions and divergence of each kernel.
kernels() {
  [ -n "$ncu" ] || { fail "no ncu"; return; }
  SONARD_CUDA_GRAPHS=0 limited 400 "$ncu" --clock-control none --csv --launch-skip 300 --launch-count 90 --metrics \
    gpu__time_duration.sum,smsp__inst_executed.sum,sm__inst_executed.avg.per_cycle_active,sm__warps_active.avg.pct_of_peak_sustained_active,smsp__thread_inst_executed_per_inst_executed.ratio,l1tex__data_pipe_lsu_wavefronts.sum,lts__t_bytes.sum,dram__bytes.sum \
    "$pack/bin/sonard_bench" --engine cuda --scene local-search --scenes-dir "$pack/scenes" --case P10 --pings 64 --threads 1 \
    >"$found/ncu.csv" 2>&1 || fail "ncu: $(tail -1 "$found/ncu.csv")"
}

# racecheck is left out: it checks shared memory, and the kernels use none.
sanitize() {
  [ -n "$sanitizer" ] || { fail "no compute-sanitizer"; return; }
  local tool
  for tool in memcheck initcheck; do
    limited 270 "$sanitizer" --tool "$tool" --error-exitcode 9 "$pack/bin/cuda_device_same_rays_test" \
      --gtest_filter='OnDevice.MakesTheSameBytesInBatches*:OnDevice.SumsPulses*' >"$found/$tool.txt" 2>&1 || fail "$tool: rc=$?"
    tail -3 "$found/$tool.txt"
  done
}

soak() {
  for i in 1 2 3; do
    bench 180 --case P9 --threads 1 >"$found/soak_$i.txt" || fail "P9, run $i"
    cmp <(digests "$found/soak_1.txt") <(digests "$found/soak_$i.txt") || fail "other bytes in run $i"
  done
}

# Tests a device with too little memory: batches must become smaller, or one sentence must be printed, and no ping may be lost.
memory() {
  python3 -c "import torch,time;f=torch.cuda.mem_get_info()[0];x=torch.empty(f-(900<<20),dtype=torch.uint8,device='cuda');time.sleep(90)" &
  local hog=$!
  sleep 15
  kill -0 $hog 2>/dev/null || { fail "python3 with torch is needed to fill the memory"; return; }
  bench 60 --case P1 --pings 8 --threads 1
  case $? in 0 | 69) ;; *) fail "a full device: neither pings nor exit code 69" ;; esac
  kill $hog
}

do_run() {
  local archive=$default_build/gpu_pack.tar.gz
  case ${1:-} in *.tar.gz) archive=$1; shift ;; esac
  if ! command -v nvidia-smi >/dev/null || [[ $(nvidia-smi -L 2>/dev/null) != *GPU* ]]; then
    echo "gpu_check: no CUDA device here (nvidia-smi names none): nothing was checked" >&2
    return 77
  fi
  begin_run "$archive" || return
  local part
  # shellcheck disable=SC2086
  for part in ${*:-$default_parts}; do
    printf '\n=== %s (%d s)\n' "$part" "$SECONDS"
    part_ends=$((SECONDS + 570))
    case $part in
      facts | smoke | check | ceiling | rates | page | kernels | sanitize | soak | memory) "$part" ;;
      *) fail "unknown part: $part" ;;
    esac > >(tee -a "$found/log.txt") 2>&1
    tar -czf "$out/found.tar.gz" -C "$out" found  # repeated after every part, so that results are available even if time runs out
  done
  echo "gpu_check: $failures failures in $SECONDS s; $out"
  [ "$failures" -eq 0 ]
}

case ${1:-} in
  build | pack | prove) cd "$(dirname "$0")/../.." && "do_$1" "${@:2}" ;;
  run) do_run "${@:2}" ;;
  *) sed -n '2,12s/^# //p' "$0"; exit 64 ;;
esac
