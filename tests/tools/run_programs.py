#!/usr/bin/env python3
"""Runs test programs, two at a time for each processor. Prints a line for each that passes and all output of each that fails.

usage: run_programs.py BUILD_FOLDER NAME...        --list KIND... [--without KIND...] prints their names instead
The names are listed in BUILD_FOLDER/tests/programs, which CMake writes: the kinds of a program, the program, and its
arguments (tests/CMakeLists.txt).
GoogleTest programs are run in parts (GTEST_TOTAL_SHARDS), and before the others. The others are short, so that no processor is
idle at the end. Parts of all programs alternate, so that parts that wait for sockets or for time run beside parts that compute.
The tests that failed are added to the file that SONARD_FAILED names.
  SONARD_TEST_JOBS      programs at once (default: two per processor)
  SONARD_TEST_SECONDS   time limit of a program (default: 1800)
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

JOBS = int(os.environ.get("SONARD_TEST_JOBS") or 2 * os.cpu_count())
PARTS_A_JOB = 2  # one part of a program may take five times as long as another
LONGEST_S = float(os.environ.get("SONARD_TEST_SECONDS") or 1800)


def programs_of(build):
    """Returns the kinds and the command for each name."""
    path = pathlib.Path(build) / "tests/programs"
    if not path.is_file():
        sys.exit(f"{path} does not exist; configure the build folder first")
    rows = [line.split() for line in path.read_text().splitlines()]
    return {pathlib.Path(row[1]).name: (set(row[0].split(",")), row[1:]) for row in rows}


def failed_cases(output):
    """Returns the failed cases that GoogleTest reports; if it reports none, the case in which the program ended."""
    failed = re.findall(r"^\[  FAILED  \] ([\w/]+\.[\w/]+)", output, re.MULTILINE)
    begun = re.findall(r"^\[ RUN      \] (\S+)", output, re.MULTILINE)
    return list(dict.fromkeys(failed)) or begun[-1:]


def run(command, part, parts):
    """Returns how one part ended (empty if it passed) and its output."""
    environment = dict(os.environ)
    if parts > 1:
        environment |= {"GTEST_TOTAL_SHARDS": str(parts), "GTEST_SHARD_INDEX": str(part)}
    with tempfile.TemporaryFile() as output:
        try:
            status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=environment, timeout=LONGEST_S,
                                    check=False).returncode
            ended = f"ended with {status}" if status else ""
        except subprocess.TimeoutExpired:
            ended = f"took more than {LONGEST_S:.0f} s"
        except OSError as error:
            ended = f"did not start: {error}"
        output.seek(0)
        return ended, output.read().decode(errors="replace")


def run_all(programs):
    """Runs the parts of all programs. Returns the failed tests, each as its program and its name."""
    parts_of = {name: PARTS_A_JOB * JOBS if "GTEST" in kinds else 1 for name, (kinds, _) in programs.items()}
    failed, left, seconds = [], dict(parts_of), dict.fromkeys(programs, 0.0)
    broken = set()

    def one(name, part):
        begin = time.monotonic()
        return name, run(programs[name][1], part, parts_of[name]), time.monotonic() - begin

    with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
        turns = [(parts == 1, part, name) for name, parts in parts_of.items() for part in range(parts)]
        waiting = [pool.submit(one, name, part) for _, part, name in sorted(turns)]
        for done in concurrent.futures.as_completed(waiting):
            name, (ended, output), took = done.result()
            seconds[name] += took
            left[name] -= 1
            if ended:
                print(f"{name} FAILED: it {ended}\n{output}")
                failed += [f"{name}: {case}" for case in failed_cases(output)] or [name]
                broken.add(name)
            elif left[name] == 0 and name not in broken:
                print(f"{seconds[name]:6.1f} s  {name} passed", flush=True)
    return list(dict.fromkeys(failed))  # parts that name no case name the program


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("\n\n")[1])
    parser.add_argument("build")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--list", nargs="+", metavar="KIND")
    parser.add_argument("--without", nargs="+", metavar="KIND", default=[])
    asked = parser.parse_args()
    programs = programs_of(asked.build)
    if asked.list:
        wanted, unwanted = set(asked.list), set(asked.without)
        print("\n".join(name for name, (kinds, _) in programs.items() if kinds & wanted and not kinds & unwanted))
        return 0
    unknown = [name for name in asked.names if name not in programs]
    if unknown or not asked.names:
        sys.exit(f"no such test program: {' '.join(unknown)}; there are {' '.join(programs)}" if unknown else "no test programs are named")
    failed = run_all({name: programs[name] for name in asked.names})
    if failed and os.environ.get("SONARD_FAILED"):
        with open(os.environ["SONARD_FAILED"], "a", encoding="utf-8") as file:
            file.writelines(f"{line}\n" for line in failed)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
