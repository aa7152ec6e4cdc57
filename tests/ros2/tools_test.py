#!/usr/bin/python3
"""The tools for a network of ROS 2 (`waymark ros2 topic`, `ros2 relay`, `play --ros2`) against peers on Eclipse Cyclone DDS (peer.c).

WAYMARK_FULL=1 also runs the longer tests.

usage: tools_test.py PROGRAM PEER [TestClass.test]
"""
import pathlib
import re
import signal
import subprocess
import sys
import time
import unittest

from wire_case import COMMAND, LONG, PEER, PROGRAM, Lines, Wire, until

COMMANDED_SPEED = r"^cmd \d+ (\S+)"

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from made import LAP_OF_SQUARE, made


class TopicTools(Wire):
    def test_topics_messages_and_rates_of_another_vendor(self):
        self.start(PEER, "robot", 30)
        listing = self.run_program("ros2", "topic", "list")
        self.assertEqual(listing.returncode, 0, listing.stderr)
        self.assertRegex(listing.stdout, r"/odom \[nav_msgs/msg/Odometry\] 1 \w+ \(reliable\), 0 ")
        self.assertRegex(listing.stdout, r"/imu \[sensor_msgs/msg/Imu\] 1 \w+ \(best effort\)")
        self.assertRegex(listing.stdout, r"\(reliable, transient local\)")
        self.assertRegex(listing.stdout, r"/cmd_vel \[geometry_msgs/msg/Twist\] 0 \w+, 1 ")
        echo = self.run_program("ros2", "topic", "echo", "/imu", "--count", 1)
        self.assertIn("angular_velocity:\n  x: 0\n  y: 0\n  z: 0.25\n", echo.stdout)
        # Sent once, before the subscription.
        late = self.run_program("ros2", "topic", "echo", "/tf_static", "--count", 1)
        self.assertIn("child_frame_id: 'camera_color_optical_frame'", late.stdout)
        self.assertIn("z: 0.18", late.stdout)
        rate = self.run_program("ros2", "topic", "hz", "/odom", "--count", 60)
        self.assertGreater(float(rate.stdout.split()[0]), 10, rate.stdout)

    def test_reports_domain_and_interfaces_without_participants(self):
        began = time.monotonic()
        empty = self.run_program("ros2", "topic", "list")
        self.assertEqual(empty.returncode, 1)
        self.assertRegex(empty.stderr, rf"\b{self.environment['ROS_DOMAIN_ID']} .*127\.0\.0\.1.* participant")
        self.assertLess(time.monotonic() - began, 20)

    def test_node_lists_of_the_given_release_show_it(self):
        seen = {}
        for distro, gid_bytes in (("humble", 24), ("jazzy", 16), (None, 16)):
            self.next_domain()
            self.start(PROGRAM, "ros2", "relay", *(("--ros-distro", distro) if distro else ()))
            seen[distro] = self.start(PEER, "nodes", 30 if distro else 2, gid_bytes)
        for distro, peer in seen.items():
            self.assertEqual(peer.communicate(timeout=50)[0], "/waymark_relay readers 1 writers 1 found 2\n" if distro else "none\n", distro)
        wrong = self.run_program("ros2", "relay", "--ros-distro", "humbel")
        self.assertEqual(wrong.returncode, 2, wrong.stderr)
        self.assertIn("humble", wrong.stderr)

    def test_the_peer_reads_the_newest_description_of_a_node(self):
        shown = self.start(PEER, "nodes", 20, 16)
        self.start(PEER, "announce", 20)
        self.assertEqual(shown.communicate(timeout=40)[0], "/slow readers 1 writers 1 found 2\n")

    @LONG
    def test_two_hundred_topics_are_discovered(self):
        crowd = self.start(PEER, "crowd", 60, 200)
        self.assertEqual(crowd.stdout.readline(), "there\n")
        listing = self.run_program("ros2", "topic", "list")
        self.assertEqual(len(listing.stdout.splitlines()), 201)

    def test_rejects_invalid_flags(self):
        for flags, words in ((("topic", "list", "--interface", "203.0.113.9"), "203.0.113.9"),
                             (("topic", "list", "--interface", "eth99"), "eth99"), (("topic", "list", "--localhost", "--interface", "127.0.0.1"), "--localhost"),
                             (("topic", "echo", ""), "waymark ros2 topic echo"), (("robot", ""), "waymark ros2 robot")):
            refused = self.run_program("ros2", *flags)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn(words, refused.stderr)


class Relay(Wire):
    def relay_prints(self, flags, *expected):
        """The output of the relay, which must match the expected patterns."""
        relay = self.start(PROGRAM, "ros2", "relay", *flags, stderr=subprocess.PIPE)
        printed = Lines(relay.stderr)
        until(lambda: all(re.search(pattern, printed.text) for pattern in expected), lambda: f"{expected} in: {printed.text}")
        relay.send_signal(signal.SIGINT)
        self.assertEqual(relay.wait(20), 0, printed.text)
        return printed.rest()

    def test_reports_what_prevents_commands_from_reaching_the_robot(self):
        self.relay_prints((), r"/waymark/cmd_vel\b.* publisher", r"(?<!/waymark)/cmd_vel\b.* subscriber")
        robot = self.start(PEER, "listen", 60)  # subscribes to Twist
        self.assertEqual(robot.stdout.readline(), "listening\n")
        mismatch = r"/cmd_vel .*geometry_msgs/msg/Twist\b.* geometry_msgs/msg/TwistStamped"
        self.assertNotIn("subscriber", self.relay_prints(("--stamped",), mismatch, r"/waymark/cmd_vel\b.* publisher"))

    @LONG
    def test_publishes_zero_if_it_is_killed(self):
        lap = made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap"
        heard = Lines(self.start(PEER, "listen", 90).stdout)
        relay = self.start(PROGRAM, "ros2", "relay", "--from", "/cmd_vel", "--to", "/cmd_vel2", stderr=subprocess.PIPE)
        echo = self.start(PROGRAM, "ros2", "topic", "echo", "/cmd_vel2", "--seconds", "15", stdout=subprocess.PIPE)
        self.start(PROGRAM, "play", lap, "--ros2", "--commands", "--topics", "/cmd_vel", "--from", "2")
        heard.wait_for_number(COMMANDED_SPEED, lambda speed: speed > 0.1, count=50)  # the relay sends as well, and starts earlier
        relay.kill()
        self.assertRegex(relay.communicate(timeout=20)[1], "zero .*/cmd_vel2")
        speeds = [float(x) for x in re.findall(r"linear:\n +x: (\S+)", echo.communicate(timeout=40)[0])]
        self.assertGreater(max(speeds), 0.1)
        self.assertEqual(speeds[-1], 0)

    def test_rejects_invalid_or_equal_topics(self):
        for flags, words in ((("--from", "a b"), "'a b'"), (("--from", "/cmd_vel", "--to", "cmd_vel"), "--from and --to")):
            refused = self.run_program("ros2", "relay", *flags)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn(words, refused.stderr)


class Play(Wire):
    def test_commands_of_a_recording_are_played_only_on_request(self):
        lap = made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap"
        topics = ("--topics", "/cmd_vel", "--from", "2", "--to", "3")
        played = self.run_program("play", lap, "--ros2", *topics)
        self.assertEqual((played.returncode, played.stdout.split()[0]), (0, "0"), played.stderr)
        self.assertIn("/cmd_vel", played.stderr)
        self.assertEqual(self.run_program("play", lap, "--commands").returncode, 2)
        for interrupted in (False, True):
            listener = self.start(PEER, "listen", 90)
            heard = Lines(listener.stdout)
            heard.wait_for("listening\n")
            end = "30" if interrupted else "6"
            play = self.start(PROGRAM, "play", lap, "--ros2", "--commands", "--topics", "/cmd_vel", "--from", "2", "--to", end, stdout=subprocess.PIPE)
            heard.wait_for_number(COMMANDED_SPEED, lambda speed: speed > 0.1)
            if interrupted:
                play.send_signal(signal.SIGINT)
            self.assertGreater(int(play.communicate(timeout=30)[0].split()[0]), 0)
            self.assertEqual(play.returncode, 130 if interrupted else 0)
            until(lambda: COMMAND.findall(heard.text)[-1][1] == "0.000000", "zero is the last command")
            listener.kill()
        robot = self.start(PEER, "listen", 60)  # subscribes to Twist, while TwistStamped was recorded
        self.assertEqual(robot.stdout.readline(), "listening\n")
        stamped = self.run_program("play", lap, "--ros2", "--commands", *topics)
        self.assertEqual(stamped.returncode, 0, stamped.stderr)
        self.assertRegex(stamped.stderr, r"/cmd_vel .*geometry_msgs/msg/Twist\b")
        Lines(robot.stdout).wait_for_number(COMMANDED_SPEED, lambda speed: speed > 0.1)
        self.start(PEER, "robot", 60)
        over = self.run_program("play", lap, "--ros2", "--topics", "/odom,/tf_static")
        self.assertEqual(over.returncode, 1, over.stderr)
        self.assertIn("/odom", over.stderr)

    def test_zero_follows_commands_of_a_program_that_is_killed(self):
        lap = made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap"
        listener = self.start(PEER, "listen", 90)
        heard = Lines(listener.stdout)
        heard.wait_for("listening\n")
        words = ("play", lap, "--ros2", "--commands", "--topics", "/cmd_vel", "--from", "2")
        play = self.start(PROGRAM, *words, stderr=subprocess.PIPE)
        heard.wait_for_number(COMMANDED_SPEED, lambda speed: speed > 0.1, count=5)
        killed = time.monotonic_ns()
        play.kill()
        self.assertRegex(play.communicate(timeout=20)[1], "zero .*/cmd_vel")
        until(lambda: COMMAND.findall(heard.text)[-1][1] == "0.000000", "zero is the last command")
        time.sleep(0.5)  # no moving command may follow
        listener.kill()
        commands = [(int(at), float(v)) for at, v, _ in COMMAND.findall(heard.rest())]
        self.assertGreater(max(v for at, v in commands if at < killed), 0.1)
        after = [(at, v) for at, v in commands if at > killed]
        moving = max((at for at, v in after if v != 0), default=killed)
        zero = min(at for at, v in after if v == 0)
        print(f"play killed: last moving command {(moving - killed) / 1e6:.0f} ms, first zero {(zero - killed) / 1e6:.0f} ms after")
        self.assertLess(moving, zero)
        self.assertLess((zero - killed) / 1e9, 1.0)

    @LONG
    def test_a_recording_is_played_to_the_network(self):
        lap = made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap"
        recorder = self.start(PEER, "record", 30)
        self.wait_for_subscription("/odom")
        played = self.run_program("play", lap, "--ros2", "--to", 8)  # the recorder itself publishes commands
        self.assertEqual(played.returncode, 0, played.stderr)
        self.assertGreater(int(played.stdout.split()[0]), 100)
        words = recorder.communicate(timeout=60)[0].split()
        seen = dict(zip(words[0:10:2], words[1:10:2]))
        self.assertGreater(int(seen["odometry"]), 50, words)
        self.assertEqual(seen["links"], "1", words)
        self.assertGreater(abs(float(words[11])) + abs(float(words[12])), 0.3, words)

    def test_publishes_earlier_static_frames_if_it_starts_later(self):
        lap = made(PROGRAM, *LAP_OF_SQUARE) / "lap.mcap"
        echo = self.start(PROGRAM, "ros2", "topic", "echo", "/tf_static", "--count", "1")
        time.sleep(0.5)
        played = self.run_program("play", lap, "--ros2", "--topics", "/tf_static,/odom", "--from", 2, "--to", 4)
        self.assertEqual(played.returncode, 0, played.stderr)
        self.assertIn("child_frame_id", echo.communicate(timeout=20)[0])
        late = self.run_program("play", lap, "--ros2", "--from", 1000)
        self.assertEqual(late.returncode, 2, late.stderr)
        self.assertRegex(late.stderr, r"--from.* \d+\.?\d* s ")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
