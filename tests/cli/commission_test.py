#!/usr/bin/python3
"""First drives in real time: robots with and without a working watchdog, Ctrl-C at any moment, the speed limit."""
import json
import os
import pathlib
import pty
import re
import select
import signal
import subprocess
import sys
import time

from harness import PROGRAM, InFolder, event, unittest
import golden_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROBOT = '''
import json, math, os, select, sys, time
stubborn, log = "--stubborn" in sys.argv, open("orders.log", "a")
def send(kind, **values):
    os.write(1, (json.dumps({"type": kind, "stamp_s": time.monotonic(), **values}) + "\\n").encode())
send("hello", protocol_version=1, name="two wheels", sends=["odometry", "wheels"])
x = y = yaw = speed = turn = left = right = 0.0
then = time.monotonic()
buffer, asked, over = b"", (0.0, 0.0), False
while not over:
    time.sleep(0.02)
    while select.select([0], [], [], 0)[0] and not over:
        more = os.read(0, 65536)
        buffer, over = buffer + more, not more
        *lines, buffer = buffer.split(b"\\n")
        for order in map(json.loads, lines):
            over = over or order["type"] == "bye"
            if order["type"] == "velocity":
                if not (stubborn and "stop" in order):
                    asked = order["speed_m_s"], order["yaw_rate_rad_s"]
                print(asked[0], asked[1], order.get("stop", "-"), file=log, flush=True)
    dt, then = time.monotonic() - then, time.monotonic()
    speed, turn = speed + 0.2 * (asked[0] - speed), turn + 0.2 * (asked[1] - turn)
    x, y, yaw = x + dt * speed * math.cos(yaw), y + dt * speed * math.sin(yaw), yaw + dt * turn
    left, right = left + dt * (speed - 0.086 * turn) / 0.045, right + dt * (speed + 0.086 * turn) / 0.045
    send("odometry", x_m=x, y_m=y, yaw_rad=yaw, speed_m_s=speed, yaw_rate_rad_s=turn)
    send("wheels", left_rad=left, right_rad=right)
    if over and stubborn:
        over = False
        signalled = time.monotonic()
        while time.monotonic() - signalled < 1.6:  # keeps driving until it is killed
            time.sleep(0.02)
            send("odometry", x_m=x, y_m=y, yaw_rad=yaw, speed_m_s=speed, yaw_rate_rad_s=turn)
        break
'''


class FirstDrive(InFolder):
    def setUp(self):
        super().setUp()
        (self.folder / "robot.py").write_text(ROBOT)
        (self.folder / "my_robot.yaml").write_text((ROOT / "share/robots/limo.yaml").read_text())
        self.words = ["--robot", f"process:exec {sys.executable} robot.py", "--robot-file", "my_robot.yaml"]

    def orders(self):
        lines = [line.split(" ", 2) for line in (self.folder / "orders.log").read_text().splitlines()]
        return [(float(speed), float(turn), why) for speed, turn, why in lines]

    def fastest_of_a_taught_moment(self, *words):
        """Commands 0.4 m/s for half a second, above the limit of a robot without commission. Returns the highest commanded speed and the messages."""
        (self.folder / "orders.log").write_text("")
        driven = subprocess.Popen([PROGRAM, "run", *self.words, *words, "--anchor", "0", "--tag-size-m", "0.16", "--driver", "lines", "-o", "session"],
                                  cwd=self.folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        words = event.Lines(driven.stderr)
        words.wait_for("idle. ")
        for line in ["go"] + ["drive 0.4 0.2"] * 10 + ["stop", "quit"]:
            driven.stdin.write(line + "\n")
            driven.stdin.flush()
            time.sleep(0.1)
        driven.stdin.close()
        driven.stdout.read()
        driven.wait(30)
        return max(speed for speed, _, _ in self.orders()), words.rest()

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "WAYMARK_FULL: a minute")
    def test_a_passed_first_drive_removes_the_speed_limit(self):
        before = (self.folder / "my_robot.yaml").read_text()
        drive = self.run_here("commission", *self.words, "--yes", "--json")
        report = drive.records[0]
        self.assertEqual(drive.code, 0, drive.out + drive.err)
        self.assertTrue(report["passed"])
        levels = {found["check"]: found["level"] for found in report["findings"]}
        for stop in ("stop.zero", "stop.request", "stop.silence", "stop.kill"):
            self.assertEqual(levels[stop], "ok", report)
        self.assertEqual(levels["stop.cable"], "warn", "no person pulled a cable")
        self.assertLess(report["figures"]["kill_stopping_s"], 1)
        self.assertEqual(report["file"], "my_robot.yaml")
        self.assertEqual((self.folder / report["kept"]).read_text(), before)
        after = (self.folder / "my_robot.yaml").read_text()
        self.assertTrue(after.startswith(before))
        self.assertIn("\ncommissioned:", after)
        fastest, messages = self.fastest_of_a_taught_moment()
        self.assertAlmostEqual(fastest, 0.4, delta=1e-9)
        self.assertNotIn("waymark commission", messages)
        (self.folder / "my_robot.yaml").write_text(after.replace("limits: {speed_m_s: 1.0,", "limits: {speed_m_s: 0.9,", 1))
        fastest, messages = self.fastest_of_a_taught_moment()
        self.assertAlmostEqual(fastest, 0.15, delta=1e-9)
        self.assertRegex(messages, r"limits\.speed_m_s .*\b1\b.* 0\.9")

    def test_the_speed_is_limited_without_a_commission(self):
        fastest, messages = self.fastest_of_a_taught_moment()
        self.assertAlmostEqual(fastest, 0.15, delta=1e-9)
        self.assertEqual(messages.count("waymark commission --robot"), 1, messages)

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "WAYMARK_FULL: half a minute")
    def test_a_robot_that_keeps_driving_when_its_driver_is_killed_fails(self):
        self.words[1] += " --stubborn"
        drive = self.run_here("commission", *self.words, "--yes", "--json", "--skip-lifted")
        self.assertEqual(drive.code, 1, drive.err)
        failed = {found["check"] for found in drive.records[0]["findings"] if found["level"] == "fail"}
        self.assertIn("stop.silence", failed, drive.out)
        self.assertIn("stop.kill", failed, drive.out)
        self.assertIn("passed: false", (self.folder / "my_robot.yaml").read_text())
        _, messages = self.fastest_of_a_taught_moment()
        self.assertIn("(stop.silence, stop.kill)", messages)

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "WAYMARK_FULL: two minutes")
    def test_ctrl_c_at_any_moment_stops_the_robot_and_does_not_change_its_file(self):
        before = (self.folder / "my_robot.yaml").read_text()
        for seconds in (0.4, 1.6, 5.5, 12.5, 15.0, 18.5):
            (self.folder / "orders.log").write_text("")
            process = subprocess.Popen([PROGRAM, "commission", *self.words, "--yes"], cwd=self.folder, stdin=subprocess.DEVNULL,
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            time.sleep(seconds)
            self.assertIsNone(process.poll())
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=30)
            self.assertEqual(process.returncode, 130, (seconds, out + err))
            self.assertEqual((self.folder / "my_robot.yaml").read_text(), before)
            if self.orders():
                self.assertEqual(self.orders()[-1][:2], (0, 0), (seconds, err))

    def test_a_closed_standard_input_is_an_error(self):
        drive = self.run_here("commission", *self.words, input="")
        self.assertEqual(drive.code, 2, drive.err)
        self.assertIn("--yes", drive.err)
        golden_page.expect(self, "commission", drive.err)

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "WAYMARK_FULL: ten seconds")
    def test_a_negative_answer_fails_the_drive(self):
        drive = self.run_here("commission", *self.words, "--json", input="\nn\ny\n")
        self.assertEqual(drive.code, 1, drive.err)
        failed = [found for found in drive.records[0]["findings"] if found["level"] == "fail"]
        self.assertEqual(failed[0]["check"], "command.speed_m_s")

    def test_an_unwritable_output_is_reported_before_the_drive(self):
        drive = self.run_here("commission", *self.words, "--yes", "-o", "no/such/folder.yaml")
        self.assertEqual(drive.code, 1, drive.err)
        self.assertIn("no/such", drive.err)
        golden_page.expect(self, "commission", drive.err)
        self.assertFalse((self.folder / "orders.log").exists(), "the robot was started")

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "WAYMARK_FULL: a minute and a half")
    def test_an_early_space_bar_and_an_unpulled_cable_do_not_fail_the_drive(self):
        """A person at a terminal presses the space bar before the robot moves, then while it drives, and pulls no cable."""
        words = ["commission", *self.words]
        child, terminal = pty.fork()
        if child == 0:
            os.chdir(self.folder)
            os.execv(PROGRAM, [str(PROGRAM), *words])
        messages, answered, early = "", 0, True
        deadline = time.monotonic() + 150
        while time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.05)[0]:
                try:
                    more = os.read(terminal, 65536)
                except OSError:
                    break
                messages += more.decode(errors="replace")
            fresh = messages[answered:]
            if "press Enter" in fresh:
                answered = len(messages)
                os.write(terminal, b"\n")
            elif "y or n" in fresh:
                answered = len(messages)
                os.write(terminal, b"n\n" if "cable" in fresh else b"y\n")
            elif re.search(r"press\b.* space bar", fresh):
                answered = len(messages)
                time.sleep(0.1 if early else 2.5)
                os.write(terminal, b" ")
                early = False
        _, status = os.waitpid(child, 0)
        self.assertEqual(os.waitstatus_to_exitcode(status), 0, messages)
        self.assertIn("pressed", messages, "the early press is reported")
        self.assertRegex(messages, r"ok +stops +stop.key ")
        self.assertRegex(messages, r"warn +stops +stop.cable ")

    def test_a_simulated_robot_passes_and_is_not_written(self):
        drive = self.run_here("commission", "--world", "circuit24", "--json")
        self.assertEqual(drive.code, 0, drive.out + drive.err)
        self.assertTrue(drive.records[0]["simulated"])
        self.assertFalse((self.folder / "limo.yaml").exists())


if __name__ == "__main__":
    unittest.main()
