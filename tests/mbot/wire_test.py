#!/usr/bin/env python3
"""Waymark on LCM against peers on Debian's liblcm (peer.c, lcm-logplayer): receives from, drives, stops and replays an MBot.

Every test has its own port, and no message leaves this computer (ttl=0). WAYMARK_FULL=1 also runs the longer tests.

usage: wire_test.py PROGRAM PEER [TestClass.test]
"""
import json
import math
import os
import pathlib
import pty
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import event
import wire_driver
from claim import lcm_port

PROGRAM, PEER = sys.argv[1:3]
WATCHDOG = str(pathlib.Path(PROGRAM).with_name("waymark-watchdog"))
COMMAND = re.compile(r"^cmd (\d+) (\S+) (\S+) (\S+) (\d+)$", re.M)
LONG = unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "longer: WAYMARK_FULL=1")
DATA = os.environ.get("WAYMARK_DATA")
LOG = pathlib.Path(DATA or "", "lcm", "lcmlog-2024-04-15.00")
LANDMARKS = pathlib.Path(DATA or "", "lcm", "landmarks.csv")


class Lcm(unittest.TestCase):
    def setUp(self):
        self.url = f"udpm://239.255.76.67:{lcm_port()}?ttl=0"
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-mbot-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def start(self, *words, **pipes):
        process = subprocess.Popen([str(word) for word in words], text=True, **{"stdout": subprocess.PIPE, **pipes})
        self.addCleanup(self.end, process)
        return process

    @staticmethod
    def end(process):
        process.kill()
        process.wait()
        for pipe in filter(None, (process.stdin, process.stdout, process.stderr)):
            pipe.close()

    def succeeds(self, *words):
        done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, timeout=400, stdin=subprocess.DEVNULL, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout


class Robot(Lcm):
    def robot(self):
        return self.start(PROGRAM, "mbot", "robot", self.url, stdin=subprocess.PIPE)

    def lines(self, robot, count):
        return [json.loads(robot.stdout.readline()) for _ in range(count)]

    def test_receives_from_and_drives_an_mbot_of_liblcm(self):
        peer = self.start(PEER, "robot", self.url, 30)
        robot = self.robot()
        lines = self.lines(robot, 120)
        wire_driver.drain(robot)
        self.assertEqual(lines[0], {"type": "hello", "protocol_version": 1, "name": "mbot", "sends": [], "lockstep": False})
        first = {line["type"]: line for line in reversed(lines)}
        self.assertEqual([first["odometry"][key] for key in ("x_m", "y_m", "yaw_rad")], [1, 2, 0.5])
        self.assertEqual(first["imu"]["angular_velocity_rad_s"], [0, 0, 0.25])
        self.assertAlmostEqual(first["imu"]["linear_acceleration_m_s2"][2], 9.7, 5)
        (tag,) = first["tag_poses"]["tags"]
        self.assertEqual(tag["tag"], "tagCustom48h12:7")
        for value, expected in zip(tag["position_m"], (0.01, 0.02, 1.5)):
            self.assertAlmostEqual(value, expected, 6)
        self.assertLess(abs(first["odometry"]["stamp_ns"] / 1e9 - time.time()), 20)
        wire_driver.move(robot, 0.3, -0.1)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        peer.kill()
        commands = COMMAND.findall(peer.stdout.read())
        moving = [at for at, vx, vy, wz, _ in commands if (float(vx), float(vy), float(wz)) == (0.3, 0, -0.1)]
        self.assertGreater(len(moving), 19)
        gaps = [(int(b) - int(a)) / 1e6 for a, b in zip(moving, moving[1:])]
        print(f"commands at most {max(gaps):.0f} ms apart, {1e3 * (len(gaps)) / sum(gaps):.0f} a second")
        self.assertGreater(len(gaps) / sum(gaps) * 1e3, 20, gaps)
        self.assertEqual([float(vx) for _, vx, *_ in commands[-3:]], [0, 0, 0], "stopped at the end")
        self.assertEqual(sorted(int(utime) for *_, utime in commands), [int(utime) for *_, utime in commands])

    def test_ignores_random_messages_on_its_channels(self):
        self.start(PEER, "swamp", self.url, 20, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        lines = self.lines(self.robot(), 200)
        self.assertGreater(sum(line["type"] == "odometry" for line in lines), 20)
        words = " ".join(line["text"] for line in lines if line["type"] == "log")
        self.assertRegex(words, r"\b\d+ .*MBOT_\w+.* [0-9a-f]{16}\b")

    @LONG
    def test_reports_that_no_robot_sends(self):
        began = time.monotonic()
        done = subprocess.run([PROGRAM, "mbot", "robot", self.url], capture_output=True, text=True, timeout=60, stdin=subprocess.PIPE,
                              check=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("MBOT_ODOMETRY", done.stderr)
        self.assertLess(time.monotonic() - began, 20)

    def test_a_listening_hello_sends_nothing(self):
        peer = self.start(PEER, "robot", self.url, 30)
        robot = self.robot()
        wire_driver.send_hello(robot, listen_only=True)
        self.lines(robot, 60)
        wire_driver.drain(robot)
        wire_driver.move(robot, 0.3, -0.1)
        robot.stdin.close()
        self.assertEqual(robot.wait(20), 0)
        peer.kill()
        self.assertEqual(COMMAND.findall(peer.stdout.read()), [], "not even zero")

    def test_a_killed_driver_stops_the_robot(self):
        """Drives through the watchdog, kills the driver with SIGKILL: the peer sees the last moving command within 0.25 s."""
        peer = self.start(PEER, "robot", self.url, 30)
        driver = self.start(sys.executable, wire_driver.__file__, WATCHDOG, PROGRAM, "mbot", "robot", self.url)
        self.assertEqual(driver.stdout.readline(), "drives\n")
        heard = event.Lines(peer.stdout)
        heard.wait_for_number(r"^cmd \d+ (\S+)", lambda speed: speed > 0, count=16)
        killed = time.monotonic_ns()
        driver.kill()
        event.until(lambda: float(COMMAND.findall(heard.text)[-1][1]) == 0, "zero is the last command")
        time.sleep(1)  # no moving command may follow
        peer.kill()
        commands = [(int(at) - killed, float(vx)) for at, vx, *_ in COMMAND.findall(heard.rest())]
        self.assertGreater(sum(at < 0 and vx > 0 for at, vx in commands), 15, "the robot drove")
        last = max((at for at, vx in commands if vx != 0), default=0)
        zero = min(at for at, vx in commands if vx == 0 and at > 0)
        print(f"SIGKILL: last moving command {last / 1e6:.0f} ms, first zero {zero / 1e6:.0f} ms after it")
        self.assertLess(max(last, zero) / 1e9, 0.25)


def cut_log(source, target, seconds):
    """The events of the first seconds in the format of the log (lcm/eventlog.c)."""
    data = source.read_bytes()
    at = 0
    begin = struct.unpack(">q", data[12:20])[0]
    while struct.unpack(">q", data[at + 12:at + 20])[0] < begin + 1e6 * seconds:
        channel, payload = struct.unpack(">ii", data[at + 20:at + 28])
        at += 28 + channel + payload
    target.write_bytes(data[:at])


def trajectory(text):
    rows = [list(map(float, line.split())) for line in text.splitlines() if line and not line.startswith("#")]
    return {round(1e6 * row[0]): row[1:] for row in rows}


@unittest.skipUnless(DATA, "WAYMARK_DATA is not set")
class RealLog(Lcm):
    def live(self, log, seconds):
        """Plays the log, which contains commands of another driver, with lcm-logplayer in real time and records what Waymark receives."""
        keyboard, terminal = pty.openpty()
        robot = f"process:exec '{PROGRAM}' mbot robot '{self.url}' --share-commands"
        recorder = self.start(PROGRAM, "teach", "--robot", robot, "--robot-file", "mbot", "--driver", "keyboard", "--anchor", "tagCustom48h12:1",
                              "--tag-size-m", 0.054, "-o", self.folder / "live.mcap", stdin=terminal, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE)
        time.sleep(1)  # it listens
        subprocess.run(["lcm-logplayer", f"--lcm-url={self.url}", str(log)], check=True, capture_output=True, timeout=seconds + 60)
        time.sleep(0.3)
        recorder.send_signal(signal.SIGINT)
        words = recorder.communicate(timeout=60)[1]
        for end in (keyboard, terminal):
            os.close(end)
        return words

    def compare(self, log, seconds):
        words = self.live(log, seconds)
        self.assertIn("MBOT_VEL_CMD", words, "the other driver is reported")
        found = {}
        for name, recording in (("live", self.folder / "live.mcap"), ("offline", log)):
            self.succeeds("localize", recording, "--map", LANDMARKS, "--robot", "mbot", "--no-adapt", "-o", self.folder / f"{name}.tum")
            found[name] = trajectory((self.folder / f"{name}.tum").read_text())
        both = found["live"].keys() & found["offline"].keys()
        apart = max(math.dist(found["live"][at][:3], found["offline"][at][:3]) for at in both)
        print(f"{len(found['live'])} estimates live, {len(found['offline'])} offline, {len(both)} of the same stamp: "
              f"at most {1e3 * apart:.6f} mm apart")
        self.assertGreater(len(both), 0.98 * len(found["offline"]))
        self.assertLess(apart, 1e-3)

    def test_the_first_seconds_give_the_same_estimates_live_as_offline(self):
        cut_log(LOG, self.folder / "short.lcm", 5)
        self.compare(self.folder / "short.lcm", 5)

    @LONG
    def test_the_whole_log_gives_the_same_estimates_live_as_offline(self):
        self.compare(LOG, 184)


class Simulated(Lcm):
    def simulated(self, *words):
        return self.start(PROGRAM, "robot-sim", "--mbot", self.url, *words, stdout=subprocess.DEVNULL)

    def test_robot_sim_is_an_mbot_for_others(self):
        for generation, w in (("jetson", 3), ("pi5", 0)):
            sim = self.simulated("--world", "mbot-square", "--mbot-generation", generation)
            words = self.start(PEER, "watch", self.url, 3).communicate(timeout=30)[0]
            self.end(sim)
            counts = dict(zip(words.split("counts ")[1].split()[::2], map(int, words.split("counts ")[1].split()[1::2])))
            for name, least in (("odometry", 40), ("speed", 40), ("imu", 40), ("encoders", 40), ("tags", 60), ("lidar", 15), ("timesync", 2)):
                self.assertGreater(counts[name], least, words)
            tag = re.search(r"^tag (\d+) (\S+) (\S+) (\S+) rpy (\S+) \S+ \S+ quat (\S+) (\S+) (\S+) (\S+)$", words, re.M)
            self.assertIn(int(tag[1]), (1, 2))
            self.assertTrue(1000 < float(tag[4]) < 2500, tag[0])  # millimetres
            quaternion = [float(value) for value in tag.groups()[5:]]
            self.assertAlmostEqual(math.hypot(*quaternion), 1, 3)
            self.assertAlmostEqual(abs(quaternion[w]), 1, 1, tag[0])  # in front of an upright tag: y down, z into the tag
            self.assertTrue(float(re.search(r"^imu \S+ (\S+)$", words, re.M)[1]) < -9, words)

    def test_robot_sim_reports_that_it_waits_and_its_first_command(self):
        sim = self.start(PROGRAM, "robot-sim", "mbot", self.url, "--world", "mbot-square", stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.assertIn(f"{self.url} and ", sim.stderr.readline())
        robot = self.start(PROGRAM, "mbot", "robot", self.url, stdin=subprocess.PIPE)
        wire_driver.greet(robot)
        self.assertIn("command", wire_driver.next_report(sim))
        code, _, words = wire_driver.end_of([PROGRAM, "robot-sim", "mbot", self.url, "--world", "mbot-square", "--images"])
        self.assertEqual(code, 2, words)
        self.assertRegex(words, "'--images'.*`waymark robot-sim mbot`")

    def world(self):
        """A straight path of 1 m towards the tags of the square."""
        square = (pathlib.Path(__file__).parents[2] / "share" / "worlds" / "mbot-square.yaml").read_text()
        path = "path_closed: false\npath_m:\n" + "".join(f"  - [{0.4 + 0.1 * i:.1f}, 0.0]\n" for i in range(11))
        (self.folder / "straight.yaml").write_text(square[:square.index("path_closed")] + path)
        return self.folder / "straight.yaml"

    def teach_and_map(self, world, *robot):
        sim = self.simulated("--world", world) if robot else None
        self.succeeds("teach", *robot, "--world", world, "--driver", "scripted", "-o", self.folder / "lap.mcap")
        if sim:
            self.end(sim)
        self.succeeds("map", self.folder / "lap.mcap", "-o", self.folder / "map")
        return self.folder / "map"

    def replay(self, chart, world, *robot):
        """The report of the replay of a mapped lap."""
        sim = self.simulated("--world", world, "--seed", 7) if robot else None
        seed = () if robot else ("--seed", 7)
        report = json.loads(self.succeeds("replay", chart, *robot, "--world", world, *seed, "--taught", self.folder / "lap.mcap", "--json"))
        if sim:
            self.end(sim)
        self.assertTrue(report["finished"], report)
        return report["cross_track_rmse_m"]

    def replay_over_the_wire(self, chart, world):
        return self.replay(chart, world, "--robot", "mbot:" + self.url)

    def judge(self, wire, inside):
        print(f"cross-track error of the replay: {1e3 * wire:.1f} mm over LCM with poses of tags, {1e3 * inside:.1f} mm in one process with corners")
        self.assertLess(wire, 0.03)

    def test_a_short_path_is_replayed_over_lcm(self):
        world = self.world()
        chart = self.teach_and_map(world)
        self.judge(self.replay_over_the_wire(chart, world), self.replay(chart, world))

    @LONG
    def test_a_lap_is_taught_mapped_and_replayed_over_lcm(self):
        wire = self.replay_over_the_wire(self.teach_and_map("mbot-square", "--robot", "mbot:" + self.url), "mbot-square")
        for name in ("lap.mcap", "map"):
            (self.folder / name).rename(self.folder / ("wire " + name))
        self.judge(wire, self.replay(self.teach_and_map("mbot-square"), "mbot-square"))

    def test_one_driver_and_one_simulator_at_a_time(self):
        late = self.start(PROGRAM, "mbot", "robot", self.url, stdin=subprocess.DEVNULL)
        time.sleep(0.5)  # its input ends long before the robot sends
        self.assertIsNone(late.poll())
        sim = self.simulated("--world", "mbot-square")
        hello = json.loads(late.stdout.readline())
        self.assertTrue(hello["simulated"], "it needs no first drive")
        self.assertEqual(late.wait(20), 0)

        code, _, words = wire_driver.end_of([PROGRAM, "robot-sim", "--world", "mbot-square", "--mbot", self.url])
        self.assertEqual(code, 1, words)
        self.assertIn(f"waymark (process {sim.pid} on ", words)

        first = self.start(PROGRAM, "mbot", "robot", self.url, stdin=subprocess.PIPE)
        wire_driver.greet(first)
        code, out, words = wire_driver.end_of([PROGRAM, "mbot", "robot", self.url])
        self.assertEqual((code, out), (1, ""), words)
        self.assertIn(f", waymark (process {first.pid} on ", words)
        code, out, _ = wire_driver.end_of([PROGRAM, "mbot", "robot", self.url, "--share-commands"])
        self.assertEqual((code, json.loads(out.splitlines()[0])["type"]), (0, "hello"))

    @LONG
    def test_doctor_only_listens(self):
        self.assertIn("MBOT_ODOMETRY", wire_driver.doctor(PROGRAM, "mbot:" + self.url)["robot"]["message"])
        self.simulated("--world", "mbot-square")
        first = self.start(PROGRAM, "mbot", "robot", self.url, stdin=subprocess.PIPE)
        wire_driver.greet(first)
        checks = wire_driver.doctor(PROGRAM, "mbot:" + self.url)
        self.assertEqual([checks[check]["level"] for check in ("robot", "clock", "commands")], ["ok", "ok", "fail"], checks)
        self.assertIn("simulated", checks["robot"]["message"])
        self.assertIn(f"(process {first.pid} on ", checks["commands"]["message"])

    def test_a_silent_robot_is_stopped(self):
        """If the robot's programs end while it drives, zero is sent within 0.3 s and reported."""
        chart = self.teach_and_map("mbot-square")
        sim = self.simulated("--world", "mbot-square")
        listener = self.start(PEER, "listen", self.url, 60)
        replay = self.start(PROGRAM, "replay", chart, "--robot", "mbot:" + self.url, "--world", "mbot-square", stderr=subprocess.PIPE,
                            stdin=subprocess.DEVNULL)
        moving = [0.0]
        while moving[-1] < 0.15:
            moving.append(float(COMMAND.search(listener.stdout.readline())[2]))
        self.end(sim)
        died = time.monotonic_ns()
        time.sleep(2)
        replay.send_signal(signal.SIGINT)
        words = replay.communicate(timeout=60)[1]
        listener.kill()
        commands = [(int(at) - died, float(vx)) for at, vx, *_ in COMMAND.findall(listener.stdout.read())]
        last = max((at for at, vx in commands if vx != 0), default=0)
        zero = min(at for at, vx in commands if vx == 0 and at > 0)
        print(f"the sender died: last moving command {last / 1e6:.0f} ms, first zero {zero / 1e6:.0f} ms after it")
        self.assertLess(max(last, zero) / 1e9, 0.3)
        self.assertRegex(words, r"odometry .*\b0\.2 s")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
