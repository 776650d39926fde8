#!/usr/bin/env bash
# Checks the CUDA engine on this machine's device: builds, tests, compute-sanitizer, benchmark; writes docs/benchmarks-gpu.md.
# Exit 77 without a device, 1 when something fails. usage: tests/tools/gpu_check.sh [build folder, default build/gpu]
# GPU_CHECK_ARCHITECTURES=75 builds for compute 7.5, say; GPU_CHECK_REFERENCE_MS=30 is what a frame of the public reference code
# takes on this device, for the ratio P11.
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:-build/gpu}
page=docs/benchmarks-gpu.md

if ! command -v nvidia-smi >/dev/null || ! nvidia-smi -L 2>/dev/null | grep -q GPU; then
  echo "gpu_check: no CUDA device here (nvidia-smi names none): nothing was checked" >&2
  exit 77
fi
nvcc=$(command -v nvcc || ls /usr/local/cuda/bin/nvcc 2>/dev/null || true)
if [ -z "$nvcc" ]; then
  echo "gpu_check: there is a device but no nvcc: install the CUDA toolkit" >&2
  exit 77
fi

cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSONAR_CUDA=REQUIRED -DCMAKE_CUDA_COMPILER="$nvcc" \
  ${GPU_CHECK_ARCHITECTURES:+-DCMAKE_CUDA_ARCHITECTURES="$GPU_CHECK_ARCHITECTURES"} >"$build.log" 2>&1 ||
  { tail -20 "$build.log" >&2; exit 1; }
tests="cuda_device_same_rays_test cuda_device_embree_rays_test"
ninja -C "$build" $tests cuda_seam_test sonard sonard_bench sonard_cuda

for test in $tests cuda_seam_test; do
  # A test that is skipped here has checked nothing: with a device there is no reason for it.
  (cd "$build/tests/cuda" && "./$test" --gtest_output="xml:$test.xml" --gtest_filter='OnDevice*:*NamesTheDevice*') |
    tee "$build/$test.log"
  if grep -q "SKIPPED" "$build/$test.log"; then echo "gpu_check: $test was skipped" >&2; exit 1; fi
done

sanitizer=$(command -v compute-sanitizer || ls "$(dirname "$nvcc")/compute-sanitizer" 2>/dev/null || true)
sanitized="not run: compute-sanitizer is not installed"
if [ -n "$sanitizer" ]; then
  for tool in memcheck initcheck; do  # not racecheck: it looks at shared memory, and the kernels have none
    "$sanitizer" --tool "$tool" --error-exitcode 9 "$build/tests/cuda/cuda_device_same_rays_test" \
      --gtest_filter='OnDevice.IsTheSame*:OnDevice.SumsPulses*'
  done
  sanitized="clean: memcheck, initcheck ($("$sanitizer" --version | grep -o 'Version [0-9.]*' | head -1))"
fi

# The benchmark of docs/cuda.md, as any user can run it.
SONARD_CUDA_MODULE="$build/daemon/libsonard_cuda.so" "$build/tests/bench/sonard_bench" --engine cuda --scene local-search \
  --scenes-dir scenes --case P1 --case P3a --case P3b --case P3c --case P3d --case P5 --case P9 --case P10 --pings 256 \
  ${GPU_CHECK_REFERENCE_MS:+--reference-ms "$GPU_CHECK_REFERENCE_MS"} --json "$build/bench-gpu.json"

ask() { nvidia-smi --query-gpu="$1" --format=csv,noheader -i 0; }
DISTANCES=$(grep -hE "^[0-9]+: relative L2" "$build/cuda_device_embree_rays_test.log" || true) \
  MEMORY=$(ask memory.total) DRIVER=$(ask driver_version) TOOLKIT=$("$nvcc" --version | grep -o 'release [0-9.]*') \
  CLOCKS="SM $(ask clocks.sm), at most $(ask clocks.max.sm); memory $(ask clocks.mem)" SANITIZED=$sanitized \
  python3 - >"$build/facts-gpu.json" <<'END'
import json, os
facts = {"memory": "MEMORY", "driver": "DRIVER", "toolkit": "TOOLKIT", "clocks as found": "CLOCKS", "compute-sanitizer": "SANITIZED"}
facts = {name: os.environ[variable] for name, variable in facts.items()} | {"tests on the device": "pass"}
print(json.dumps({"facts": facts, "distances": os.environ["DISTANCES"]}))
END
python3 -B tests/bench/write_gpu_benchmarks.py "$build/bench-gpu.json" "$build/facts-gpu.json" "$page"
echo "gpu_check: passed; $page is written"
