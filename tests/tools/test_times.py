#!/usr/bin/env python3
"""Reads the results that `ctest --output-junit` writes. usage: test_times.py RESULTS.xml           the ten slowest tests
                                                             test_times.py RESULTS.xml --failed  the names of those that failed
"""
import sys
import xml.etree.ElementTree


def main(path, *options):
    cases = xml.etree.ElementTree.parse(path).getroot().findall("testcase")
    if options == ("--failed",):
        for case in cases:
            if case.get("status") == "fail":
                print(case.get("name"))
        return
    for case in sorted(cases, key=lambda case: -float(case.get("time")))[:10]:
        print(f"{float(case.get('time')):6.1f} s  {case.get('name')}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--failed"]):
        sys.exit(__doc__)
    main(*sys.argv[1:])
