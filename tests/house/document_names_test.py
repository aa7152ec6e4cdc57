#!/usr/bin/python3
"""Files, tests and test programs that the documents name exist."""
import fnmatch
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True

GENERATED = ("docs/reference/cli.md", "docs/reference/python.md")
PLACEHOLDER = re.compile(r"[A-Z]{2,}|…|\.\.\.|[{}<>]")  # NAME, VERSION, …
PATH = re.compile(r"(?<![\w/.~-])((?:\.\./)*(?:waymark|tests|tools|docs|examples|benchmarks|cmake|fuzz|labs|packaging|python|ros2|share|viewer|web)"
                  r"/[\w*./-]*\w)")
SOURCE = re.compile(r"`([\w*]+\.(?:cpp|hpp|py|sh|c))`")
FILTER = re.compile(r"--gtest_filter=['\"]?([\w.*:-]+)")
TEST = re.compile(r"`([A-Z]\w*[a-z]\w*\.[A-Z]\w*[a-z]\w*)`")
SUITE = re.compile(r"\btests? `([A-Z]\w+)`")
PYTHON_TEST = re.compile(r"(tests/[\w/]+_test\.py)(?: [A-Z]{2,})* ([A-Z][a-z]\w+)")
PROGRAM = re.compile(r"\bwaymark_(\w+)_tests\b")


def documents():
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    return [name for name in listed if name not in GENERATED]


class Repository:
    def __init__(self):
        self.files = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
        self.names = {name.rsplit("/", 1)[-1] for name in self.files}
        self.folders = {str(parent) for name in self.files for parent in pathlib.PurePath(name).parents}
        self.tests = set()
        for name in self.files:
            if name.endswith((".cpp", ".hpp")) and (ROOT / name).is_file():
                text = (ROOT / name).read_text(encoding="utf-8")
                self.tests |= {f"{suite}.{test}" for suite, test in re.findall(r"\bT(?:EST|EST_F|EST_P|YPED_TEST)\((\w+),\s*(\w+)\)", text)}
        self.suites = {test.split(".")[0] for test in self.tests}
        self.programs = set(re.search(r"WAYMARK_TEST_PROGRAMS ([\w ]+)", (ROOT / "cmake/TestPrograms.cmake").read_text())[1].split())

    def has_path(self, path):
        return path in self.folders or any(fnmatch.fnmatch(name, path) or fnmatch.fnmatch(name, path + ".?pp") for name in self.files)

    def has_tests(self, pattern):
        """Whether a filter of GoogleTest selects any test; a prefix or suffix of instantiations counts as well."""
        return all(any(fnmatch.fnmatch(test, part) or fnmatch.fnmatch(test, part.split("/")[-1]) for test in self.tests)
                   for part in pattern.split("-")[0].split(":"))

    def missing(self, text, folder="."):
        """The names in a document of a folder that do not exist. A path is from the top of the repository or from that folder."""
        found = [path for path in PATH.findall(text) if not PLACEHOLDER.search(path) and not self.has_path(path.replace("../", ""))
                 and not self.has_path(f"{folder}/{path}")]
        found += [name for name in SOURCE.findall(text) if not PLACEHOLDER.search(name) and not any(fnmatch.fnmatch(file, name) for file in self.names)]
        found += [pattern for pattern in FILTER.findall(text) if not self.has_tests(pattern)]
        found += [test for test in TEST.findall(text) if test.split(".")[0] in self.suites and test not in self.tests]
        found += [suite for suite in SUITE.findall(text) if suite not in self.suites]
        found += [test for file, test in PYTHON_TEST.findall(text) if not re.search(rf"^class {test}\(", (ROOT / file).read_text(encoding="utf-8"), re.M)]
        found += [f"waymark_{program}_tests" for program in PROGRAM.findall(text) if program not in self.programs]
        found += re.findall(r"bin/waymark_\w+_tests", text)  # they are in tests/ of the build folder
        return found


class DocumentNames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.repository = Repository()

    def test_every_name_exists(self):
        for name in documents():
            with self.subTest(document=name):
                text = (ROOT / name).read_text(encoding="utf-8")
                self.assertEqual(self.repository.missing(text, pathlib.PurePath(name).parent.as_posix()), [])

    def test_a_name_that_does_not_exist_is_found(self):
        for text, name in (("see `waymark/attic/door.cpp`", "waymark/attic/door.cpp"), ("in `attic_door.cpp`", "attic_door.cpp"),
                           ("--gtest_filter='AtticDoor.*'", "AtticDoor.*"), ("`LieLaws.TheAtticIsEmpty`", "LieLaws.TheAtticIsEmpty"),
                           ("(test `AtticDoor`)", "AtticDoor"),
                           ("`tests/cli/flags_test.py PROGRAM AtticDoor`", "AtticDoor"), ("waymark_attic_tests", "waymark_attic_tests"),
                           ("build/dev/bin/waymark_core_tests", "bin/waymark_core_tests")):
            self.assertEqual(self.repository.missing(text), [name])

    def test_names_that_exist_pass(self):
        for text in ("`waymark/geometry/se3.hpp`", "waymark/geometry/", "`se3_test.cpp`", "`waymark/app/*/VERB_verb.cpp`", "waymark_core_tests",
                     "--gtest_filter='*MinimumDistance*'", "https://example.org/docs/attic.md"):
            self.assertEqual(self.repository.missing(text), [])
        self.assertEqual(self.repository.missing("`python/robot.cpp`", "examples"), ["python/robot.cpp"])
        self.assertEqual(self.repository.missing("`ros2/velocity_commands`", "waymark/robots"), [])


if __name__ == "__main__":
    unittest.main()
