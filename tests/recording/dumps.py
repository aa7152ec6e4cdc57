"""Shared by the tests of other programs' recordings: output of dump_log, real data, a temporary folder."""
import collections
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

DUMP, LCM_DUMP = (os.path.abspath(sys.argv.pop(1)) for _ in range(2)) if len(sys.argv) > 2 else sys.exit(
    "usage: …_test.py DUMP_LOG LCM_DUMP [unittest options]")
FULL = bool(os.environ.get("WAYMARK_FULL"))

Message = collections.namedtuple("Message", "topic time size crc cdr")
Problem = collections.namedtuple("Problem", "kind key count words")


class Log:
    """A recording as printed by dump_log."""

    def __init__(self, path, *options):
        done = subprocess.run([DUMP, *options, path], capture_output=True, text=True, timeout=200, check=False)
        assert done.returncode in (0, 1), f"killed by signal {-done.returncode}: {done.stderr}"
        self.code, self.lines = done.returncode, done.stdout.splitlines()
        rows = [line.split("\t") for line in done.stderr.splitlines()]
        self.words = done.stderr
        self.problems = {r[1]: Problem(r[0], r[1], int(r[2]), r[3]) for r in rows if r[0] in ("damage", "trap", "note")}
        self.description = next((r[3] for r in rows if r[0] == "log"), "")

    @property
    def messages(self):
        rows = (line.split("\t") for line in self.lines)
        return [Message(r[0], int(r[1]), int(r[2]), int(r[3], 16), int(r[4], 16)) for r in rows]

    @property
    def samples(self):
        return [line.split("\t") for line in self.lines]

    @property
    def channels(self):
        """Topic -> (type, encoding, count); schema lines are skipped."""
        rows = (line.split("\t") for line in self.lines)
        return {r[0]: (r[1], r[2], int(r[3])) for r in rows if len(r) == 5}


def real_data(relative):
    """A path inside WAYMARK_DATA. If it is missing the test is skipped, or fails if WAYMARK_REQUIRE_DATA is set."""
    path = pathlib.Path(os.environ.get("WAYMARK_DATA", "/nonexistent")) / relative
    if path.exists():
        return path
    if os.environ.get("WAYMARK_REQUIRE_DATA"):
        raise AssertionError(f"WAYMARK_DATA does not contain {relative}")
    raise unittest.SkipTest(f"WAYMARK_DATA does not contain {relative}")


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-recording-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def assert_in_order(self, times):
        self.assertEqual(times, sorted(times))


def main():
    program = unittest.main(exit=False, verbosity=2)
    result = program.result
    only_skipped = result.wasSuccessful() and result.testsRun == len(result.skipped)
    sys.exit(77 if only_skipped else int(not result.wasSuccessful()))
