#!/usr/bin/python3
"""`waymark limo robot` against a LIMO on a pseudo-terminal that shares no code with it (limo_wire.py): the frames it sends, and faults.
WAYMARK_FULL=1 also runs the longer tests.

usage: wire_test.py PROGRAM [TestClass.test]
"""
import contextlib
import json
import math
import os
import pathlib
import random
import signal
import subprocess
import sys
import threading
import time
import unittest

from limo_wire import MODE, Limo

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import wire_driver
from made import MAP_OF_SQUARE, made

PROGRAM = sys.argv[1]
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")
WATCHDOG = str(pathlib.Path(PROGRAM).with_name("waymark-watchdog"))


class Robot:
    """The process of a LIMO, which receives the order twenty times a second."""

    def __init__(self, port, *words, program=(PROGRAM,), sends=True):
        self.process = subprocess.Popen([*program, "limo", "robot", port, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        self.lines, self.words = [], []
        self.order = (0.0, 0.0)
        self.sends = sends
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.listen, self.read_stderr, self.send_orders)]
        for thread in self.threads:
            thread.start()

    def listen(self):
        for line in self.process.stdout:
            self.lines.append((time.monotonic(), json.loads(line)))

    def read_stderr(self):
        for line in self.process.stderr:
            self.words.append(line)

    def send_orders(self):
        sequence = 0
        while self.process.poll() is None:
            sequence += 1
            if self.sends:
                line = {"type": "velocity", "sequence": sequence, "speed_m_s": self.order[0], "yaw_rate_rad_s": self.order[1]}
                try:
                    self.process.stdin.write(json.dumps(line) + "\n")
                    self.process.stdin.flush()
                except (OSError, ValueError):
                    return
            time.sleep(0.05)

    def of(self, kind):
        return [line for _, line in list(self.lines) if line["type"] == kind]

    def output(self):
        return " | ".join([line["text"] for line in self.of("log")] + self.words)


def until(condition, seconds=10):
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.005)
    return condition()


class Wire(unittest.TestCase):
    def setUp(self):
        self.ends, self.threads = [], []

    def tearDown(self):
        for process in self.ends:
            if process.poll() is None:
                process.kill()
            process.wait()
        for thread in self.threads:
            thread.join(2)
        for process in self.ends:
            for pipe in (process.stdin, process.stdout, process.stderr):
                with contextlib.suppress(OSError, AttributeError):  # an order that was not read
                    pipe.close()

    def robot(self, limo, *words, greeted=True, sends=True):
        robot = Robot(limo.path, *words, sends=sends)
        self.ends.append(robot.process)
        self.threads += robot.threads
        if greeted:
            self.assertTrue(until(lambda: robot.of("hello")), robot.output())
        return robot

    def drives(self, limo, robot, order=(0.3, 0.2)):
        robot.order = order
        self.assertTrue(until(lambda: abs(limo.speed) > 0), robot.output())

    def stops_within(self, limo, event, seconds=0.3):
        """The last moving command comes within `seconds` after the event, followed by zeros."""
        self.assertTrue(until(lambda: len(limo.commands(event + seconds)) >= 4), "zero is repeated")
        moving = [at - event for at, speed, rate, *_ in limo.commands(event) if speed or rate]
        zeros = [at - event for at, speed, rate, *_ in limo.commands(event) if not (speed or rate)]
        print(f"{self.id().split('.')[-1]}: last moving command {1e3 * max(moving, default=0):.0f} ms, first zero {1e3 * zeros[0]:.0f} ms")
        self.assertLess(max(moving, default=0), seconds)
        self.assertLess(zeros[0], seconds)


class Drives(Wire):
    def test_sends_command_mode_first_then_orders_at_least_twenty_times_a_second(self):
        limo = Limo()
        robot = self.robot(limo)
        self.assertEqual(limo.frames[0][1], MODE)
        self.assertEqual([values for _, number, values in limo.frames if number == MODE][0], (1, 0, 0))
        self.assertTrue(all(not any(values) for _, *values in limo.commands()), "nothing moves before the first order")
        self.drives(limo, robot, (0.3, -0.2))
        time.sleep(1)
        robot.process.stdin.close()
        self.assertEqual(robot.process.wait(5), 0, robot.output())
        commands = limo.commands()
        moving = [command for command in commands if command[1]]
        self.assertEqual({command[1:] for command in moving}, {(0.3, -0.2, 0.0, 0.0)})
        gaps = sorted(b[0] - a[0] for a, b in zip(moving, moving[1:]))
        print(f"commands: median {1e3 * gaps[len(gaps) // 2]:.0f} ms apart, worst {1e3 * gaps[-1]:.0f} ms")
        self.assertLess(gaps[len(gaps) // 2], 0.05)
        self.assertTrue(all(command[1] == 0 for command in commands[-4:]), "four times zero at the end")
        self.assertEqual(limo.decoder.torn, 0)
        odometry = robot.of("odometry")
        driven = math.hypot(odometry[-1]["x_m"], odometry[-1]["y_m"])
        self.assertAlmostEqual(driven, math.hypot(limo.x, limo.y), delta=0.05)
        self.assertAlmostEqual(robot.of("imu")[-20]["angular_velocity_rad_s"][2], -0.2, delta=0.01)
        self.assertIn("11.8 V", robot.output())

    def test_stamps_are_periodic(self):
        limo = Limo()
        robot = self.robot(limo)
        time.sleep(1.8)
        stamps = [line["stamp_ns"] / 1e9 for line in robot.of("odometry")]
        arrivals = [at for at, line in list(robot.lines) if line["type"] == "odometry"]
        self.assertTrue(all(b > a for a, b in zip(stamps, stamps[1:])))
        self.assertTrue(all(-0.1 < at - stamp for at, stamp in zip(arrivals, stamps)))
        gaps = sorted(b - a for a, b in zip(stamps[50:], stamps[51:]))
        self.assertAlmostEqual(gaps[len(gaps) // 2], 0.02, delta=0.002)

    def test_ackermann_is_steered(self):
        limo = Limo(drive=1)
        robot = self.robot(limo, "--robot-file", "limo-ackermann")
        self.drives(limo, robot, (0.3, 0.3))
        time.sleep(0.3)
        _, speed, rate, lateral, steering = limo.commands()[-1]
        self.assertEqual((speed, rate, lateral), (0.3, 0, 0))
        # Inner wheel for a radius of 1 m: atan(0.2 / (1 - 0.086)); the message contains the angle / 2.47.
        self.assertAlmostEqual(steering, math.atan(0.2 / (1 - 0.086)) / 2.47, delta=6e-4)

    def test_a_drive_that_differs_from_the_robot_file_is_an_error(self):
        robot = self.robot(Limo(drive=1), greeted=False)
        self.assertEqual(robot.process.wait(10), 1)
        self.assertIn("--robot-file limo-ackermann", robot.output())

    def test_mecanum_wheels_are_announced(self):
        limo = Limo(drive=2)
        self.robot(limo, "--drive", "mecanum")
        self.assertEqual([values for _, number, values in limo.frames if number == MODE][0], (1, 0, 1))


class Faults(Wire):
    def test_tolerates_noise_and_truncated_frames(self):
        limo, chance = Limo(), random.Random(5)

        def spoil(frame):
            fate = chance.random()
            if fate < 0.01:
                return frame[:chance.randrange(14)]
            if fate < 0.02:
                return bytes(chance.randrange(256) for _ in range(9)) + frame
            if fate < 0.03:
                return frame[:5] + frame[4:]
            return frame
        robot = self.robot(limo)
        limo.spoil = spoil
        self.drives(limo, robot, (0.3, 0.2))
        time.sleep(2)
        robot.order = (0.0, 0.0)
        self.assertTrue(until(lambda: limo.speed == 0))
        time.sleep(0.2)
        newest = robot.of("odometry")[-1]
        self.assertLess(math.hypot(newest["x_m"] - limo.x, newest["y_m"] - limo.y), 0.05, f"{newest}, it is at {limo.x} {limo.y}")
        self.assertAlmostEqual(newest["yaw_rad"], math.remainder(limo.yaw, 2 * math.pi), delta=0.02)
        self.assertIsNone(robot.process.poll(), robot.output())

    def test_does_not_compete_with_the_remote_control(self):
        limo = Limo()
        robot = self.robot(limo)
        self.drives(limo, robot)
        taken = time.monotonic()
        limo.obeys, limo.own_speed, limo.control_mode = False, 0.4, 0
        self.stops_within(limo, taken)
        asked = [at for at, number, _ in limo.frames if number == MODE and at > taken]
        self.assertEqual(asked, [])
        self.assertIn("remote", robot.output())
        limo.own_speed, limo.obeys, robot.order = 0, True, (0.0, 0.0)
        self.assertTrue(until(lambda: limo.control_mode == 1, 3), "requested once order and robot are at zero")
        time.sleep(0.3)  # the driver still sends zero
        self.drives(limo, robot)
        self.assertTrue(until(lambda: robot.of("log")[-1]["text"].startswith("LIMO "), 1), robot.output())

    def test_a_silent_limo_is_sent_zero_and_reported(self):
        limo = Limo()
        robot = self.robot(limo)
        self.drives(limo, robot)
        silent = time.monotonic()
        limo.speaks = False
        self.stops_within(limo, silent, 0.35)  # 0.25 s from the last feedback, commands are 40 ms apart
        self.assertTrue(until(lambda: "0.25 s" in robot.output(), 1), robot.output())
        self.assertTrue(until(lambda: any(line["text"].startswith(limo.path) for line in robot.of("log")), 3), robot.output())
        self.assertNotIn("IMU", robot.output())

    def test_a_motor_error_is_zero_and_reported(self):
        limo = Limo()
        robot = self.robot(limo)
        self.drives(limo, robot)
        broken = time.monotonic()
        limo.errors = 1 << 5
        self.stops_within(limo, broken)
        self.assertTrue(until(lambda: "motor 3" in robot.output(), 1), robot.output())

    def test_a_cut_cable_ends_the_process_with_an_error(self):
        limo = Limo()
        robot = self.robot(limo)
        self.drives(limo, robot)
        cut = time.monotonic()
        limo.cable_is_cut()
        self.assertEqual(robot.process.wait(5), 1)
        print(f"cut cable: the process ended after {1e3 * (time.monotonic() - cut):.0f} ms")
        self.assertTrue(until(lambda: robot.words, 1), robot.output())
        self.assertIn(limo.path, robot.words[-1])
        self.assertIn(limo.path, robot.of("log")[-1]["text"], "also reported to the driver")

    def test_sends_zero_if_orders_cease(self):
        limo = Limo()
        robot = self.robot(limo)
        self.drives(limo, robot)
        robot.sends = False
        self.stops_within(limo, time.monotonic(), 0.32)  # 0.25 s from the last order

    def test_a_killed_driver_stops_the_robot(self):
        limo = Limo()
        driver = subprocess.Popen([sys.executable, wire_driver.__file__, WATCHDOG, PROGRAM, "limo", "robot", limo.path], stdout=subprocess.PIPE, text=True)
        self.ends.append(driver)
        self.assertTrue(until(lambda: limo.speed == 0.3))
        time.sleep(0.5)
        killed = time.monotonic()
        os.kill(driver.pid, signal.SIGKILL)
        self.stops_within(limo, killed, 0.25)


class Listens(Wire):
    """LIMO is driven by remote control while Waymark localizes it."""

    def listen(self, limo, process):
        self.ends.append(process)
        line = json.loads(process.stdout.readline())
        self.assertEqual(line["type"], "hello")
        types = {json.loads(process.stdout.readline())["type"] for _ in range(100)}
        self.assertLessEqual({"odometry", "imu"}, types)
        wire_driver.drain(process)
        time.sleep(0.5)
        process.stdin.close()
        process.wait(10)
        self.assertEqual(limo.frames, [], "nothing is sent, not even at the end")
        self.assertEqual(limo.control_mode, 0)

    def test_behind_a_listening_watchdog_control_is_not_requested(self):
        """As `waymark localize --robot "process:waymark limo robot PORT"` starts it."""
        limo = Limo()
        self.listen(limo, subprocess.Popen([WATCHDOG, "--listen", f"'{PROGRAM}' limo robot {limo.path}"], stdin=subprocess.PIPE,
                                           stdout=subprocess.PIPE, text=True))

    def test_localize_leaves_control_to_the_remote(self):
        limo = Limo()
        chart = made(PROGRAM, *MAP_OF_SQUARE) / "map"
        done = subprocess.run([PROGRAM, "localize", "--robot", f"process:exec '{PROGRAM}' limo robot {limo.path}", "--map", chart, "--duration-s", "2"],
                              capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)
        self.assertIn("11.8 V", done.stderr, "LIMO is connected")
        self.assertEqual(limo.frames, [], done.stderr)

    def test_command_mode_comes_with_the_first_order(self):
        limo = Limo()
        robot = self.robot(limo, sends=False)
        self.assertEqual(limo.frames, [], "nothing is sent before the first order")
        robot.sends = True
        self.assertTrue(until(lambda: limo.control_mode == 1), robot.output())
        self.assertEqual(limo.frames[0][1], MODE)
        self.drives(limo, robot)


class Refusals(Wire):
    def refused(self, *words):
        done = subprocess.run([PROGRAM, "limo", "robot", *words], capture_output=True, text=True, timeout=20, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 1, done.stderr)
        return done.stderr

    def test_errors_of_unusable_ports_contain_the_port_and_its_user(self):
        for port in ("/dev/ttyNothing", "/dev/null"):
            self.assertIn(f"{port}: ", self.refused(port))
        limo = Limo()
        self.robot(limo)
        self.assertRegex(self.refused(limo.path), r"\(process \d+\)")
        free = Limo()
        reader = subprocess.Popen(["/usr/bin/tail", "-f", free.path], stdout=subprocess.DEVNULL)  # takes no lock
        self.ends.append(reader)
        time.sleep(0.5)
        self.assertIn(f"tail (process {reader.pid})", self.refused(free.path))


class WithoutOrders(Wire):
    """`waymark limo robot PORT < /dev/null`, the first step of docs/howto/limo.md."""

    def output_of(self, port, code):
        done = subprocess.run([PROGRAM, "limo", "robot", port], capture_output=True, text=True, timeout=40, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_requests_control_until_limo_accepts_and_ends(self):
        limo = Limo()
        began = time.monotonic()
        self.assertIn("accepts", self.output_of(limo.path, 0))
        self.assertEqual(limo.control_mode, 1)
        self.assertEqual([c for c in limo.commands(began) if c[1] or c[2]], [], "nothing moved")

    def test_a_silent_port_is_an_error(self):
        master, slave = os.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        err = self.output_of(os.ttyname(slave), 1)
        self.assertIn(f"{os.ttyname(slave)}: ", err)
        self.assertIn("answer", err)


class Doctor(Wire):
    def lines(self, port):
        done = subprocess.run([PROGRAM, "doctor", "--robot", f"limo:{port}", "--json"], capture_output=True, text=True, timeout=60)
        return {line["check"]: line for line in json.loads(done.stdout)["checks"]}, done.returncode

    def test_checks_of_a_robot_without_and_with_faults(self):
        limo = Limo()
        lines, _ = self.lines(limo.path)
        self.assertEqual([lines[check]["level"] for check in ("robot", "battery", "errors", "drive")], ["ok"] * 4, lines)
        self.assertIn("11.8 V", lines["battery"]["message"])
        self.assertRegex(lines["robot"]["message"], r"\b(4[5-9]|5\d) Hz")
        self.assertEqual(limo.frames, [], "nothing is sent")
        limo.battery, limo.errors = 101, 1 << 3
        lines, code = self.lines(limo.path)
        self.assertEqual([lines[check]["level"] for check in ("battery", "errors")], ["warn", "fail"])
        self.assertIn("motor 1", lines["errors"]["message"])
        self.assertEqual(code, 1)

    def test_the_user_of_a_port_is_the_driver_not_the_simulator(self):
        sim = subprocess.Popen([PROGRAM, "robot-sim", "--limo", "--world", "circuit24"], stdout=subprocess.PIPE, text=True)
        self.ends.append(sim)
        port = sim.stdout.readline().strip()
        driver = subprocess.Popen([PROGRAM, "limo", "robot", port, "--simulated"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.ends.append(driver)
        self.assertTrue(json.loads(driver.stdout.readline())["simulated"])
        wire_driver.drain(driver)
        lines, code = self.lines(port)
        self.assertEqual((code, lines["robot"]["level"]), (1, "fail"))
        self.assertIn(f"waymark (process {driver.pid})", lines["robot"]["message"])
        self.assertNotIn("limo_base", lines["robot"]["command"])
        code, _, words = wire_driver.end_of([PROGRAM, "limo", "robot", port])
        self.assertEqual(code, 1)
        self.assertIn(f"waymark (process {driver.pid})", words)

    def test_ctrl_c_ends_the_checks(self):
        limo = Limo()
        doctor = subprocess.Popen([PROGRAM, "doctor", "--robot", f"limo:{limo.path}"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.ends.append(doctor)
        time.sleep(0.5)  # it listens to LIMO for 1.5 s, then measures the processor for two
        pressed = time.monotonic()
        doctor.send_signal(signal.SIGINT)
        words = doctor.communicate(timeout=20)[1]
        self.assertEqual(doctor.returncode, 130, words)
        self.assertLess(time.monotonic() - pressed, 1)
        self.assertIn("stopped", words)

    def test_usage_errors_differ_from_failed_checks(self):
        for robot in ("nothing:here", "limo:"):
            code, _, words = wire_driver.end_of([PROGRAM, "doctor", "--robot", robot])
            self.assertEqual(code, 2, words)
            self.assertIn("limo:", words)

    @LONG
    def test_a_port_that_cannot_be_used(self):
        limo = Limo()
        limo.speaks = False
        for port, word in (("/dev/ttyNothing", "no such"), (limo.path, "byte")):
            robot = self.lines(port)[0]["robot"]
            self.assertEqual(robot["level"], "fail", robot)
            self.assertIn(word, robot["message"])
        limo.speaks = True
        driver = self.robot(limo)
        self.assertIn(f"(process {driver.process.pid})", self.lines(limo.path)[0]["robot"]["message"])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
