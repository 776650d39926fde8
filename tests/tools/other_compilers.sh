#!/usr/bin/env bash
# Reads the whole tree, tests included, with other compilers than the usual one. They generate no code, so they find errors, and
# warnings that need no optimiser. Warnings are errors.
# usage: tests/tools/other_compilers.sh [--share N] [COMPILER...]
#   --share N reads one Nth of the files; the commit selects which
#   COMPILER  e.g. g++-11, clang++-14; without one, the commit selects an installed one; if there is none, the check is skipped.
# Build folders stay in build/other.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
case "${1:-}" in
  -h | --help) sed -n '2,6s/^# //p' "$0"; exit 0 ;;
esac
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

share=1
if [ "${1:-}" = --share ]; then
  [[ "${2:-}" =~ ^[1-9][0-9]*$ ]] || { sed -n '2,6s/^# //p' "$0" >&2; exit 64; }
  share=$2
  shift 2
fi
commit=$(git rev-parse --short=7 HEAD 2>/dev/null) || commit=0
commit=$((16#${commit:0:7}))

if [ $# -eq 0 ]; then
  usual=$(c++ -dumpversion)
  mapfile -t installed < <(compgen -c | grep -xE '(g|clang)\+\+-[0-9]+' | grep -vxF "g++-${usual%%.*}" | sort -u)
  [ ${#installed[@]} -gt 0 ] || { echo "skipped: no other compiler is installed, e.g. apt-get install g++-11 clang-14"; exit 0; }
  set -- "${installed[$((commit % ${#installed[@]}))]}"
fi

# Prints the compiler's commands of a build folder with -fsyntax-only, each followed by a zero, without those for generated code.
commands() {
  python3 - "$1/compile_commands.json" "$share" "$commit" <<'PYTHON'
import json, re, sys
files = {entry["file"]: entry for entry in json.load(open(sys.argv[1]))}  # each file once, though tests share some
share, commit = int(sys.argv[2]), int(sys.argv[3])
for number, (file, entry) in enumerate(sorted(files.items())):
    if number % share == commit % share and not re.search(r"cmake_pch\.hxx\.cxx$|\.pb\.cc$|_proto\.dir/", file):
        command = re.sub(r" -o \S+ -c ", " -fsyntax-only ", entry["command"])
        print("cd '%s' && %s" % (entry["directory"], command), end="\0")
PYTHON
}

# check COMPILER: reads the tree with this compiler. A warning or an error makes it fail.
check() {
  local compiler=$1 folder=build/other/$1 made
  command -v "$compiler" >/dev/null || { echo "$compiler is not installed: apt-get install ${compiler/clang++/clang}" >&2; return 1; }
  mkdir -p "$folder"
  # Generated headers and precompiled headers are built as usual.
  cmake -S . -B "$folder" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Release -DSONAR_WERROR=ON -DSONAR_CUDA=OFF \
    >"$folder/log" 2>&1 &&
    made=$(ninja -C "$folder" -t targets all | grep -oE '^(cmake_object_order_depends_target_[^:]*|[^:]*cmake_pch\.hxx\.(gch|pch))') &&
    xargs ninja -C "$folder" <<<"$made" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; return 1; }
  commands "$folder" | xargs -0 -n 1 -P "$(build_jobs)" bash -c
}

failed=0
for compiler in "$@"; do
  started=$SECONDS
  if check "$compiler"; then verdict="no warning"; else verdict="FAILED, see above" failed=1; fi
  printf '%s: %s in %d s\n' "$compiler" "$verdict" $((SECONDS - started))
done
exit $failed
