#!/usr/bin/python3
"""Waymark on the network of ROS 2 against peers on Eclipse Cyclone DDS (peer.c): robot, recorder, listener.

Every test has a domain of its own, on this machine alone. WAYMARK_FULL=1 runs also the longer ones.

usage: wire_test.py PROGRAM PEER [TestClass.test]
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time
import unittest

from wire_case import COMMAND, LONG, PEER, PROGRAM, Lines, Wire, lines_of, until

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import wire_driver
from made import MAP_OF_SQUARE, made


def command_of(line):
    return COMMAND.match(line).groups()


def all_match(patterns, lines):
    """Whether each pattern matches a log line."""
    return all(any(re.search(pattern, line.get("text", "")) for line in lines) for pattern in patterns)


WATCHDOG = str(pathlib.Path(PROGRAM).with_name("waymark-watchdog"))


class Robot(Wire):
    def test_receives_from_and_drives_a_robot_of_another_vendor(self):
        peer = self.start(PEER, "robot", 60)
        robot = self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE)
        lines = lines_of(robot, lambda all: any(line["type"] == "image" for line in all) and len(all) > 60)
        self.assertEqual(lines[0], {"type": "hello", "protocol_version": 1, "name": "limo", "sends": [], "lockstep": False})
        odometry = [line for line in lines if line["type"] == "odometry"]
        self.assertGreater(len(odometry), 10)
        steps = [round(1e3 * (b["y_m"] - a["y_m"])) for a, b in zip(odometry, odometry[1:])]
        self.assertTrue(all(step >= 1 for step in steps), steps)
        self.assertEqual([line for line in lines if line["type"] == "imu"][0]["angular_velocity_rad_s"], [0, 0, 0.25])
        image = pathlib.Path([line for line in lines if line["type"] == "image"][-1]["path"]).read_bytes()
        header, pixels = image[: -1920 * 1080], image[-1920 * 1080:]
        self.assertTrue(header.startswith(b"P5") and b"1920 1080" in header, header)
        for k in (0, 1, 1919, 1920, 1_000_000, 1920 * 1080 - 1):
            self.assertEqual(pixels[k], (7 * k + k // 1920) % 256)
        wire_driver.drain(robot)
        words = " ".join(line["text"] for line in lines if line["type"] == "log")
        self.assertRegex(words, r"mounting\b.* tf\b")
        self.assertRegex(words, r"camera_info\b.* 1920 x 1080 ")
        wire_driver.move(robot, 0.3, -0.1)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        peer.kill()
        commands = COMMAND.findall(peer.stdout.read())
        moving = [command for command in commands if float(command[1]) == 0.3 and float(command[2]) == -0.1]
        self.assertGreater(len(moving), 10)
        self.assertEqual([float(v) for _, v, _ in commands[-3:]], [0, 0, 0], "stopped at the end")

    def test_two_simultaneous_drivers_fail_and_a_later_one_is_reported(self):
        self.start(PEER, "robot", 60, stdout=subprocess.DEVNULL)
        both = [self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(2)]
        for robot in both:
            self.assertEqual(json.loads(robot.stdout.readline())["type"], "hello")
        for robot in both:
            wire_driver.send_hello(robot)
            wire_driver.drain(robot)
        for robot in both:
            self.assertEqual(robot.wait(20), 1)
            self.assertIn("same time", robot.stderr.read())
        first = self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE)
        self.assertEqual(json.loads(first.stdout.readline())["type"], "hello")
        wire_driver.send_hello(first)
        time.sleep(3.5)
        self.start(PROGRAM, "ros2", "relay", stderr=subprocess.DEVNULL)  # publishes zero
        lines = lines_of(first, lambda all: any("obeys" in line.get("text", "") for line in all))
        self.assertIn("obeys", " ".join(line.get("text", "") for line in lines), "the other driver is reported")

    def test_a_listening_robot_process_publishes_no_command(self):
        for flags in (["--listen-only"], []):
            peer = self.start(PEER, "robot", 60)
            robot = self.start(PROGRAM, "ros2", "robot", "limo", *flags, stdin=subprocess.PIPE)
            if not flags:
                wire_driver.send_hello(robot, listen_only=True)
            lines = lines_of(robot, lambda all: sum(line["type"] == "odometry" for line in all) > 20)
            self.assertEqual(lines[0]["type"], "hello")
            wire_driver.drain(robot)
            listing = self.run_program("ros2", "topic", "list")
            self.assertIn("/odom [nav_msgs/msg/Odometry]", listing.stdout, "the listening process is discovered")
            self.assertNotRegex(listing.stdout, r"/cmd_vel \S+ [1-9]")
            wire_driver.move(robot, 0.3, -0.1)
            robot.stdin.close()
            self.assertEqual(robot.wait(20), 0)
            peer.kill()
            self.assertEqual(COMMAND.findall(peer.stdout.read()), [], "not even zero")
            self.next_domain()

    @LONG
    def test_doctor_reports_peers_quality_of_service_and_drivers(self):
        names = ("robot", "clock", "peers", "qos")
        alone = wire_driver.doctor(PROGRAM, "ros2:limo-sim-tags", self.environment)
        self.assertEqual([alone[name]["level"] for name in ("robot", "peers")], ["fail", "fail"], alone)
        self.assertEqual(alone["processor"]["level"], "ok")
        sim = self.start(PROGRAM, "robot-sim", "--world", "mbot-square", "--ros2", stdout=subprocess.DEVNULL)
        first = self.start(PROGRAM, "ros2", "robot", "limo-sim-tags", stdin=subprocess.PIPE)
        first.stdout.readline()
        wire_driver.drain(first)
        checks = wire_driver.doctor(PROGRAM, "ros2:limo-sim-tags", self.environment)
        self.assertEqual(checks["commands"]["level"], "warn", checks)
        self.assertIn("/cmd_vel", checks["commands"]["message"])
        wire_driver.send_hello(first)
        checks = wire_driver.doctor(PROGRAM, "ros2:limo-sim-tags", self.environment)
        self.assertEqual([checks[name]["level"] for name in (*names, "commands")], ["ok"] * 4 + ["fail"], checks)
        self.assertRegex(checks["commands"]["message"], rf"/cmd_vel\b.* waymark_robot \(process {first.pid} on ")
        for process in (first, sim):
            process.kill()
            process.wait()
        self.start(PEER, "best-effort", 60)
        profile = self.folder / "reliable.yaml"
        profile.write_text("robot: limo\nimu_topic: /imu\nreliable_sensors: true\n")
        self.assertEqual(wire_driver.doctor(PROGRAM, f"ros2:{profile}", self.environment)["qos"]["level"], "fail")

    @LONG
    def test_reports_mismatches_of_type_and_qos(self):
        self.start(PEER, "best-effort", 60)
        profile = self.folder / "reliable.yaml"
        profile.write_text("robot: limo\nimu_topic: /imu\nreliable_sensors: true\n")
        robot = self.run_program("ros2", "robot", profile)
        self.assertEqual(robot.returncode, 1)
        self.assertRegex(robot.stderr, "/odom .*best effort.* reliable ")
        self.assertRegex(robot.stderr, "/imu .*nav_msgs/msg/Odometry.* sensor_msgs/msg/Imu ")
        self.assertRegex(robot.stderr, "no odometry .*/odom")

    def test_reports_topics_without_publisher_or_subscriber(self):
        self.start(PEER, "robot", 60, stdout=subprocess.DEVNULL)
        profile = self.folder / "wrong.yaml"
        wrong = "robot: limo\ncommand_topic: /cmd_velocity\ndetections_topic: /wrong\n"
        profile.write_text(wrong + "ros_distro: noetic\n")
        refused = self.run_program("doctor", "--robot", f"ros2:{profile}")
        self.assertEqual(refused.returncode, 1, refused.stderr)
        self.assertRegex(refused.stderr, r"wrong.yaml \(ros_distro\): .*'noetic'")
        profile.write_text(wrong)
        checks = wire_driver.doctor(PROGRAM, f"ros2:{profile}", self.environment)
        self.assertIn("/wrong", checks["topics"]["message"])
        commands = checks["commands"]
        self.assertEqual(commands["level"], "fail")
        self.assertIn("/cmd_velocity", commands["message"])
        robot = self.start(PROGRAM, "ros2", "robot", profile, stdin=subprocess.PIPE)
        expected = (r"/cmd_velocity\b.*\bsubscriber", r"/wrong\b.*\bpublisher")
        lines = lines_of(robot, lambda all: all_match(expected, all))
        self.assertTrue(all_match(expected, lines), lines)


class Kill(Wire):
    def stop_times(self, victim, signal_number):
        """Drives through the watchdog, kills the victim, and returns the time of the last moving command after the kill [s]."""
        self.start(PEER, "robot", 60, stdout=subprocess.DEVNULL)
        listener = self.start(PEER, "listen", 120)
        heard = Lines(listener.stdout)
        heard.wait_for("listening\n")
        driver = self.start(sys.executable, wire_driver.__file__, WATCHDOG, PROGRAM, "ros2", "robot", "limo", stdout=subprocess.PIPE)
        self.assertEqual(driver.stdout.readline(), "drives\n")
        heard.wait_for_number(r"^cmd \d+ (\S+)", lambda speed: speed != 0, count=16)
        killed = time.monotonic_ns()
        target = {"driver": driver.pid, "watchdog": self.child_of(driver.pid)}[victim]
        os.kill(target, signal_number)
        until(lambda: [v for _, v, _ in COMMAND.findall(heard.text)][-3:] == ["0.000000"] * 3, "zero is repeated at the end")
        time.sleep(1)  # no moving command may follow
        listener.kill()
        commands = [(int(at), float(v)) for at, v, _ in COMMAND.findall(heard.rest())]
        before = [at for at, v in commands if v != 0 and at < killed]
        self.assertGreater(len(before), 15, "the robot drove")
        after = [at for at, v in commands if v != 0 and at > killed]
        zeros = [at for at, v in commands if v == 0 and at > killed]
        self.assertGreater(len(zeros), 2, "zero is published")
        gaps = [b - a for a, b in zip(before, before[1:])]
        print(f"{victim} {signal_number.name}: last moving command {(max(after, default=killed) - killed) / 1e6:.0f} ms, "
              f"first zero {(min(zeros) - killed) / 1e6:.0f} ms after the signal; commands at most {max(gaps) / 1e6:.0f} ms apart")
        return (max(after, default=killed) - killed) / 1e9, (min(zeros) - killed) / 1e9

    @staticmethod
    def child_of(pid):
        return int(subprocess.run(["pgrep", "-P", str(pid)], capture_output=True, text=True, check=True).stdout.split()[0])

    def test_a_killed_driver_stops_the_robot(self):
        moving, zero = self.stop_times("driver", signal.SIGKILL)
        self.assertLess(moving, 0.25)
        self.assertLess(zero, 0.25)

    @LONG
    def test_a_frozen_driver_stops_the_robot(self):
        moving, _ = self.stop_times("driver", signal.SIGSTOP)
        self.assertLess(moving, 0.5)

    @LONG
    def test_a_killed_watchdog_stops_the_robot(self):
        moving, _ = self.stop_times("watchdog", signal.SIGKILL)
        self.assertLess(moving, 0.25)


class Simulated(Wire):
    def test_robot_sim_is_a_robot_for_others(self):
        self.start(PROGRAM, "robot-sim", "--world", "circuit24", "--images", "--ros2", stdout=subprocess.DEVNULL)
        recorder = self.start(PEER, "record", 8)
        words = recorder.communicate(timeout=60)[0].split()
        seen = dict(zip(words[0:10:2], words[1:10:2]))
        self.assertGreater(int(seen["odometry"]), 50, words)
        self.assertGreater(int(seen["images"]), 3, words)
        self.assertEqual(seen["width"], "640")
        self.assertEqual((seen["links"], seen["z"]), ("1", "0.180"))
        moved = float(words[11]) ** 2 + float(words[12]) ** 2
        self.assertGreater(moved, 0.3 ** 2, words)

    def test_one_driver_and_one_simulator_at_a_time(self):
        drive = [PROGRAM, "ros2", "robot", "limo-sim-tags"]
        late = self.start(*drive, stdin=subprocess.DEVNULL)
        time.sleep(0.5)  # its input ends long before the robot sends
        self.assertIsNone(late.poll())
        robot = self.simulated(1, stderr=subprocess.PIPE)
        self.assertRegex(robot.stderr.readline(), "/odom .*mbot")
        mounted = self.run_program("ros2", "topic", "echo", "/tf_static", "--count", 1)
        self.assertIn("child_frame_id: 'camera_color_optical_frame'", mounted.stdout)
        self.assertIn("child_frame_id: 'laser'", mounted.stdout, "its /scan has this frame")
        self.assertIn("frame_id: 'laser'", self.run_program("ros2", "topic", "echo", "/scan", "--count", 1).stdout)
        self.assertTrue(json.loads(late.stdout.readline())["simulated"])
        self.assertEqual(late.wait(20), 0)

        code, _, words = wire_driver.end_of([PROGRAM, "robot-sim", "--world", "mbot-square", "--ros2"], self.environment)
        self.assertEqual(code, 1, words)
        self.assertRegex(words, "/odom: .* waymark")

        first = self.start(*drive, stdin=subprocess.PIPE)
        wire_driver.greet(first)
        code, out, words = wire_driver.end_of(drive, self.environment)
        self.assertEqual((code, out), (1, ""), words)
        self.assertIn(f"waymark_robot (process {first.pid} on ", words)
        code, out, words = wire_driver.end_of([*drive, "--share-commands"], self.environment)
        self.assertEqual(code, 0, words)

    def lap(self, folder, over_the_wire):
        """Teach, map, replay; returns the report of the replay."""
        lap, chart = folder / "lap.mcap", folder / "map"
        robot = ("--robot", "ros2:limo-sim-tags", "--robot-file", "mbot") if over_the_wire else ()
        seed = () if over_the_wire else ("--seed", 7)
        sim = self.simulated(1) if over_the_wire else None
        self.succeeds("teach", *robot, "--world", "mbot-square", "--driver", "scripted", "-o", lap)
        self.ends(sim)
        self.succeeds("map", lap, "-o", chart)
        sim = self.simulated(7) if over_the_wire else None
        node = ("--publish-ros2",) if over_the_wire else ()
        watcher = self.start(PEER, "watch", 14) if over_the_wire else None
        replay = self.succeeds("replay", chart, *robot, "--world", "mbot-square", *seed, *node, "--json")
        self.ends(sim)
        if watcher:
            words = watcher.communicate(timeout=60)[0].split()
            seen = dict(zip(words[::2], words[1::2]))
            self.assertGreater(int(seen["poses"]), 30, words)
            self.assertGreater(int(seen["links"]), 30, words)
            self.assertGreater(int(seen["odom"]), 30, words)
            self.assertEqual(seen["phase"], "replaying", words)
            self.assertTrue(0 < float(seen["variance"]) < 1, words)
        return json.loads(replay)

    def simulated(self, seed, **pipes):
        return self.start(PROGRAM, "robot-sim", "--world", "mbot-square", "--ros2", "--seed", seed, stdout=subprocess.DEVNULL, **pipes)

    def ends(self, sim):
        if sim:
            sim.send_signal(signal.SIGINT)
            self.assertEqual(sim.wait(20), 0)

    @LONG
    def test_the_loop_over_the_wire(self):
        """A lap taught, mapped and replayed over DDS follows its route as well as one in a single process."""
        wire, inside = (self.lap(self.folder_of(name), name == "wire") for name in ("wire", "inside"))
        rmse = [report["cross_track_rmse_m"] for report in (wire, inside)]
        print(f"cross-track error of the replay: {1e3 * rmse[0]:.1f} mm over DDS, {1e3 * rmse[1]:.1f} mm in one process")
        self.assertTrue(wire["finished"], wire)
        self.assertLess(rmse[0], 0.03)

    def test_a_robot_is_localised_for_others(self):
        """Another program may drive; the peer receives the pose, map to odom, and the phase."""
        self.simulated(1)
        chart = made(PROGRAM, *MAP_OF_SQUARE) / "map"
        watcher = self.start(PEER, "watch", 10)
        speakers = [self.start(PEER, "pose", 20, *where) for where in (("odom", 0, 0, 0), ("map", 0.5, 0.25, 0.5))]
        shown = self.run_program("localize", "--robot", "ros2:limo-sim-tags", "--robot-file", "mbot", "--map", chart, "--publish-ros2",
                                 "--duration-s", "6", "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        self.assertEqual([speaker.communicate(timeout=20)[0] for speaker in speakers], ["1 listen\n"] * 2)
        self.assertRegex(shown.stderr, "/initialpose: .*'odom'")
        self.assertRegex(shown.stderr, r"x 0\.50 m, y 0\.25 m, .*\b29 deg")
        *moments, report = [json.loads(line) for line in shown.stdout.splitlines()]
        self.assertGreater(report["certain"], 0.5 * report["estimates"], report)
        self.assertTrue(moments[-1]["pose"]["certain"], moments)
        words = watcher.communicate(timeout=60)[0].split()
        seen = dict(zip(words[::2], words[1::2]))
        self.assertGreater(int(seen["poses"]), 30, words)
        self.assertGreater(int(seen["links"]), 30, words)
        self.assertEqual(seen["phase"], "localizing", words)
        self.assertTrue(0 < float(seen["variance"]) < 1, words)

    @LONG
    def test_a_given_pose_stops_a_replay_until_it_is_resumed(self):
        """RViz's pose estimate with an error of half a metre, with two tags in view, a second after the start."""
        self.simulated(7)
        chart = made(PROGRAM, *MAP_OF_SQUARE) / "map"
        listener = self.start(PEER, "listen", 60)
        self.assertEqual(listener.stdout.readline(), "listening\n")
        commands = []
        threading.Thread(target=lambda: commands.extend((int(at), float(v)) for at, v, _ in map(command_of, listener.stdout)), daemon=True).start()
        replay = self.start(PROGRAM, "replay", chart, "--robot", "ros2:limo-sim-tags", "--robot-file", "mbot", "--publish-ros2", "--json",
                            stdin=subprocess.PIPE)
        deadline = time.monotonic() + 30
        while not any(v > 0.1 for _, v in commands) and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertEqual(self.start(PEER, "pose", 20, "map", 0.5, 0.5, 1).communicate(timeout=40)[0], "1 listen\n")
        time.sleep(1)
        given = time.monotonic_ns()
        time.sleep(7)  # longer than the time after which a replay is aborted
        resumed = time.monotonic_ns()
        self.assertRegex(self.call("replay"), "^yes: replay .*paused\n$")
        report = json.loads(replay.communicate(timeout=60)[0])
        self.assertGreater(max(v for at, v in commands if at < given), 0.1, "the robot drove")
        self.assertEqual({v for at, v in commands if given < at < resumed}, {0})
        self.assertTrue(report["finished"], report)
        self.assertGreater(max(v for at, v in commands if at > resumed), 0.1, "and continues")

    def test_services_are_the_buttons_of_a_session(self):
        self.simulated(1)
        self.start(PROGRAM, "run", "--robot", "ros2:limo-sim-tags", "--robot-file", "mbot", "--world", "mbot-square", "--driver", "lines",
                   "--publish-ros2", "-o", self.folder / "session", stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + 30
        while self.call("pause").endswith("''\n") and time.monotonic() < deadline:
            pass  # the robot has not sent yet
        calls = [("pause", "no", "idle"), ("start_teach", "yes", "idle"), ("start_teach", "no", "teaching"), ("stop", "yes", "teaching")]
        for service, success, phase in calls:
            self.assertRegex(self.call(service), rf"^{success}: {service} .*\b{phase}'?\n$")

    def call(self, service):
        return self.start(PEER, "call", 20, service).communicate(timeout=40)[0]

    def folder_of(self, name):
        (self.folder / name).mkdir()
        return self.folder / name


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
