"""Records the figures of oracles in Python; tests/oracles/record.hpp does the same for C++ and explains the fields.

For a test that uses it, CMake sets the folder and the order of the tests with
set_tests_properties(NAME PROPERTIES ENVIRONMENT SONARD_ORACLES=${oracle_records} FIXTURES_REQUIRED oracles).
"""

import json
import os
import pathlib

_begun = set()


def record(oracle, what, kind, expected, measured, tolerance, unit, test):
    """Appends one record and returns whether it holds. kind: equal (within tolerance), at_least or below (expected is the bound)."""
    holds = {
        "equal": abs(measured - expected) <= tolerance,
        "at_least": measured >= expected,
        "below": measured < expected,
    }[kind]
    folder = os.environ.get("SONARD_ORACLES")
    if folder:
        path = pathlib.Path(folder, f"{oracle:02d}-{test.replace('/', '_')}.jsonl")
        path.parent.mkdir(parents=True, exist_ok=True)
        line = {"oracle": oracle, "what": what, "kind": kind, "expected": expected, "measured": measured,
                "tolerance": tolerance, "unit": unit, "pass": bool(holds), "test": test}
        with path.open("a" if path in _begun else "w", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")
        _begun.add(path)
    return bool(holds)
