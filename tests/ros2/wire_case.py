"""Shared code of the tests over DDS: a domain per test, and processes that end with it.

usage: …_test.py PROGRAM PEER …
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

from wire_peer import environment

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from claim import domain  # noqa: E402
from event import Lines, until  # noqa: E402, F401  (tests import them from here)

PROGRAM, PEER = sys.argv[1:3]
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")
COMMAND = re.compile(r"^cmd (\d+) (\S+) (\S+)$", re.M)  # of the peer: nanoseconds, m/s, rad/s


class Wire(unittest.TestCase):
    def setUp(self):
        self.next_domain()
        self.running = []
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def next_domain(self):
        self.environment = environment(domain())

    def tearDown(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout, process.stderr):
                if pipe:
                    pipe.close()

    def start(self, *words, **pipes):
        pipes = {"stdout": subprocess.PIPE, "text": True, **pipes}
        self.running.append(subprocess.Popen([str(word) for word in words], env=self.environment, **pipes))
        return self.running[-1]

    def run_program(self, *words, timeout=60):
        never_ends, keep = os.pipe()
        try:
            return subprocess.run([PROGRAM, *[str(word) for word in words]], env=self.environment, capture_output=True, text=True,
                                  timeout=timeout, stdin=never_ends)
        finally:
            os.close(never_ends)
            os.close(keep)

    def wait_for_subscription(self, topic):
        """Waits until discovery has found a subscription; each list searches for some seconds."""
        found = re.compile(rf"^{topic} \[.*[1-9]\d* subscription", re.M)
        until(lambda: found.search(self.run_program("ros2", "topic", "list").stdout), f"{topic} has no subscriber")

    def succeeds(self, *words):
        done = self.run_program(*words, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout


def lines_of(robot, enough):
    """The lines of a robot process until `enough` returns true, or for 30 s."""
    lines = []
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and not enough(lines):
        line = robot.stdout.readline()
        if not line:
            break
        lines.append(json.loads(line))
    return lines
