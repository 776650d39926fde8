"""Makes the oracles' table of a test run for the validation tables. The chapter states what is missing in the run."""

import pathlib
import subprocess
import sys

SCRIPT = pathlib.Path(__file__).resolve().parents[1] / "oracles" / "oracle_table.py"


def chapter(folder, partial=False):
    """Returns the table of a test run, or None without one. Refuses an incomplete run; with `partial`, the chapter states it."""
    if folder is None or not any(pathlib.Path(folder).glob("*.jsonl")):
        return None
    done = subprocess.run([sys.executable, str(SCRIPT), str(folder), "--markdown"], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1) or not done.stdout.strip():
        raise RuntimeError(f"oracle_table.py failed: {done.stderr.strip()}")
    faults = done.stderr.strip().splitlines()
    if done.returncode == 1 and not partial:
        raise RuntimeError("the table of oracles is incomplete; run ./test.sh with all tests, or give --partial:\n" +
                           "\n".join(faults))
    warning = f"**Not a whole run:** {faults[-1]}.\n\n" if done.returncode == 1 else ""
    return INTRODUCTION + warning + done.stdout.strip() + "\n"


INTRODUCTION = """## Oracles

The tests (`./test.sh`) compare the engine with these closed forms. Of several measurements of one kind the worst is shown. The
table is that of the last test run before this page was made.

"""
