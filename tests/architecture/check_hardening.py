#!/usr/bin/env python3
"""Checks that shipped programs and libraries have the protections of the compiler and the linker.

usage: check_hardening.py FILE...    prints missing protections, one per line; exits 1 if there is any
"""
import subprocess
import sys


def readelf(option: str, path: str) -> str:
    return subprocess.run(["readelf", "--wide", option, path], check=True, capture_output=True, text=True).stdout


def missing(path: str) -> list[str]:
    """Returns the missing protections of `path`, a program or a shared library."""
    dynamic = readelf("--dynamic", path)
    symbols = readelf("--dyn-syms", path)
    found = []
    is_library = "(SONAME)" in dynamic
    if not is_library and " PIE" not in dynamic:
        found.append("a load address of its own at each start (-pie)")
    if "GNU_RELRO" not in readelf("--segments", path):
        found.append("relocations that cannot be written afterwards (-z relro)")
    if "BIND_NOW" not in dynamic and "Flags: NOW" not in dynamic:
        found.append("symbols bound at the start (-z now)")
    if "__stack_chk_fail" not in symbols:
        found.append("the stack protector (-fstack-protector-strong)")
    if not any("_chk@" in line and "__stack_chk" not in line for line in symbols.splitlines()):
        found.append("checked buffers (_FORTIFY_SOURCE)")
    return [f"{path}: lacks {what}" for what in found]


def main() -> int:
    lines = [line for path in sys.argv[1:] for line in missing(path)]
    print("\n".join(lines), end="\n" if lines else "")
    return 1 if lines or len(sys.argv) < 2 else 0


if __name__ == "__main__":
    sys.exit(main())
