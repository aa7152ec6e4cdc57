#!/usr/bin/python3
"""Teach, map and replay over LIMO's serial protocol: `waymark robot-sim --limo` is the robot; all bytes pass through limo_wire.Decoder.

A course of 4 m; with WAYMARK_FULL=1 also a whole lap of circuit24, and the course over a bad cable.

usage: loop_test.py PROGRAM [TestClass.test]
"""
import contextlib
import json
import math
import os
import pathlib
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest

from limo_wire import FEEDBACK, MOTION, Decoder

PROGRAM = sys.argv[1]
ROOT = pathlib.Path(__file__).resolve().parents[2]
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")


class Tap(threading.Thread):
    """A pseudo-terminal in front of another: forwards and decodes bytes in both directions, and can be disconnected."""

    def __init__(self, beyond):
        super().__init__(daemon=True)
        self.robot = os.open(beyond, os.O_RDWR | os.O_NOCTTY)
        self.driver, self.slave = os.openpty()
        for end in (self.robot, self.slave):
            tty.setraw(end)
        for end in (self.robot, self.driver):
            os.set_blocking(end, False)
        self.path = os.ttyname(self.slave)
        self.decoders = {self.robot: Decoder(), self.driver: Decoder()}
        self.frames = {self.robot: [], self.driver: []}
        self.ended = False
        self.start()

    def run(self):
        while not self.ended:
            ready, _, _ = select.select([self.robot, self.driver], [], [], 0.1)
            for end in ready:
                received = os.read(end, 65536)
                now = time.monotonic()
                self.frames[end] += [(now, *frame) for frame in self.decoders[end].feed(received)]
                with contextlib.suppress(BlockingIOError):  # without a reader the bytes are lost, as on a cable
                    os.write(self.driver if end == self.robot else self.robot, received)
        for end in (self.robot, self.driver, self.slave):
            os.close(end)

    def end(self):
        self.ended = True
        self.join()

    def commands(self):
        return [(at, values[0] / 1e3, values[1] / 1e3) for at, number, values in self.frames[self.driver] if number == MOTION]


class Loop(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        world = (ROOT / "share/worlds/circuit24.yaml").read_text().split("path_closed:")[0]
        points = [[round(3 * math.cos(a), 4), round(3 * math.sin(a), 4)] for a in (math.radians(6 * k - 40) for k in range(14))]
        (self.folder / "course.yaml").write_text(world + f"path_closed: false\npath_m: {points}\n")
        self.pipe = self.folder / "beside"
        self.tap = None

    def simulated(self, world, seed, *words):
        sim = subprocess.Popen([PROGRAM, "robot-sim", "--limo", "--world", world, "--robot-file", "limo", "--beside", self.pipe,
                                "--seed", str(seed), *words], stdout=subprocess.PIPE, text=True, cwd=self.folder)
        self.addCleanup(sim.stdout.close)
        self.addCleanup(sim.wait)
        self.addCleanup(sim.kill)
        self.tap = Tap(sim.stdout.readline().strip())
        return sim

    def end(self, sim):
        self.tap.end()
        sim.send_signal(signal.SIGINT)
        self.assertEqual(sim.wait(20), 0)

    def test_two_simulators_on_one_pipe_are_refused(self):
        sim = self.simulated("course.yaml", 1)
        words = [PROGRAM, "robot-sim", "--limo", "--world", "course.yaml", "--beside", self.pipe]
        second = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=30, cwd=self.folder)
        self.assertEqual(second.returncode, 1, second.stderr)
        self.assertIn(f"waymark (process {sim.pid})", second.stderr)
        self.end(sim)

    def robot(self):
        return f"process:exec '{PROGRAM}' limo robot {self.tap.path} --beside {self.pipe} --simulated"

    def program(self, *words):
        never_ends, keep = os.pipe()
        try:
            done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=300, stdin=never_ends, cwd=self.folder)
        finally:
            os.close(never_ends)
            os.close(keep)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def over_the_wire(self, world, *bad_cable):
        """Teach, map, replay; returns the report of the replay and its tap."""
        sim = self.simulated(world, 1, *bad_cable)
        self.program("teach", "--robot", self.robot(), "--world", world, "--robot-file", "limo", "--driver", "scripted", "--speed-m-s", "0.5",
                     "-o", "wire.mcap")
        self.end(sim)
        self.program("map", "wire.mcap", "-o", "wire")
        sim = self.simulated(world, 7, *bad_cable)
        report = json.loads(self.program("replay", "wire", "--robot", self.robot(), "--world", world, "--robot-file", "limo", "--json"))
        self.end(sim)
        return report, self.tap

    def in_process(self, world):
        self.program("teach", "--world", world, "--robot-file", "limo", "--driver", "scripted", "--speed-m-s", "0.5", "-o", "inside.mcap")
        self.program("map", "inside.mcap", "-o", "inside")
        return json.loads(self.program("replay", "inside", "--world", world, "--robot-file", "limo", "--seed", "7", "--json"))

    def compare(self, world, most_m, *bad_cable):
        wire, tap = self.over_the_wire(world, *bad_cable)
        inside = self.in_process(world)
        rmse, most = ([report[key] for report in (wire, inside)] for key in ("cross_track_rmse_m", "cross_track_max_m"))
        print(f"{world} {' '.join(bad_cable)}: cross-track RMSE {1e3 * rmse[0]:.1f} mm over the wire, {1e3 * rmse[1]:.1f} mm in process; "
              f"maximum {1e3 * most[0]:.1f} and {1e3 * most[1]:.1f} mm")
        self.assertTrue(wire["finished"], wire)
        self.assertLess(rmse[0], most_m)
        return tap

    def test_a_course_of_four_metres(self):
        tap = self.compare("course.yaml", 0.02)
        self.assertEqual([decoder.torn for decoder in tap.decoders.values()], [0, 0], "both sides send only frames")
        moving = [at for at, speed, _ in tap.commands() if speed]
        gaps = sorted(b - a for a, b in zip(moving, moving[1:]))
        self.assertLess(gaps[len(gaps) // 2], 0.05)
        self.assertTrue(all(command[1:] == (0, 0) for command in tap.commands()[-4:]))
        driven = sum(values[0] / 1e3 for _, number, values in tap.frames[tap.robot] if number == FEEDBACK) / 50
        self.assertAlmostEqual(driven, 4, delta=0.5)

    @LONG
    def test_a_whole_lap(self):
        self.compare("circuit24", 0.02)

    @LONG
    def test_a_course_over_a_bad_cable(self):
        self.compare("course.yaml", 0.02, "--wire-noise", "0.001", "--wire-dropped", "0.0005", "--wire-torn", "0.01")

    def test_a_killed_program_and_a_cut_cable_during_a_drive(self):
        """If `waymark` is killed while driving, zero is sent. If the cable is cut, the drive ends with an error, and the robot stops."""
        words = ["teach", "--world", "course.yaml", "--robot-file", "limo", "--driver", "scripted"]
        for fault in ("kill", "cut"):
            sim = self.simulated("course.yaml", 1)
            drive = subprocess.Popen([PROGRAM, *words, "--robot", self.robot(), "-o", f"{fault}.mcap"], stdin=subprocess.PIPE, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                                     cwd=self.folder, text=True)
            deadline = time.monotonic() + 20
            while not any(speed for _, speed, _ in self.tap.commands()) and time.monotonic() < deadline:
                time.sleep(0.02)
            time.sleep(1)
            self.assertIsNone(drive.poll(), "still driving")
            happened = time.monotonic()
            if fault == "kill":
                drive.kill()
                time.sleep(0.6)
                moving = [at - happened for at, speed, _ in self.tap.commands() if speed and at > happened]
                zeros = [at - happened for at, speed, _ in self.tap.commands() if not speed and at > happened]
                print(f"kill -9 of waymark: last moving command {1e3 * max(moving, default=0):.0f} ms, first zero {1e3 * zeros[0]:.0f} ms")
                self.assertLess(max(moving, default=0), 0.25)
                self.assertLess(zeros[0], 0.25)
                drive.communicate()
                self.end(sim)
            else:
                self.tap.end()
                _, err = drive.communicate(timeout=20)
                print(f"cut cable: waymark ended after {1e3 * (time.monotonic() - happened):.0f} ms")
                self.assertNotEqual(drive.returncode, 0)
                self.assertIn(self.tap.path, err)
                sim.kill()


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
