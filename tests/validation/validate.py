#!/usr/bin/env python3
"""Writes docs/validation.md: the paper's experiments, the oracles and the captured ping, every number of ours from a run.

usage: validate.py --program SONARD [--oracles FOLDER] [--partial] [--page FILE] [--only CHAPTER ...]
  --oracles   records of a test run (build/release/oracles after ./test.sh); without them the page keeps its chapter
  --partial   take records in which oracles are missing or out of tolerance all the same; the chapter says so
  --only      make these chapters, keep the others
Needs python3-matplotlib; tests/validation/validate.sh installs it, builds, and starts this.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))

import cost  # noqa: E402
import coverage  # noqa: E402
import differences  # noqa: E402
import local_search  # noqa: E402
import oracles  # noqa: E402
import parts  # noqa: E402
import tank  # noqa: E402
import two_cylinders  # noqa: E402
from runs import Sonard  # noqa: E402
from texts import chapters_of, mark  # noqa: E402

TITLE = """# Validation

Made by `tests/validation/validate.sh`: every number of ours is from a run of the program; predictions and the paper's Table 3 are
quoted. The same command makes it anew, in less than fifteen minutes on two cores. "P25" is Choi 2025 (*Sensors* 25(5):1516).

"""


def capture(program, folder):
    """The chapter of the captured ping, or None without recordings."""
    script = HERE / "capture_comparison.py"
    if not os.environ.get("SONARD_CAPTURES") or not script.is_file():
        return None
    done = subprocess.run([sys.executable, str(script), "--program", str(program), "--pictures", str(folder)], capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"capture_comparison.py failed: {done.stderr.strip()}")
    return done.stdout.strip() + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=pathlib.Path)
    parser.add_argument("--oracles", type=pathlib.Path)
    parser.add_argument("--partial", action="store_true")
    parser.add_argument("--page", type=pathlib.Path, default=ROOT / "docs/validation.md")
    parser.add_argument("--only", nargs="*")
    options = parser.parse_args()

    pictures = options.page.parent / "validation"
    pictures.mkdir(parents=True, exist_ok=True)
    before = chapters_of(options.page.read_text(encoding="utf-8")) if options.page.is_file() else {}
    sonard = Sonard(options.program.resolve())
    makers = {
        "tank": lambda: tank.chapter(sonard, pictures),
        "two-cylinders": lambda: two_cylinders.chapter(sonard, pictures),
        "local-search": lambda: local_search.chapter(sonard, pictures),
        "differences": lambda: differences.chapter(sonard, pictures),
        "coverage": lambda: coverage.chapter(sonard, pictures),
        "cost": lambda: cost.chapter(sonard, pictures),
        "parts": lambda: parts.chapter(sonard, pictures),
        "capture": lambda: capture(options.program.resolve(), pictures),
        "oracles": lambda: table_of_oracles,
    }
    unknown = set(options.only or []) - set(makers)
    if unknown:
        raise RuntimeError(f"no chapter {', '.join(sorted(unknown))}; there are {', '.join(makers)}")
    # Refused before anything else takes its time.
    table_of_oracles = oracles.chapter(options.oracles, options.partial) if not options.only or "oracles" in options.only else None
    text = TITLE
    for name, make in makers.items():
        begin = time.monotonic()
        wanted = not options.only or name in options.only
        made = make() if wanted else None
        if made is None and name not in before:
            print(f"{name}: nothing to make it of, and none on the page; left out", flush=True)
            continue
        if made is None:
            print(f"{name}: kept as it stood on the page" + ("" if not wanted else " (nothing to make it of)"), flush=True)
        else:
            print(f"{name}: made in {time.monotonic() - begin:.0f} s", flush=True)
        text += mark(name) + "\n" + (made if made is not None else before[name]).rstrip() + "\n\n"
    options.page.write_text(text.rstrip() + "\n", encoding="utf-8")
    print(f"{options.page}: written, {sonard.pings} pings rendered")


if __name__ == "__main__":
    try:
        main()
    except RuntimeError as error:
        sys.exit(f"validate.py: {error}")
