#!/usr/bin/env python3
"""Prints "passed failed skipped" of a JUnit report of ctest. A GoogleTest program counts as the tests that it ran, any other test as one."""
import re
import sys
import xml.etree.ElementTree


def counts(case):
    """(passed, failed, skipped) of one ctest entry."""
    output = case.findtext("system-out") or ""
    ran = re.search(r"^\[=+\] (\d+) tests? from .* ran\.", output, re.MULTILINE)
    if case.find("skipped") is not None or case.get("status") in ("notrun", "disabled"):
        return 0, 0, 1
    if not ran:
        failed = int(case.get("status") == "fail")
        return 1 - failed, failed, 0
    of = {what: int(number) for what, number in re.findall(r"^\[  (PASSED|SKIPPED|FAILED) +\] (\d+) tests?", output, re.MULTILINE)}
    failed = of.get("FAILED", 0)
    if case.get("status") == "fail":
        failed = max(failed, 1)
    return of.get("PASSED", 0), failed, of.get("SKIPPED", 0)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    cases = xml.etree.ElementTree.parse(sys.argv[1]).getroot().iter("testcase")
    print(*(sum(column) for column in zip((0, 0, 0), *map(counts, cases))))


if __name__ == "__main__":
    main()
