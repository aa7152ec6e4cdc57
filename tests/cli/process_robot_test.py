#!/usr/bin/python3
"""Robots as processes: the whole loop, misbehaving robots, and the example of the documentation."""
import json
import os
import pathlib
import pty
import signal
import subprocess
import sys
import time

from harness import PROGRAM, InFolder, rest_of, unittest
import golden_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
SIM = f"process:exec '{PROGRAM}' robot-sim --world circuit24 --lockstep"
HELLO = """echo '{"type":"hello","protocol_version":1,"name":"tiny"}'; """


class Loop(InFolder):
    def test_teach_map_and_replay_over_a_process(self):
        taught = self.run_here("teach", "--robot", SIM, "--world", "circuit24", "-o", "lap.mcap", "--json")
        self.assertEqual(taught.code, 0, taught.err)
        self.assertTrue(taught.records[0]["mappable"])
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "map").code, 0)
        replayed = self.run_here("replay", "map", "--robot", SIM + " --seed 7", "--world", "circuit24",
                                 "-o", "replay.mcap", "--search-every", "8", "--json")
        self.assertEqual(replayed.code, 0, replayed.err)
        self.assertIn("--search-every", replayed.err)
        report = replayed.records[0]
        self.assertTrue(report["finished"])
        inside = self.run_here("replay", "map", "--world", "circuit24", "--seed", "7", "--json").records[0]
        # The same robot and noise: only the transmission could cause a difference.
        self.assertAlmostEqual(report["cross_track_rmse_m"], inside["cross_track_rmse_m"], delta=0.002)
        info = self.run_here("info", "replay.mcap", "--json").records[0]
        topics = {topic["topic"] for topic in info["topics"]}
        self.assertLessEqual({"/odom", "/tag_detections", "/cmd_vel", "/waymark/pose", "/truth/pose"}, topics)
        self.an_unplugged_camera_stops_a_replay()
        self.the_space_bar_stops_a_replay()
        self.waymark_stop_is_reported()
        # The map contains the anchor and its size.
        session = self.run_here("run", "--map", "map", "--robot", SIM, "--driver", "lines", "-o", "session", input="quit\n")
        self.assertEqual(session.code, 0, session.err)

    def an_unplugged_camera_stops_a_replay(self):
        (self.folder / "unplugged.yaml").write_text("faults: [{fault: camera_lost, at_s: 8}]")
        unplugged = self.run_here("replay", "map", "--robot", SIM + " --seed 7 --faults unplugged.yaml", "--world", "circuit24",
                                  "-o", "unplugged.mcap", "--json")
        self.assertEqual(unplugged.code, 1, unplugged.err)
        golden_page.expect(self, "replay", unplugged.records[0]["reason"])
        self.assertLess(unplugged.records[0]["distance_m"], 0.5 * 8 + 0.5, "stopped within a second")

    def the_space_bar_stops_a_replay(self):
        keyboard, terminal = pty.openpty()
        process = subprocess.Popen([PROGRAM, "replay", "map", "--robot", SIM + " --pace 4", "--world", "circuit24", "-o", "spaced.mcap"],
                                   cwd=self.folder, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and not (self.folder / "spaced.mcap").exists():
            time.sleep(0.1)
        time.sleep(0.5)
        self.assertIsNone(process.poll(), "it drives")
        os.write(keyboard, b" ")
        begin = time.monotonic()
        out, err = process.communicate(timeout=60)
        os.close(keyboard)
        os.close(terminal)
        self.assertLess(time.monotonic() - begin, 10)
        self.assertEqual(process.returncode, 1, err)
        self.assertRegex(out + err, r"space bar \d\.\d\d m ")

    def waymark_stop_is_reported(self):
        runtime = os.environ | {"XDG_RUNTIME_DIR": str(self.folder)}
        process = subprocess.Popen([PROGRAM, "replay", "map", "--robot", SIM + " --pace 4", "--world", "circuit24", "-o", "ended.mcap"],
                                   cwd=self.folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=runtime)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and not (self.folder / "ended.mcap").exists():
            time.sleep(0.1)
        time.sleep(0.3)
        subprocess.run([PROGRAM, "stop"], env=runtime, check=True, capture_output=True, timeout=30)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, err)
        self.assertRegex(err, r"'waymark stop' \d\.\d\d m ")

    def test_lockstep_gives_the_same_bytes_twice(self):
        for name in ("a", "b"):
            process = subprocess.Popen([PROGRAM, "robot-sim", "--world", "circuit24", "--lockstep"], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, text=True)
            lines = []
            for line in process.stdout:
                lines.append(line)
                message = json.loads(line)
                if message["type"] == "step":
                    if message["step"] == 40:
                        break
                    order = {"type": "velocity", "speed_m_s": 0.3, "yaw_rate_rad_s": 0.1, "step": message["step"]}
                    time.sleep(0.01 if name == "b" else 0)
                    process.stdin.write(json.dumps({"type": "velocity", "speed_m_s": 0, "yaw_rate_rad_s": 0}) + "\n")
                    process.stdin.write(json.dumps(order) + "\n")
                    process.stdin.flush()
            process.stdin.close()
            self.assertEqual(process.wait(20), 0)
            process.stdout.close()
            if name == "a":
                first = lines
        self.assertEqual(first, lines)
        truth = [json.loads(line) for line in lines if '"type":"truth"' in line]
        self.assertGreater(abs(truth[-1]["y_m"] - truth[0]["y_m"]), 0.3, "it drove")

    def test_ctrl_c_while_images_are_sent(self):
        process = subprocess.Popen([PROGRAM, "teach", "--robot", SIM + " --images", "--world", "circuit24", "-o", "lap.mcap"],
                                   cwd=self.folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        lap = self.folder / "lap.mcap"
        deadline = time.monotonic() + 60
        some_images = 50_000  # bytes
        while time.monotonic() < deadline and not (lap.exists() and lap.stat().st_size > some_images):
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, out + err)
        self.assertIn("Ctrl-C", err)
        info = self.run_here("info", "lap.mcap", "--json")
        self.assertEqual(info.code, 0, info.err)
        topics = {topic["topic"]: topic for topic in info.records[0]["topics"]}
        self.assertGreater(topics["/tag_detections"]["messages"], 1, "detected in the images")

    def test_ctrl_c_before_the_hello_of_the_robot(self):
        for words in (["teach", "--world", "circuit24", "-o", "lap.mcap"],
                      ["run", "--anchor", "0", "--tag-size-m", "0.16", "--driver", "lines", "-o", "session"]):
            words += ["--robot", "process:sleep 30"]
            process = subprocess.Popen([PROGRAM, *words], cwd=self.folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE,
                                       stdin=subprocess.PIPE, text=True)
            golden_page.expect(self, "robots", process.stderr.readline())
            began = time.monotonic()
            process.send_signal(signal.SIGINT)
            out, err = rest_of(process)
            self.assertEqual(process.returncode, 130, out + err)
            self.assertLess(time.monotonic() - began, 10)
            golden_page.expect(self, "robots", err)

    def test_a_short_path_with_images_over_a_process(self):
        """Images as base64 JPEG at 5 Hz and a path of two metres: the detector in the loop of a process."""
        world = (ROOT / "share/worlds/circuit24.yaml").read_text().split("path_closed:")[0]
        (self.folder / "short.yaml").write_text(world + "path_closed: false\npath_m: [[2.53, -1.45], [2.89, -0.98], [3.04, -0.4], [3.02, 0.2]]\n")
        robot = (ROOT / "share/robots/limo.yaml").read_text() + "simulation: {camera_rate_hz: 5}\n"
        (self.folder / "slow-camera.yaml").write_text(robot)
        sim = f"process:exec '{PROGRAM}' robot-sim --world short.yaml --robot-file slow-camera.yaml --lockstep --images"
        words = ["--world", "short.yaml", "--robot-file", "slow-camera.yaml"]
        taught = self.run_here("teach", "--robot", sim, *words, "-o", "lap.mcap", "--record-images", "jpeg")
        self.assertEqual(taught.code, 0, taught.err)
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "map").code, 0)
        replayed = self.run_here("replay", "map", "--robot", sim + " --seed 7", *words, "-o", "again.mcap", "--record-images", "jpeg",
                                 "--json")
        self.assertEqual(replayed.code, 0, replayed.err)
        (report,) = replayed.records
        info = self.run_here("info", "again.mcap", "--json")
        topics = {topic["topic"]: topic["messages"] for topic in info.records[0]["topics"]}
        self.assertEqual(topics["/image_raw/compressed"], topics["/tag_detections"], "each image with its detected tags")
        self.assertTrue(report["finished"])
        self.assertLess(report["cross_track_max_m"], 0.05)

    @unittest.skipUnless(os.environ.get("WAYMARK_FULL"), "takes minutes")
    def test_the_loop_with_images_over_a_process(self):
        sim = SIM + " --images"
        self.assertEqual(self.run_here("teach", "--robot", sim, "--world", "circuit24", "-o", "lap.mcap").code, 0)
        self.assertEqual(self.run_here("map", "lap.mcap", "-o", "map").code, 0)
        replayed = self.run_here("replay", "map", "--robot", sim + " --seed 7", "--world", "circuit24", "--json")
        self.assertEqual(replayed.code, 0, replayed.err)
        print(replayed.out, file=sys.stderr)


class Misbehaviour(InFolder):
    def teach(self, command, *more):
        return self.run_here("teach", "--robot", "process:" + command, "--world", "circuit24", "-o", "lap.mcap", *more)

    def test_is_reported(self):
        odometry = """echo '{"type":"odometry","stamp_s":1,"x_m":0,"y_m":0,"yaw_rad":0,"speed_m_s":0,"yaw_rate_rad_s":0}'; """
        for command, words in (("echo motors on", ":1: "),
                               ("exit 7", "exit code 7"),
                               ("no-such-robot-program", "no-such-robot-program"),
                               (HELLO + odometry + "sleep 0.1; kill -9 $$", "signal 9"),
                               (HELLO + odometry + "exec >&-; sleep 30", "standard output"),
                               (HELLO + """echo '{"type":"odometry","stamp_s":NaN}'""", ":2: "),
                               (HELLO + """echo '{"type":"imu","stamp_s":2}'""", "imu.angular_velocity_rad_s"),
                               (HELLO + odometry + odometry.replace('_s":1,', '_s":0.5,'), "0.500 s")):
            outcome = self.teach(command)
            self.assertEqual(outcome.code, 1, outcome.err)
            self.assertIn(words, outcome.err)
            if '"odometry"' not in command:
                self.assertFalse((self.folder / "lap.mcap").exists(), "nothing was recorded, no file is left")
            if "kill" in command:
                self.assertTrue((self.folder / "lap.mcap").exists(), "the recorded part is kept")
            (self.folder / "lap.mcap").unlink(missing_ok=True)

    def test_an_unwritable_file_is_reported_before_the_robot_starts(self):
        (self.folder / "lap.mcap").write_text("mine")
        outcome = self.teach("touch started; sleep 5")
        self.assertEqual(outcome.code, 1)
        self.assertIn("lap.mcap: ", outcome.err)
        self.assertFalse((self.folder / "started").exists())
        self.assertEqual((self.folder / "lap.mcap").read_text(), "mine")

    def test_texts_are_printed_and_an_unknown_type_is_reported_once(self):
        strange = """for i in 1 2 3; do echo '{"type":"sonar","stamp_s":1}'; done; """
        log = """echo '{"type":"log","text":"battery low"}'; echo '{"type":"log","text":"red [31malert"}'
                 echo from stderr >&2; exit 1""".replace("[31m", "\\u001b[31m")
        outcome = self.teach(HELLO + strange + log)
        self.assertEqual(outcome.err.count("type 'sonar'"), 1, outcome.err)
        self.assertIn("robot: battery low", outcome.err)
        self.assertIn("robot: red \\x1b[31malert", outcome.err, "control characters are escaped")
        self.assertNotIn("\x1b", outcome.err)
        self.assertIn("from stderr", outcome.err)

    def test_a_clock_far_from_zero_plays_from_its_first_sample(self):
        """The camera's calibration is stamped 0 in the recording, the samples by the robot's clock."""
        odometry = """echo '{"type":"odometry","stamp_s":%d,"x_m":0,"y_m":0,"yaw_rad":0,"speed_m_s":0,"yaw_rate_rad_s":0}'; """
        outcome = self.teach(HELLO + "".join(odometry % second for second in range(1000, 1004)) + "exit 7")
        self.assertEqual(outcome.code, 1, outcome.err)
        played = self.run_here("play", "lap.mcap", "--topics", "/odom", "--from", "0.5", "--to", "2.5", "--speed", "0")
        self.assertEqual(played.code, 0, played.err)
        self.assertEqual(len(played.out.splitlines()), 2, played.out)

    def test_usage(self):
        for words, part in ((["--robot", "process:"], "process:"),
                            (["--robot", "process:true"], "--anchor"),
                            (["--robot", "process:true", "--anchor", "0"], "--tag-size-m"),
                            (["--robot", "process:true", "--anchor", "zero", "--tag-size-m", "1"], "zero"),
                            (["--robot", "proces", "--world", "circuit24"], "process:CMD"),
                            (["--robot", "gazebo", "--world", "circuit24"], "gazebo:PROFILE"),
                            (["--world", "circuit24", "--anchor", "0"], "--anchor"),
                            (["--robot", "process:true", "--world", "circuit24", "--driver", "hands"], "'hands'")):
            outcome = self.run_here("teach", "-o", "x.mcap", *words)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "robots", outcome.err)


class Example(InFolder):
    def test_a_person_teaches_the_example_with_keys(self):
        keyboard, terminal = pty.openpty()
        command = f"process:exec /usr/bin/python3 '{ROOT / 'examples/process_robot.py'}'"
        process = subprocess.Popen([PROGRAM, "teach", "--robot", command, "--anchor", "0", "--tag-size-m", "0.3", "--driver",
                                    "keyboard", "-o", "lap.mcap", "--json"], cwd=self.folder, stdin=terminal,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        lap = self.folder / "lap.mcap"
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and not lap.exists():
            time.sleep(0.1)
        for _ in range(20):
            os.write(keyboard, b"w")
            time.sleep(0.1)
        os.write(keyboard, b"q")
        out, err = process.communicate(timeout=60)
        os.close(keyboard)
        os.close(terminal)
        self.assertIn(process.returncode, (0, 1), err)
        report = json.loads(out)
        self.assertTrue(report["finished"], err)
        self.assertGreater(report["distance_m"], 0.1)
        self.assertGreaterEqual(report["tags"], 2)
        self.assertLessEqual(len((ROOT / "examples/process_robot.py").read_text().splitlines()), 70)


if __name__ == "__main__":
    unittest.main()
