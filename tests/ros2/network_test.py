#!/usr/bin/python3
"""Waymark on the network of ROS 2 under bad conditions: datagrams lost, late and out of order (lossy.c), peers that end and restart,
damaged images, the clock of a simulation. The peers run on Eclipse Cyclone DDS (peer.c). WAYMARK_FULL=1 also runs the longer tests.

usage: network_test.py PROGRAM PEER LOSSY [TestClass.test]
"""
import pathlib
import signal
import subprocess
import sys
import time
import unittest

from wire_case import COMMAND, LONG, PEER, PROGRAM, Lines, Wire, lines_of, until
from wire_peer import MULTICAST

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import wire_driver
from made import MAP_OF_SQUARE, made

LOSSY = sys.argv[3]


def of_type(lines, kind):
    return [line for line in lines if line["type"] == kind]


def log_text(lines):
    return " ".join(line["text"] for line in of_type(lines, "log"))


class Images(Wire):
    JPEG = ROOT / "docs/images/camera/jpeg.jpg"

    def test_uses_compressed_images_if_only_they_are_published(self):
        self.start(PEER, "compressed", 30, self.JPEG)
        robot = self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        lines = lines_of(robot, lambda all: len(of_type(all, "image")) >= 4)
        self.assertIn(self.JPEG.read_bytes(), [pathlib.Path(line["path"]).read_bytes() for line in of_type(lines, "image")])
        robot.kill()
        self.assertIn("/camera/color/image_raw/compressed", log_text(lines) + robot.stderr.read())

    @LONG
    def test_skips_damaged_images(self):
        self.start(PEER, "compressed", 30, self.JPEG)
        done = self.run_program("localize", "--robot", "ros2:limo", "--map", made(PROGRAM, *MAP_OF_SQUARE) / "map", "--duration-s", 4)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"\d+ unreadable ")
        self.assertNotRegex(done.stdout, r"x -?\d", "no pose is printed")

    @LONG
    def test_publishes_images_with_tags_for_subscribers(self):
        self.start(PROGRAM, "robot-sim", "--world", "circuit24", "--images", "--ros2", stdout=subprocess.DEVNULL)
        self.start(PROGRAM, "run", "--robot", "ros2:limo-sim", "--world", "circuit24", "--driver", "lines", "--publish-ros2", "-o",
                   self.folder / "session", stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
        seen = self.start(PEER, "view", 10).communicate(timeout=40)[0].split()
        self.assertGreater(int(seen[1]), 5, seen)
        self.assertEqual(seen[1], seen[3], "each is a whole JPEG")


class Time(Wire):
    @LONG
    def test_uses_simulated_time_if_the_profile_requires_it(self):
        profile = self.folder / "simulated.yaml"
        profile.write_text("robot: limo\ncommand_stamped: true\nuse_sim_time: true\n")
        peer = self.start(PEER, "simulated", 12)
        robot = self.start(PROGRAM, "ros2", "robot", profile, stdin=subprocess.PIPE)
        lines = lines_of(robot, lambda all: len(of_type(all, "odometry")) > 100)
        self.assertTrue(lines[0]["simulated_time"], lines[0])
        stamps = [line["stamp_ns"] / 1e9 for line in of_type(lines, "odometry")]
        self.assertTrue(all(100 < stamp < 104 for stamp in stamps), stamps)
        wire_driver.move(robot, 0.3, 0.1, 140)
        paused = lines_of(robot, lambda all: "paused" in log_text(all))
        self.assertIn("odometry", log_text(paused))
        robot.stdin.close()
        commands = [line.split() for line in peer.communicate(timeout=40)[0].splitlines()]
        self.assertTrue(all(100 <= int(stamp) <= 103 for _, stamp, _, _ in commands), "stamped by the clock of the simulation")
        self.assertIn("0.300", [speed for _, _, speed, state in commands if state == "runs"])
        self.assertEqual({speed for _, _, speed, state in commands[-20:] if state == "paused"}, {"0.000"}, "zero while paused")

    @LONG
    def test_reports_a_missing_clock(self):
        profile = self.folder / "simulated.yaml"
        profile.write_text("robot: limo\nuse_sim_time: true\n")
        self.start(PEER, "robot", 30)
        robot = self.run_program("ros2", "robot", profile)
        self.assertEqual(robot.returncode, 1)
        self.assertIn("(use_sim_time)", robot.stderr)


class Network(Wire):
    """One of ten datagrams of both sides is lost; each is up to 30 ms late, so that they arrive out of order."""

    def setUp(self):
        super().setUp()
        self.environment["LD_PRELOAD"] = LOSSY

    @LONG
    def test_loss_and_reordering_do_not_disturb_a_drive(self):
        peer = self.start(PEER, "robot", 60)
        robot = self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE)
        lines = lines_of(robot, lambda all: len(of_type(all, "odometry")) > 150)
        stamps = [line["stamp_ns"] for line in of_type(lines, "odometry")]
        self.assertGreater(len(stamps), 150)
        self.assertEqual(stamps, sorted(set(stamps)), "in order without duplicates")
        share = len(stamps) * 2e7 / (stamps[-1] - stamps[0])
        print(f"best effort: {100 * share:.0f} % of the odometry was received")
        self.assertTrue(0.5 < share < 0.97, "some are lost, but not most")
        self.assertRegex(log_text(lines), r"mounting\b.* tf\b", "sent once, reliably")
        wire_driver.drain(robot)
        wire_driver.move(robot, 0.3, -0.1, 60)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        heard = Lines(peer.stdout)
        until(lambda: [v for _, v, _ in COMMAND.findall(heard.text)][-1:] == ["0.000000"], "zero is the last command")
        peer.kill()
        commands = COMMAND.findall(heard.rest())
        self.assertGreater(len([v for _, v, _ in commands if float(v) == 0.3]), 40, "reliable")
        self.assertEqual(float(commands[-1][1]), 0, "stopped at the end")

    @LONG
    def test_a_killed_driver_stops_the_robot(self):
        self.start(PEER, "robot", 60, stdout=subprocess.DEVNULL)
        listener = self.start(PEER, "listen", 120)
        heard = Lines(listener.stdout)
        heard.wait_for("listening\n")
        watchdog = pathlib.Path(PROGRAM).with_name("waymark-watchdog")
        driver = self.start(sys.executable, wire_driver.__file__, watchdog, PROGRAM, "ros2", "robot", "limo")
        self.assertEqual(driver.stdout.readline(), "drives\n")
        heard.wait_for_number(r"^cmd \d+ (\S+)", lambda speed: speed != 0, count=21)
        killed = time.monotonic_ns()
        driver.send_signal(signal.SIGKILL)
        until(lambda: COMMAND.findall(heard.text)[-1][1] == "0.000000", "zero is the last command")
        time.sleep(1)  # no moving command may follow
        listener.kill()
        commands = [(int(at), float(v)) for at, v, _ in COMMAND.findall(heard.rest())]
        self.assertGreater(len([v for at, v in commands if v and at < killed]), 20, "the robot drove")
        last = max((at for at, v in commands if v and at > killed), default=killed) - killed
        print(f"last moving command {last / 1e6:.0f} ms after the kill")
        self.assertLess(last, 0.3e9)
        self.assertEqual(commands[-1][1], 0)


class Peers(Wire):
    def test_finds_peers_that_announce_themselves_only_by_multicast(self):
        self.environment["CYCLONEDDS_URI"] = MULTICAST
        self.start(PEER, "crowd", 20, 1, stdout=subprocess.DEVNULL)
        for _ in range(4):  # each searches for 3 s, which may be too short for the peer to start on a busy computer
            listing = self.run_program("ros2", "topic", "list")
            if listing.stdout:
                break
        self.assertIn("/crowd/topic_0 [sensor_msgs/msg/Joy] 1 publisher", listing.stdout, listing.stderr)

    def test_two_robots_on_the_same_topics_are_not_driven(self):
        for _ in range(2):
            self.start(PEER, "robot", 60, stdout=subprocess.DEVNULL)
        until(lambda: "/odom [nav_msgs/msg/Odometry] 2 publishers" in self.run_program("ros2", "topic", "list").stdout, "both publish /odom")
        code, out, words = wire_driver.end_of([PROGRAM, "ros2", "robot", "limo"], self.environment)
        self.assertEqual((code, out), (1, ""), words)
        two = r"\b2 .*/odom"
        self.assertRegex(words, two)
        found = wire_driver.doctor(PROGRAM, "ros2:limo", self.environment)["robots"]
        self.assertEqual(found["level"], "fail")
        self.assertRegex(found["message"], two)

    @LONG
    def test_drives_one_of_two_robots_with_namespaces(self):
        peers = [self.start(PEER, "robot", 30, name) for name in ("left/", "right/")]
        profile = self.folder / "right.yaml"
        profile.write_text("robot: limo\nodometry_topic: /right/odom\ncommand_topic: /right/cmd_vel\n")
        robot = self.start(PROGRAM, "ros2", "robot", profile, stdin=subprocess.PIPE)
        self.assertTrue(of_type(lines_of(robot, lambda all: len(all) > 10), "odometry"))
        wire_driver.drain(robot)
        wire_driver.move(robot, 0.3, 0)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        for peer in peers:
            peer.kill()
        left, right = (COMMAND.findall(peer.stdout.read()) for peer in peers)
        self.assertEqual(left, [])
        self.assertIn("0.300000", [v for _, v, _ in right])

    @LONG
    def test_a_restarted_robot_is_received_and_driven_again(self):
        first = self.start(PEER, "robot", 60)
        robot = self.start(PROGRAM, "ros2", "robot", "limo", stdin=subprocess.PIPE)
        self.assertTrue(of_type(lines_of(robot, lambda all: len(all) > 30), "odometry"))
        first.kill()
        first.wait()
        time.sleep(3)
        second = self.start(PEER, "robot", 60)
        back = time.monotonic()
        # The second peer counts y from zero again.
        lines = lines_of(robot, lambda all: any(line["y_m"] < 0.02 for line in of_type(all, "odometry")))
        received = time.monotonic() - back
        print(f"received again {received:.1f} s after the restart")
        self.assertLess(received, 5)
        self.assertLess(of_type(lines, "odometry")[-1]["y_m"], 0.02)
        wire_driver.drain(robot)
        wire_driver.move(robot, 0.3, 0)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        second.kill()
        self.assertIn("0.300000", [v for _, v, _ in COMMAND.findall(second.stdout.read())], "it receives commands")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[4:]])
