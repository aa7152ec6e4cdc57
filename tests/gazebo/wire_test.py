#!/usr/bin/python3
"""Waymark on the network of Gazebo. The peers are `waymark robot-sim --gazebo`, which replaces the Gazebo server, and, for names, types
and numbers, Debian's independent ign-transport-topic. Each test has its own partition, on this computer only.
WAYMARK_FULL=1 also runs the longer tests.

usage: wire_test.py PROGRAM [TestClass.test]
"""
import contextlib
import itertools
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import wire_driver

PROGRAM = sys.argv[1]
PEER = "/usr/libexec/ignition/transport11/ign-transport-topic"
LANE = pathlib.Path(__file__).with_name("lane.yaml")
PARTITIONS = itertools.count(1)
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")
WATCHDOG = str(pathlib.Path(PROGRAM).with_name("waymark-watchdog"))
MOVE = json.dumps({"type": "velocity", "sequence": 1, "speed_m_s": 0.3, "yaw_rate_rad_s": -0.1}) + "\n"
COMMANDS = "/model/limo/cmd_vel"


class Wire(unittest.TestCase):
    def setUp(self):
        self.environment = {**os.environ, "IGN_IP": "127.0.0.1", "IGN_PARTITION": f"waymark-test-{os.getpid()}-{next(PARTITIONS)}"}
        self.running = []
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def tearDown(self):
        for process in self.running:
            if process.poll() is None:
                process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout, process.stderr):
                if pipe:
                    with contextlib.suppress(BrokenPipeError):
                        pipe.close()

    def start(self, *words, **pipes):
        pipes = {"stdout": subprocess.PIPE, "text": True, **pipes}
        self.running.append(subprocess.Popen([str(word) for word in words], env=self.environment, **pipes))
        return self.running[-1]

    def simulation(self, seed=1):
        return self.start(PROGRAM, "robot-sim", "--world", LANE, "--gazebo", "limo", "--seed", seed, stdout=subprocess.DEVNULL)

    def ask(self, *words, timeout=20):
        return subprocess.run([str(word) for word in words], env=self.environment, capture_output=True, text=True, timeout=timeout)

    def robot(self):
        """The robot process and its lines as they arrive."""
        process = self.start(PROGRAM, "gazebo", "robot", "limo", stdin=subprocess.PIPE)
        lines = []
        threading.Thread(target=lambda: lines.extend(map(json.loads, process.stdout)), daemon=True).start()
        return process, lines

    def until(self, condition, seconds=20):
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            time.sleep(0.005)
        self.assertTrue(condition())


class Listener:
    """Velocities on the command topic with their arrival times, received by the peer."""

    def __init__(self, test):
        self.speeds = []
        process = test.start(PEER, "-e", "-t", COMMANDS)
        threading.Thread(target=self.listen, args=(process.stdout,), daemon=True).start()

    def listen(self, lines):
        part, speed = "", 0.0
        for line in lines:
            word = line.strip()
            if word.endswith("{"):
                part = word.split()[0]
            elif part == "linear" and word.startswith("x:"):
                speed = float(word.split()[1])
            elif not word and part:  # the end of a message
                self.speeds.append((time.monotonic(), speed))
                part, speed = "", 0.0

    def moving(self):
        return [at for at, speed in self.speeds if speed != 0]


class Peer(Wire):
    def test_names_and_types_of_topics_are_those_of_fortress(self):
        self.simulation()
        expected = {"/camera": "Image", "/camera_info": "CameraInfo", "/clock": "Clock", "/imu": "IMU", "/joy": "Joy", "/scan": "LaserScan",
                    "/model/limo/odometry": "Odometry", "/model/limo/pose": "Pose_V"}
        self.until(lambda: self.ask(PEER, "-l").stdout.split() == sorted(expected))
        for topic, kind in expected.items():
            self.assertIn(f", ignition.msgs.{kind}\n", self.ask(PEER, "-i", "-t", topic).stdout)
        listing = self.ask(PROGRAM, "gazebo", "topics")
        self.assertEqual(listing.stdout.splitlines(), [f"{topic} [ignition.msgs.{kind}]" for topic, kind in sorted(expected.items())])
        image = self.ask(PEER, "-e", "-n", 1, "-t", "/camera").stdout
        self.assertIn("width: 640\nheight: 480\nstep: 1920\n", image)
        self.assertIn("pixel_format_type: RGB_INT8\n", image)

    def test_reads_messages_of_another_program(self):
        robot, lines = self.robot()
        texts = {"Odometry": "pose {position {x: 1.5 y: -2} orientation {z: 1}} twist {linear {x: 0.25}}",
                 "IMU": "angular_velocity {z: 0.5} linear_acceleration {z: 9.8}"}
        topics = {"Odometry": "/model/limo/odometry", "IMU": "/imu"}
        stamp = itertools.count(1)
        sent = []
        # The first messages come before the hello and are not forwarded. Each peer publishes once and may need seconds for it;
        # others start meanwhile, so that the simulation does not count as ended.
        deadline = time.monotonic() + 60
        while len({line["type"] for line in lines} & {"odometry", "imu"}) < 2 and time.monotonic() < deadline:
            if sum(process.poll() is None for process in sent) < 8:
                header = f"header {{stamp {{sec: 5 nsec: {next(stamp)}}}}}"
                sent += [self.start(PEER, "-t", topics[kind], "-m", f"ignition.msgs.{kind}", "-p", f"{header} {text}") for kind, text in texts.items()]
            time.sleep(0.3)
        self.assertEqual(lines[0]["type"], "hello")
        self.assertTrue(lines[0]["simulated_time"])
        odometry = [line for line in lines if line["type"] == "odometry"][0]
        self.assertEqual([odometry[key] for key in ("x_m", "y_m", "speed_m_s")], [1.5, -2, 0.25])
        self.assertAlmostEqual(abs(odometry["yaw_rad"]), 3.14159265, 6)
        self.assertEqual(odometry["stamp_ns"] // 10**9, 5)
        imu = [line for line in lines if line["type"] == "imu"][0]
        self.assertEqual((imu["angular_velocity_rad_s"], imu["linear_acceleration_m_s2"]), ([0, 0, 0.5], [0, 0, 9.8]))
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)

    def drive(self):
        """Drives the robot while a peer receives its commands."""
        simulation = self.simulation()
        listener = Listener(self)
        robot, lines = self.robot()

        def orders():
            try:
                while True:
                    robot.stdin.write(MOVE)
                    robot.stdin.flush()
                    time.sleep(0.05)
            except (BrokenPipeError, ValueError, OSError):
                pass

        self.until(lambda: len(lines) > 20)
        threading.Thread(target=orders, daemon=True).start()
        self.until(lambda: len(listener.moving()) > 20)
        return simulation, listener, robot, lines

    def test_a_killed_simulation_stops_the_robot_and_is_reported(self):
        simulation, listener, robot, lines = self.drive()
        before = listener.moving()[-20:]
        self.assertLess(max(b - a for a, b in zip(before, before[1:])), 0.25, "commands are repeated")
        killed = time.monotonic()
        simulation.kill()
        self.until(lambda: any(line["type"] == "log" and "odometry" in line["text"] for line in lines))
        self.until(lambda: sum(at > killed + 0.3 for at, _ in listener.speeds) > 5)
        last = max(listener.moving()) - killed
        words = [line["text"] for line in lines if line["type"] == "log"]
        print(f"simulation killed: last moving command {1e3 * last:.0f} ms after; {words}")
        self.assertLess(last, 0.3)
        self.assertNotIn("paused", words[-1])
        self.assertGreater(len([1 for at, speed in listener.speeds if at > killed + 0.3]), 5, "zero is repeated")
        self.assertEqual(robot.wait(20), 1, "the process ends when no more messages come")

    def test_a_killed_driver_stops_the_robot(self):
        self.simulation()
        listener = Listener(self)
        driver = self.start(sys.executable, wire_driver.__file__, WATCHDOG, PROGRAM, "gazebo", "robot", "limo")
        self.assertEqual(driver.stdout.readline(), "drives\n")
        self.until(lambda: len(listener.moving()) > 20)
        killed = time.monotonic()
        os.kill(driver.pid, signal.SIGKILL)
        self.until(lambda: any(at > killed and speed == 0 for at, speed in listener.speeds))
        time.sleep(1)  # no moving command may follow
        last = max(listener.moving()) - killed
        zero = min(at for at, speed in listener.speeds if at > killed and speed == 0) - killed
        print(f"driver killed: last moving command {1e3 * last:.0f} ms, first zero {1e3 * zero:.0f} ms after")
        self.assertLess(last, 0.25)
        self.assertLess(zero, 0.25)


class Alone(Wire):
    def test_robot_sim_reports_that_it_waits_and_its_first_command(self):
        sim = self.start(PROGRAM, "robot-sim", "gazebo", "limo", "--world", LANE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.assertRegex(sim.stderr.readline(), "/model/limo/odometry .*/model/limo/cmd_vel")
        robot, lines = self.robot()
        wire_driver.send_hello(robot)
        self.until(lambda: lines)
        robot.stdin.write(MOVE)
        robot.stdin.flush()
        self.assertIn("command", wire_driver.next_report(sim))

    def test_one_driver_and_one_simulator_at_a_time(self):
        late = self.start(PROGRAM, "gazebo", "robot", "limo", stdin=subprocess.DEVNULL)
        time.sleep(0.5)  # its input ends long before the robot sends
        self.assertIsNone(late.poll())
        self.simulation()
        self.assertEqual(json.loads(late.stdout.readline())["type"], "hello")
        self.assertEqual(late.wait(20), 0)

        simulate = [PROGRAM, "robot-sim", "--world", LANE, "--gazebo", "limo"]
        code, _, words = wire_driver.end_of(simulate, self.environment)
        self.assertEqual(code, 1, words)
        self.assertRegex(words, "/model/limo/odometry: .* tcp://127.0.0.1:")

        first, lines = self.robot()
        wire_driver.send_hello(first)
        self.until(lambda: lines)
        drive = [PROGRAM, "gazebo", "robot", "limo"]
        code, out, words = wire_driver.end_of(drive, self.environment)
        self.assertEqual((code, out), (1, ""), words)
        self.assertIn(", at tcp://127.0.0.1:", words)
        code, out, words = wire_driver.end_of([*drive, "--share-commands"], self.environment)
        self.assertEqual(code, 0, words)
        self.assertIsNone(first.poll())

    @LONG
    def test_doctor_only_listens(self):
        self.simulation()
        checks = wire_driver.doctor(PROGRAM, "gazebo:limo", self.environment)
        self.assertEqual([checks[check]["level"] for check in ("robot", "clock", "commands")], ["ok"] * 3, checks)
        listener, heard = self.robot()
        wire_driver.send_hello(listener, listen_only=True)
        self.until(lambda: heard)
        checks = wire_driver.doctor(PROGRAM, "gazebo:limo", self.environment)
        self.assertEqual(checks["commands"]["level"], "ok", "a listening process is not a driver")
        first, lines = self.robot()
        wire_driver.send_hello(first)
        self.until(lambda: lines)
        checks = wire_driver.doctor(PROGRAM, "gazebo:limo", self.environment)
        self.assertEqual([checks[check]["level"] for check in ("robot", "clock", "commands")], ["ok", "ok", "fail"], checks)
        self.assertIn("at tcp://127.0.0.1:", checks["commands"]["message"])


class WithoutRobot(Wire):
    def test_reports_the_searched_partition_and_address(self):
        robot = self.start(PROGRAM, "gazebo", "robot", "limo", stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        began = time.monotonic()
        words = robot.stderr.readline()
        self.assertIn("/model/limo/odometry", words)
        self.assertRegex(words, rf"'{self.environment['IGN_PARTITION']}' .*127\.0\.0\.1 \(IGN_IP\)")
        self.assertLess(time.monotonic() - began, 8)
        self.assertEqual(robot.stdout.read() if robot.poll() else "", "", "no hello")

    @LONG
    def test_reports_existing_topics_and_gives_up(self):
        profile = self.folder / "other.yaml"
        profile.write_text("robot: limo-gazebo\nodometry_topic: /model/other/odometry\ncommand_topic: /model/other/cmd_vel\n")
        self.simulation()
        robot = self.ask(PROGRAM, "gazebo", "robot", profile, timeout=60)
        self.assertEqual(robot.returncode, 1)
        self.assertIn("/model/other/odometry", robot.stderr)
        self.assertIn("/model/limo/odometry [ignition.msgs.Odometry]", robot.stderr)


class Loop(Wire):
    def succeeds(self, *words):
        never_ends, keep = os.pipe()
        try:
            done = subprocess.run([PROGRAM, *map(str, words)], env=self.environment, capture_output=True, text=True, timeout=400, stdin=never_ends)
        finally:
            os.close(never_ends)
            os.close(keep)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def lap(self, name, over_the_wire):
        """Teach, map, replay; returns the report of the replay."""
        folder = self.folder / name
        folder.mkdir()
        lap, chart = folder / "lap.mcap", folder / "map"
        robot = ("--robot", "gazebo:limo") if over_the_wire else ("--images",)
        reports = []
        for seed, words in ((1, ("teach", "--driver", "scripted", "-o", lap)), (7, ("replay", chart, "--json"))):
            simulation = self.simulation(seed) if over_the_wire else None
            seeds = () if over_the_wire else ("--seed", seed)
            reports.append(self.succeeds(*words, *robot, "--world", LANE, *seeds))
            if simulation:
                simulation.send_signal(signal.SIGINT)
                self.assertEqual(simulation.wait(20), 0)
            if words[0] == "teach":
                self.succeeds("map", lap, "-o", chart)
        return json.loads(reports[1])

    @LONG
    def test_a_lane_taught_mapped_and_replayed(self):
        wire, inside = self.lap("wire", True), self.lap("inside", False)
        rmse = [report["cross_track_rmse_m"] for report in (wire, inside)]
        print(f"cross-track error of the replay: {1e3 * rmse[0]:.1f} mm over Gazebo's topics, {1e3 * rmse[1]:.1f} mm in one process")
        self.assertTrue(wire["finished"], wire)
        self.assertTrue(inside["finished"], inside)
        self.assertLess(rmse[0], 0.03)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
