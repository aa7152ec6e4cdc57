"""Shared by the tests of the command line: a folder with images, and the program run in it."""
import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import images

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import event  # noqa: E402, F401  (tests import both from here)
from installed import program  # noqa: E402, F401

PROGRAM = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else sys.exit("usage: …_test.py PROGRAM [unittest options]")
TAG_FAR = 0.5  # px: these tests check identity and place of tags, not accuracy


class Outcome:
    def __init__(self, process):
        self.code, self.out, self.err = process.returncode, process.stdout, process.stderr

    @property
    def records(self):
        return [json.loads(line) for line in self.out.splitlines()]


def waymark(*words, cwd=None, **options):
    options.setdefault("stdout", subprocess.PIPE)
    process = subprocess.run([PROGRAM, *map(str, words)], stderr=subprocess.PIPE, text=True, errors="replace", cwd=cwd,
                             timeout=120, check=False, **options)
    return Outcome(process)


def rest_of(process, timeout=60):
    """The remaining stdout and stderr of a process whose output was read by lines. communicate() would lose the data that
    readline() has read ahead."""
    with concurrent.futures.ThreadPoolExecutor(2) as readers, process.stdout, process.stderr:
        out, err = (readers.submit(stream.read) for stream in (process.stdout, process.stderr))
        process.wait(timeout)
        return out.result(timeout), err.result(timeout)


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-cli-"))
        self.addCleanup(shutil.rmtree, self.folder)
        images.fill(self.folder)

    def run_here(self, *words, **options):
        outcome = waymark(*words, cwd=self.folder, **options)
        self.assertGreaterEqual(outcome.code, 0, f"killed by signal {-outcome.code}: {outcome.err}")
        self.assertNotIn("internal error", outcome.err)
        return outcome

    def assert_tags(self, record, tags):
        self.assertEqual([d["tag"] for d in record["detections"]], [f"{family}:{number}" for family, number, *_ in tags])
        for detection, tag in zip(record["detections"], tags):
            found = [value for corner in detection["corners_px"] for value in corner]
            for a, b in zip(found, images.corners(*tag)):
                self.assertLess(abs(a - b), TAG_FAR, detection)
