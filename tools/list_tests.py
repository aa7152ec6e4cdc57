#!/usr/bin/env python3
"""Writes the ctest entries of a GoogleTest program: one for each file with tests, and one more for the tests of a file that have "Threads" in their
name (label `threads`: the tests that run with the thread sanitizer).

An entry is named and labelled after its room: waymark/mapping/lap/chain_test.cpp is `mapping/lap.chain`, label `mapping/lap`; tests/loop_test.cpp is
`tests.loop`, label `loop`.
"""
import argparse
import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ENVIRONMENT = "RC_PARAMS=seed=20261121"  # rapidcheck prints the seed of a failing property; a fixed seed makes runs reproducible


def tests_of(command, root, build):
    """{file: [(suite, test)]}, files relative to the root."""
    with tempfile.TemporaryDirectory() as folder:
        listing = pathlib.Path(folder) / "tests.json"
        subprocess.run([*command, "--gtest_list_tests", f"--gtest_output=json:{listing}"], check=True, stdout=subprocess.DEVNULL)
        suites = json.loads(listing.read_text(encoding="utf-8"))["testsuites"]
    files = collections.defaultdict(list)
    for suite in suites:
        for test in suite["testsuite"]:
            path = (build / test["file"]).resolve().relative_to(root)
            files[path.as_posix()].append((suite["name"], test["name"]))
    return files


def name_and_label(file):
    match = re.fullmatch(r"waymark/(.*)/([^/]*)_test\.cpp", file)
    if match:
        return f"{match[1]}.{match[2]}", match[1]
    match = re.fullmatch(r"tests/(?:(.*)/)?([^/]*)_test\.cpp", file)
    if not match:
        sys.exit(f"list_tests.py: '{file}' has tests but is not called *_test.cpp in waymark/ or tests/")
    return f"tests.{match[2]}", match[1] or match[2]


def entry(name, label, command, tests, processors):
    arguments = " ".join(f'"{argument}"' for argument in (*command, "--gtest_brief=1", "--gtest_filter=" + ":".join(tests)))
    return (f'add_test("{name}" {arguments})\n'
            f'set_tests_properties("{name}" PROPERTIES ENVIRONMENT "{ENVIRONMENT}" LABELS "{label}" PROCESSORS {processors})\n')


def entries(files, command, processors):
    text = []
    for file, tests in sorted(files.items()):
        name, label = name_and_label(file)
        threads = [f"{suite}.{test}" for suite, test in tests if "Threads" in f"{suite}.{test}"]
        others = [f"{suite}.{test}" for suite, test in tests if "Threads" not in f"{suite}.{test}"]
        if others:
            text.append(entry(name, label, command, others, processors))
        if threads:
            text.append(entry(f"{name}.threads", f"{label};threads", command, threads, processors))
    return "".join(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, required=True, help="folder of the sources")
    parser.add_argument("--build", type=pathlib.Path, required=True, help="folder in which the compiler ran")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="CMake file to write, for TEST_INCLUDE_FILES")
    parser.add_argument("--processors", type=int, default=1, help="PROCESSORS of each entry")
    parser.add_argument("command", nargs="+", help="the test program, behind an emulator where one is needed")
    options = parser.parse_args()
    files = tests_of(options.command, options.root.resolve(), options.build.resolve())
    options.output.write_text(entries(files, options.command, options.processors), encoding="utf-8")


if __name__ == "__main__":
    main()
