#!/usr/bin/python3
"""No result of a test depends on which programs happen to be installed: their packages are in tools/packages.sh, and a missing one is a failure.

A test may be skipped only for these reasons: it is long (WAYMARK_FULL), its recordings are missing (WAYMARK_DATA, WAYMARK_REQUIRE_DATA), npm could not
reach its registry, or the kernel lacks a required feature. Tests of optional modules, which CMake builds if their libraries exist, are not skipped.

usage: requirements_test.py BUILD_FOLDER
"""
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv.pop(1)) if len(sys.argv) > 1 else sys.exit(__doc__)
# Tests that CMake omits without the package, by package.
MODULES = {"cyclonedds-dev": ("ros2.wire", "ros2.tools", "ros2.network", "ros2.security"), "liblcm-bin": ("mbot.wire",), "libignition-transport-dev": ("gazebo.wire",),
           "libsdformat-dev": ("gazebo.world",)}
PYTHON = {"pybind11-dev": ("python.rooms", "python.academy", "python.labs")}
REASONS = re.compile(r"WAYMARK_FULL|WAYMARK_DATA|FULL, \"|\"WAYMARK_FULL\" in|LOG\.is_file|another lab was asked for|no validators|npm has not built|no small file system|geteuid|\bDATA,")
SKIP = re.compile(r"(?:skipTest|skipUnless|skipIf|SkipTest)\([^\n]*")
# Files that may search for programs: the common helper of the tests, browsers under other names, the packages of --full=devices, and a test that hides all programs.
LOOKS = {"tests/support/installed.py", "tests/viewer/page_test.py", "tests/devices/machine.py", "tests/house/site_links_test.py", "tests/house/requirements_test.py"}
NEEDED = re.compile(r"\bprogram\(\s*(?:\"[^\"]+\"|[A-Z]+), \"([^\"]+)\"\)")


def tests():
    names = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "tests/*.py", "python/tests/*.py"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    return {name: (ROOT / name).read_text() for name in names if (ROOT / name).exists()}


def packages():
    """The packages that ./test.sh installs."""
    words = 'source tools/packages.sh; echo "${WAYMARK_BUILD_PACKAGES[@]}" "${WAYMARK_TEST_PACKAGES[@]}"'
    return set(subprocess.run(["bash", "-c", words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split())


def wrong_skips(text):
    return [skip for skip in SKIP.findall(text) if not REASONS.search(skip)]


def registered(build):
    """The test names in the files that CMake writes for ctest."""
    texts = [path.read_text() for path in build.rglob("CTestTestfile.cmake")]
    return {name for text in texts for name in re.findall(r"^add_test\((?:\[=\[)?([\w.]+)", text, re.M)}


def left_out(names, modules):
    return {package: missing for package, tests in modules.items() if (missing := sorted(set(tests) - names))}


class Requirements(unittest.TestCase):
    def test_no_test_skips_because_of_a_missing_program(self):
        found = {name: wrong_skips(text) for name, text in tests().items() if name != "tests/house/requirements_test.py"}
        self.assertEqual({name: skips for name, skips in found.items() if skips}, {})

    def test_a_planted_skip_is_found(self):
        self.assertEqual(len(wrong_skips('    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")\n')), 1)
        self.assertEqual(len(wrong_skips('    self.skipTest("python3-yaml is not installed")\n')), 1)

    def test_no_module_and_its_tests_are_omitted(self):
        modules = dict(MODULES)
        if not re.search(r"^WAYMARK_PYTHON:\w+=OFF$", (BUILD / "CMakeCache.txt").read_text(), re.M):
            modules.update(PYTHON)
        names = registered(BUILD)
        self.assertEqual(left_out(names, modules), {}, "install these packages (./test.sh does), and run CMake again")
        self.assertEqual(left_out(names - {"mbot.wire"}, modules), {"liblcm-bin": ["mbot.wire"]})
        self.assertLessEqual(set(modules), packages())

    def test_programs_are_searched_in_one_place(self):
        self.assertEqual([name for name, text in tests().items() if "shutil.which(" in text and name not in LOOKS], [])

    def test_the_script_installs_all_programs_of_tests(self):
        needed = {package for text in tests().values() for package in NEEDED.findall(text)}
        self.assertGreaterEqual(needed, {"ffmpeg", "zstd", "openssl", "libxml2-utils", "qemu-user"})
        self.assertEqual(needed - packages(), set())


if __name__ == "__main__":
    unittest.main()
