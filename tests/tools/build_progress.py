#!/usr/bin/env python3
"""Shows the progress of a build from ninja's output on standard input: on a terminal as one line that
grows, otherwise as a line for every tenth of the build.

usage: ninja ... | build_progress.py       lines that are not steps, such as errors, are printed as they come
"""
import re
import sys
import time

STEP = re.compile(r"\[(\d+)/(\d+)\] (.*)")


def spoken(seconds):
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} min"


def main():
    sys.stdin.reconfigure(errors="replace")  # a compiler quotes bytes of the source
    begin, tenth, open_line = time.monotonic(), -1, False
    for line in sys.stdin:
        step = STEP.match(line)
        if not step:
            print(("\n" if open_line else "") + line, end="", flush=True)
            open_line = False
            continue
        done, all_steps = int(step[1]), max(int(step[2]), 1)
        passed = time.monotonic() - begin
        left = passed / max(done, 1) * (all_steps - done)
        text = f"   {100 * done // all_steps:3d} %  step {done} of {all_steps}, {spoken(passed)} so far"
        if 0 < done < all_steps and passed > 5:
            text += f", about {spoken(left)} left"
        if sys.stdout.isatty():
            print("\r\033[K" + text, end="", flush=True)
            open_line = True
        elif 10 * done // all_steps > tenth or done == all_steps:
            tenth = 10 * done // all_steps
            print(text, flush=True)
    if open_line:
        print()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
