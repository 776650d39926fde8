#!/usr/bin/env python3
"""Checks which versions of system libraries programs and libraries need, so that they run on systems older than the build
machine's.

usage: check_symbol_versions.py GLIBC=2.35 [GLIBCXX=3.4.30 ...] FILE...    prints newer versions, one per line; exits 1 if any
"""
import re
import subprocess
import sys


def numbers(version):
    return [int(part) for part in version.split(".")]


def newer(dump, limits):
    """Returns versions beyond `limits` in a file's `objdump -p -T`. With {"GLIBC": "2.35"}: ["GLIBC_2.36 (arc4random)"]."""
    users = {}  # version -> symbols
    for line in dump.splitlines():
        # A symbol that the file imports from a library; versions that it defines itself have a section in place of *UND*.
        symbol = re.search(r"\*UND\*\s+[0-9a-f]+\s+\(?([A-Za-z]\w*_[\w.]+)\)?\s+(\S+)$", line)
        # "Version References": the loader refuses the file for a missing version even if no symbol has that version.
        reference = re.match(r"\s+0x[0-9a-f]{8} 0x[0-9a-f]{2} \d+ (\S+)$", line)
        if symbol:
            users.setdefault(symbol[1], []).append(symbol[2])
        elif reference:
            users.setdefault(reference[1], [])
    found = []
    for version, symbols in sorted(users.items()):
        family, _, number = version.partition("_")
        if family not in limits:
            continue
        # GLIBC_PRIVATE, GLIBC_ABI_DT_RELR: these belong to one release, or are newer than all numbered versions here.
        if not re.fullmatch(r"[\d.]+", number) or numbers(number) > numbers(limits[family]):
            found.append(f"{version} ({', '.join(symbols[:3]) or 'no symbol'})")
    return found


def main():
    limits = dict(a.split("=") for a in sys.argv[1:] if "=" in a)
    files = [a for a in sys.argv[1:] if "=" not in a]
    if not limits or not files:
        print(__doc__, file=sys.stderr)
        return 64
    failed = False
    for file in files:
        dump = subprocess.run(["objdump", "-p", "-T", file], check=True, capture_output=True, text=True).stdout
        for line in newer(dump, limits):
            failed = True
            print(f"{file}: needs {line}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
