"""Stores the figure of a reliability test with its bound. record.hpp does the same for C++ and explains the fields.

From a shell: record.py ITEM FIGURE BOUND yes|no COMMAND
"""
import datetime
import json
import os
import pathlib
import platform
import sys


def machine():
    """Returns e.g. '2 x Some Processor, Linux 6.1.0', without the name of the computer."""
    model = "processors"
    cpuinfo = pathlib.Path("/proc/cpuinfo")
    for line in cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []:
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    return f"{os.cpu_count()} x {model}, {platform.system()} {platform.release()}"


def record(item, figure, bound, passed, command):
    """Writes the figure to FOLDER/ITEM.json, with FOLDER from SONARD_RELIABILITY; without that it writes nothing. Returns
    `passed`."""
    folder = os.environ.get("SONARD_RELIABILITY")
    if folder:
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
        told = {"item": item, "figure": figure, "bound": bound, "passed": bool(passed), "command": command, "machine": machine(),
                "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat()}
        pathlib.Path(folder, f"{item}.json").write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
    return bool(passed)


if __name__ == "__main__":
    if len(sys.argv) != 6 or sys.argv[4] not in ("yes", "no"):
        sys.exit(__doc__)
    record(sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4] == "yes", sys.argv[5])
