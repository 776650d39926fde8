#!/usr/bin/env bash
# Lists the tracked C++ and CUDA files that clang-format 14 would change; --fix changes them.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
mode=(--dry-run -Werror)
[ "${1:-}" = --fix ] && mode=(-i)
git ls-files -z '*.hpp' '*.cpp' '*.cu' '*.cuh' | xargs -0 --no-run-if-empty -n 40 -P "$(nproc)" clang-format-14 "${mode[@]}"
