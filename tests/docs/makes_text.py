#!/usr/bin/env python3
"""Writes the makes and products into the manual pages and the package's description, from the output of print_makes.

usage: makes_text.py PRINT_MAKES [--check]     --check: writes nothing, exits 1 if a file is not up to date
"""
import pathlib
import re
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]


def listed(words, last):
    return ", ".join(words[:-1]) + f" {last} " + words[-1]


def roff(text):
    """Returns a sentence with the line breaks of a manual page's source."""
    return "\n".join(textwrap.wrap(text, 130, break_on_hyphens=False))


def texts(makes, demos):
    """Returns {file: [(regular expression of the replaced text, new text)]}."""
    sonars = listed([title for title, _ in makes], "or")
    plural = listed([re.sub(r"^an? ", "", title) for title, _ in makes], "and")
    table = "\n".join(f".It {title.split(' ', 1)[1]}\n{roff(', '.join(products))}" for title, products in makes)
    package = "\n".join(textwrap.wrap("sonard holds a 3D scene, receives the pose of a vehicle, computes the echoes that a multibeam sonar would "
                                      f"receive, and serves them as {sonars}. Drivers written for the real device connect unchanged. Drivers of "
                                      "BlueView sonars use sonard's libraries. The package has sonarctl, which checks, displays and controls "
                                      "sonars, and a systemd unit, which the installation does not start.", 78, break_on_hyphens=False))
    return {
        "docs/man/sonard.8": [
            (r"(?<=holds a 3D scene, receives the pose)(?s:.*?)(?=\n\.Pp\nWithout\n)",
             " of a vehicle, computes the echoes that a multibeam sonar would receive, and serves them as\n" + roff(sonars + ".")
             + "\nDrivers written for the real device connect unchanged. Drivers of BlueView sonars use sonard's libraries.\n"
             "The viewer ViewPoint of Oculus very likely shows no picture."),
            (r"(?<=\n\.It Fl -demo Op Ar )[^\n]*", " | ".join(demos)),
            (r"(?<=\n\.Sh PRODUCTS\nThese are the values of\n\.Fl -profile\nand of the key\n\.Li profile :\n\.Bl -tag -width Ds\n)(?s:.*?)(?=\n\.El\n)", table)],
        "docs/man/sonarctl.1": [(r"(?<=connects to sonars as a driver \()[^)]*(?=\))", "\n" + roff(plural) + "\n")],
        "daemon/package.cmake": [(r"(?<=from a 3D scene\n)(?s:sonard holds.*?)(?=\"\))", package)],
    }


def main():
    def printed(*options):
        return subprocess.run([sys.argv[1], *options], capture_output=True, text=True, check=True, timeout=60).stdout.splitlines()

    lines, demos = printed(), printed("--demos")
    makes = [(title, products.split()) for title, _, products in (line.partition(":") for line in lines)]
    wrong = 0
    for name, changes in texts(makes, demos).items():
        path = ROOT / name
        there = text = path.read_text(encoding="utf-8")
        for pattern, by in changes:
            text, count = re.subn(pattern, lambda _, by=by: by, text)
            if count != 1:
                sys.exit(f"{name}: the place of {by[:40]!r} is there {count} times, not once")
        if text == there:
            continue
        if "--check" in sys.argv[2:]:
            wrong = 1
            print(f"{name} does not name the makes as the code does: run tests/docs/makes_text.py BUILD_DIR/tests/docs/print_makes")
        else:
            path.write_text(text, encoding="utf-8")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
