#!/usr/bin/env bash
# Checks the CUDA engine on this machine's device: builds, tests, compute-sanitizer, benchmark; writes docs/benchmarks-gpu.md.
# Exit 77 without a device, 1 when something fails. usage: tests/tools/gpu_check.sh [build folder, default build/gpu]
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
ninja -C "$build" $tests cuda_seam_test cuda_bench

for test in $tests cuda_seam_test; do
  # A test that is skipped here has checked nothing: with a device there is no reason for it.
  (cd "$build/tests/cuda" && "./$test" --gtest_output="xml:$test.xml" --gtest_filter='OnDevice*:*NamesTheDevice*') |
    tee "$build/$test.log"
  if grep -q "SKIPPED" "$build/$test.log"; then echo "gpu_check: $test was skipped" >&2; exit 1; fi
done

sanitizer=$(command -v compute-sanitizer || ls "$(dirname "$nvcc")/compute-sanitizer" 2>/dev/null || true)
sanitized="not run: compute-sanitizer is not installed"
if [ -n "$sanitizer" ]; then
  for tool in memcheck racecheck; do
    "$sanitizer" --tool "$tool" --error-exitcode 9 "$build/tests/cuda/cuda_device_same_rays_test" \
      --gtest_filter='OnDevice.IsTheSame*'
  done
  sanitized="clean: memcheck, racecheck ($("$sanitizer" --version | grep -o 'Version [0-9.]*' | head -1))"
fi

ask() { nvidia-smi --query-gpu="$1" --format=csv,noheader -i 0; }
distances=$(grep -hE "^[0-9]+: relative L2" "$build/cuda_device_embree_rays_test.log" || true)
table=$(SONARD_CUDA_MODULE="$build/daemon/libsonard_cuda.so" "$build/tests/cuda/cuda_bench" 512)
{
  echo "# The CUDA engine, measured"
  echo
  echo "Written by \`tests/tools/gpu_check.sh\`; what it checks: docs/cuda.md."
  echo
  echo "| | |"
  echo "|---|---|"
  echo "| device | $(ask name), $(ask memory.total) |"
  echo "| driver, toolkit | $(ask driver_version), $("$nvcc" --version | grep -o 'release [0-9.]*') |"
  echo "| clocks as found | SM $(ask clocks.sm), at most $(ask clocks.max.sm); memory $(ask clocks.mem) |"
  echo "| processor | $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2 | xargs), $(nproc) cores |"
  echo "| tests on the device | pass |"
  echo "| compute-sanitizer | $sanitized |"
  echo
  echo "$table"
  echo
  echo "Beside the CPU engine with Embree (docs/cuda.md, \"How equal it is\"), eight pings of P1:"
  echo
  echo '```'
  echo "$distances"
  echo '```'
} >"$page"
echo "gpu_check: passed; $page is written"
