#!/usr/bin/python3
"""The command line: suggestions for mistakes, examples in the help, pipes, Ctrl-C.

usage: usage_test.py PROGRAM [unittest options]
"""
import errno
import fcntl
import json
import os
import re
import signal
import subprocess
import termios
import time
import unittest

import images
from harness import PROGRAM, InFolder, event, rest_of
from laps import LAP_OF_SQUARE, MAP_OF_SQUARE, made
import golden_page


class Usage(InFolder):
    def check(self, words, *parts, code=2):
        outcome = self.run_here(*words)
        self.assertEqual(outcome.code, code, outcome.err)
        self.assertEqual(outcome.out, "")
        for part in parts:
            self.assertIn(part, outcome.err)
        golden_page.expect(self, "cli", re.sub(r"/\S*/made/\S*/", "MADE/", outcome.err))  # shared recordings are in the build folder

    def test_mistakes_suggest_the_nearest_word(self):
        self.check([], "Verbs:")
        self.check(["detcet", "photograph.png"], "'detcet'", "'detect'?")
        self.check(["evaluate"], "`waymark evaluate --help`")
        self.check(["evaluate", "detection"], "`waymark evaluate detections`?")
        self.check(["detect"], "SOURCE")
        self.check(["detect", "--anotate", "x", "photograph.png"], "'--anotate'", "'--annotate'?")
        self.check(["detect", "--family", "tag36h12", "photograph.png"], "tag36h12", "'tag36h11'")
        self.check(["detect", "--quad-decimate", "0", "photograph.png"], "(--quad-decimate): 0 ")
        self.check(["detect", "--quad-decimate", "much", "photograph.png"], "--quad-decimate")
        self.check(["evaluate", "detections", "photograph.png"], "--truth")
        self.check(["evaluate", "detections", "--truth", "truth.csv"], "--detections")
        self.check(["evaluate", "detections", "--truth", "truth.csv", "--detections", "x", "photograph.png"], "--detections")
        self.check(["evaluate", "detections", "--truth", "truth.csv", "--size-edges-px", "9,3", "photos"], "ascending")

    def test_an_invalid_number_is_printed_as_typed(self):
        self.check(["teach", "--world", "circuit24", "-o", "x", "--seed", "abc"], "(--seed): 'abc' ", "9007199254740992")
        self.check(["teach", "--world", "circuit24", "-o", "x", "--speed-m-s", "9"], "(--speed-m-s): '9' ", "0.01")
        self.check(["replay", "map", "--world", "circuit24", "--laps", "1e"], "(--laps): '1e' ")

    def test_flags_are_checked_before_files(self):
        self.check(["replay", "map", "--world", "none.yaml", "--laps", "0"], "(--laps): 0 ")
        self.check(["replay", "map", "--world", "none.yaml", "--reach-m", "-1"], "(--reach-m): -1 ")
        self.check(["teach", "--world", "none.yaml", "-o", "x", "--driver", "scriptd"], "'scripted'?")
        self.check(["demo", "--world", "none.yaml", "--set", "camera.exposure_ms=20"], "--images")

    def test_no_hint_suggests_to_remove_a_folder_or_a_device(self):
        (self.folder / "folder.mcap").mkdir()
        (self.folder / "folder.txt").mkdir()
        (self.folder / "folder.yaml").mkdir()
        for words, code in ((["teach", "--world", "circuit24", "-o", "folder.mcap"], 1),
                            (["calibrate", "camera", "photograph.png", "--cols", "2", "--rows", "2", "--tag-size-m", "0.1", "-o", "folder.yaml"], 1),
                            (["world", "new", "--path", "line.csv", "-o", "folder.yaml"], 1)):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), outcome.err)
            self.assertRegex(outcome.err, r"folder\.(mcap|txt|yaml)")
            golden_page.expect(self, "cli", outcome.err)
            self.assertNotIn("remove", outcome.err)
        outcome = self.run_here("teach", "--world", "circuit24", "-o", "/dev/null")
        self.assertEqual(outcome.code, 1)
        self.assertIn("/dev/null: ", outcome.err)
        golden_page.expect(self, "cli", outcome.err)
        self.assertNotIn("remove", outcome.err)

    def test_a_missing_file_is_a_failure_for_each_flag(self):
        for words, code in (("detect none.png", 1), ("detect photograph.png --camera none.yaml --tag-size-m 0.1", 1), ("evaluate none.txt none.txt", 1),
                            ("evaluate detections --truth none.csv --detections none.jsonl", 1), ("calibrate camera photograph.png --map none.yaml", 1),
                            ("calibrate robot none.mcap", 1), ("convert none.mcap x.mcap", 1), ("info none.mcap", 1), ("play none.mcap", 1),
                            ("view none.mcap", 1), ("recover none.mcap", 1), ("report none.mcap", 1), ("plot none.mcap", 1),
                            ("localize none.mcap --map none", 1), ("map none.mcap -o m", 1), ("map none.mcap -o m --extend none", 1),
                            ("map none.mcap -o m --world none.yaml", 1), ("map convert none x.yaml", 1), ("replay none --world circuit24", 1),
                            ("replay none --world none.yaml", 1), ("replay none --world circuit24 --calibration none.yaml", 1),
                            ("replay none --world circuit24 --faults none.yaml", 1), ("replay none --world circuit24 --config none.yaml", 1),
                            ("routes none", 1), ("optimize none", 1), ("optimize none --weights none.yaml", 1),
                            ("run --world circuit24 --driver scripted -o s --map none", 1), ("explore --map none", 1),
                            ("simulate --like none.mcap -o x.mcap", 1), ("world check none.yaml", 1), ("world new --path none.csv -o x.yaml", 1),
                            ("world orbit none.yaml", 1), ("teach --world circuit24 -o x --robot-file none.yaml", 1),
                            ("robots none.yaml", 1), ("mbot robot --robot-file none.yaml", 1), ("ros2 robot none.yaml", 1), ("robot-sim --world none.yaml", 1)):
            outcome = self.run_here(*words.split())
            self.assertEqual((outcome.code, outcome.out), (code, ""), f"{words}\n{outcome.err}")
            self.assertIn("none", outcome.err, words)

    def test_an_unknown_word_is_wrong_usage_in_each_verb(self):
        recording = made(*MAP_OF_SQUARE) / "lap.mcap"
        worlds = ("teach -o x --world {}", "replay m --world {}", "explore -o e --world {}", "demo -o d --world {}", "robot-sim --world {}",
                  "robot-sim limo --world {}", f"map {recording} -o m --world {{}}", "run -o r --driver scripted --world {}", "world check {}", "world orbit {}")
        robots = ("teach --world circuit24 -o x --robot-file {}", "robot-sim --world circuit24 --robot-file {}", "robots {}", "limo robot /dev/null --robot-file {}",
                  "mbot robot --robot-file {}", "ros2 robot limo --robot-file {}", "gazebo robot limo --robot-file {}", f"map {recording} -o m --robot {{}}",
                  f"localize {recording} --map {recording.parent}/map --robot {{}}", f"calibrate robot {recording} --robot {{}}")
        profiles = ("teach -o x --robot ros2:{}", "teach -o x --robot gazebo:{}", "localize --map m --robot ros2:{}", "doctor --robot ros2:{}", "ros2 robot {}",
                    "gazebo robot {}", "robot-sim gazebo {} --world circuit24")
        for words in (*worlds, *robots, *profiles):
            for name in ("nowhere", "folder"):
                (self.folder / "folder").mkdir(exist_ok=True)
                outcome = self.run_here(*words.format(name).split())
                self.assertEqual((outcome.code, outcome.out), (2, ""), f"{words}\n{outcome.err}")
                self.assertRegex(outcome.err, rf"waymark [a-z0-9 -]+: \(\S+\): .*'{name}'", words)
        for tag in ("tagx:1", "abc", "99999"):
            for line in (f"map {recording} -o m --anchor {tag}", f"map {recording} -o m --tag-size-m {tag}=0.1", "detect photograph.png --camera camera.yaml --tag-size-m "
                         f"{tag}=0.1", f"teach --robot ros2:limo --tag-size-m 0.1 -o x --anchor {tag}"):
                self.check(line.split(), "--anchor" if "--anchor" in line else "--tag-size-m")

    def test_a_verb_after_flags_and_a_file_of_its_name(self):
        recording = made(*LAP_OF_SQUARE) / "lap.mcap"
        self.check(["map", "-o", "m", "convert", recording], "'-o' of `waymark map convert`")
        self.check(["map", "-o", "m", "lapp", recording], "'lapp'", "`waymark map lap`?")
        self.check(["map", recording, "--tagslam", "-o", "m"], "--tagslam", "(FOLDER)")
        self.check(["localize", "--start", "1", "2", "--map", "m", "x.mcap"], "--start", " 3 ")
        (self.folder / "lap").write_bytes(recording.read_bytes())
        outcome = self.run_here("map", "-o", "m", "lap", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        (self.folder / "lap").unlink()
        outcome = self.run_here("map", "--json", "-o", "n", "lap", recording)
        self.assertEqual((outcome.code, (self.folder / "n/map.yaml").exists()), (0, True), outcome.err)

    def test_calibrate_selects_the_verb_by_flags_and_inputs(self):
        recording = made(*LAP_OF_SQUARE) / "lap.mcap"
        for words, chosen in (([recording], "robot"), (["none.mcap", "-o", "c.yaml"], "robot"), ([recording, "--cols", "6"], "camera"), (["photograph.png"], "camera"),
                              (["board/*.png"], "camera"), (["walk.mp4", "--cols", "6"], "camera"), (["v4l2:/dev/video0"], "guided"), (["x.png", "--guided"], "guided"),
                              (["-o", "c.yaml", "robot", recording], "robot"), (["camera", "v4l2:/dev/video0"], "guided")):
            outcome = self.run_here("calibrate", *words, "--help")
            self.assertEqual((outcome.code, outcome.err), (0, ""), words)
            self.assertIn(f"Usage: waymark calibrate {chosen} ", outcome.out, words)
        self.check(["calibrate"], "camera, guided, robot.")
        self.check(["calibrate", recording, "--rows", "3"], "--cols")

    def test_an_empty_name_is_reported_with_its_flag(self):
        self.check(["teach", "--world", "", "-o", "x"], "--world", "(NAME)")
        self.check(["teach", "--world", "circuit24", "-o", ""], "-o ", "(FILE)")
        self.check(["localize", "lap.mcap", "--map="], "--map")
        self.check(["info", ""], "waymark info")
        for name in ("empty.mp4", "empty.png", "empty.mcap", "empty.yaml"):
            (self.folder / name).touch()
            outcome = self.run_here("detect", name)
            self.assertEqual(outcome.code, 1)
            self.assertRegex(outcome.err, rf"{name}: .*\. [A-Z].*\.")

    def test_configuration(self):
        def write(text):
            (self.folder / "detect.yaml").write_text(text)
            return ["detect", "--json", "--config", "detect.yaml", "photograph.png"]
        outcome = self.run_here(*write("detector:\n  families: [tag25h9]\n"))
        self.assertEqual((outcome.code, outcome.records[0]["detections"]), (0, []))
        outcome = self.run_here(*write("detector:\n  families: [tag25h9]\n"), "--family", "tag36h11")  # a flag overrides
        self.assertEqual(len(outcome.records[0]["detections"]), 2)
        self.check(write("detector:\n  quad_decimat: 2\n"), "detect.yaml:2 (detector.quad_decimat)", "'quad_decimate'", code=1)
        self.check(write("detector:\n  quad_decimate: 99\n"), "detect.yaml:2 (detector.quad_decimate)", code=1)
        self.check(write("refinement:\n  max_shift: 2\n"), "(refinement.max_shift)", "'max_shift_px'", code=1)
        self.check(write("detektor:\n"), "detect.yaml:1", "'detector'", code=1)
        self.check(write("detector: ["), "detect.yaml", code=1)
        self.check(["detect", "--config", "none.yaml", "photograph.png"], "none.yaml: ", code=1)

    def test_help_and_version(self):
        for words in (["--help"], ["detect", "--help"], ["evaluate", "detections", "-h"], ["help", "detect"]):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.err), (0, ""))
            self.assertIn("waymark detect" if "evaluate" not in words else "waymark evaluate detections", outcome.out)
        self.assertRegex(self.run_here("--version").out, r"^waymark \d+\.\d+\.\d+\n$")
        self.assertRegex(self.run_here("--version", "--verbose").out,
                         r"^waymark \d+\.\d+\.\d+\ncompiler +\S+ [\d.]+, \S+\nbuild +(.*\n)+libraries +AprilTag 3[\d.]+, (.*\n)+.*Zstandard [\d.]+\n$")

    def test_the_examples_in_help_run(self):
        count = 0
        self.run_here("detect", "photograph.png", "--annotate", "walk.mp4")  # a video, where this build writes one
        no_video = "walk.mp4" if not (self.folder / "walk.mp4").exists() else None
        for words in (["detect"], ["evaluate", "detections"]):  # those of `evaluate`: evaluate_trajectory_test.py
            text = self.run_here(*words, "--help").out
            for example in re.findall(r"^  (waymark .*)$", text[text.index("Example"):], re.M):
                if (no_video and no_video in example) or "v4l2:" in example:  # live cameras: live_camera_test.py
                    continue
                path = f"{os.path.dirname(PROGRAM)}:{os.environ['PATH']}"
                done = subprocess.run(["bash", "-c", example], cwd=self.folder, env={**os.environ, "PATH": path},
                                      capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(done.returncode, 0, f"{example}\n{done.stderr}")
                count += 1
        self.assertGreaterEqual(count, 6)


class PipesAndSignals(InFolder):
    COPIES = 200
    SAME_KEY_S = 0.2  # two of the same signal within this time are one

    def setUp(self):
        super().setUp()
        rows = images.scene(640, 480, images.SCENE_TAGS)
        images.write_pgm(self.folder / "one.pgm", rows)
        (self.folder / "many").mkdir()
        for number in range(self.COPIES):
            (self.folder / f"many/{number:03}.pgm").symlink_to("../one.pgm")

    def start(self):
        return subprocess.Popen([PROGRAM, "detect", "--json", "many"], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)

    def test_a_closed_pipe_ends_quietly(self):
        process = self.start()
        process.stdout.readline()
        process.stdout.close()
        words = process.stderr.read()
        process.stderr.close()
        self.assertEqual(process.wait(timeout=60), 0, words)
        self.assertNotIn(os.strerror(errno.EPIPE), words)
        self.assertLessEqual(len(words.splitlines()), 1, words)

    def test_unwritable_messages_do_not_stop_the_program(self):
        for words, code in ((["nosuch"], 2), (["detect", "nosuch.png"], 1), (["detect", "photograph.png"], 0)):
            with open("/dev/full", "w", encoding="ascii") as full:
                done = subprocess.run([PROGRAM, *words], cwd=self.folder, stdout=subprocess.DEVNULL, stderr=full, check=False)
                self.assertEqual(done.returncode, code, words)

    def test_a_full_disk_is_a_failure(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            outcome = self.run_here("detect", "--json", "photograph.png", stdout=full)
            self.assertEqual(outcome.code, 1)
            self.assertIn(os.strerror(errno.ENOSPC), outcome.err)
            golden_page.expect(self, "cli", outcome.err)
            self.assertEqual(self.run_here("--help", stdout=full).code, 1)

    def test_ctrl_c_keeps_what_was_done(self):
        process = self.start()
        first = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        rest, words = rest_of(process)
        self.assertEqual(process.returncode, 130, words)
        records = [json.loads(line) for line in (first + rest).splitlines()]
        self.assertLess(len(records), self.COPIES)
        self.assertRegex(words, rf"\b{len(records)} of {self.COPIES}\b")

    def test_the_second_ctrl_c_ends_the_program_at_once_and_restores_the_terminal(self):
        lap = made(*LAP_OF_SQUARE) / "lap.mcap"
        master, terminal = os.openpty()
        before = termios.tcgetattr(terminal)
        stuck = subprocess.Popen([PROGRAM, "play", "--speed", "0", lap], stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                 start_new_session=True, preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))  # its output is not read
        event.until_it_catches(stuck, signal.SIGINT)
        event.until_full(stuck.stdout)
        raw = termios.tcgetattr(terminal)
        raw[3] &= ~(termios.ECHO | termios.ICANON)  # like a keyboard driver
        termios.tcsetattr(terminal, termios.TCSANOW, raw)
        first = time.monotonic()
        for _ in range(2):  # a second signal at once is the same key press, as sent by timeout(1)
            stuck.send_signal(signal.SIGINT)
            event.until_taken(stuck, signal.SIGINT)
        if time.monotonic() - first < self.SAME_KEY_S:  # a busy machine may be too late for that
            self.assertIsNone(stuck.poll())
            time.sleep(2 * self.SAME_KEY_S)
            stuck.send_signal(signal.SIGINT)
        self.assertEqual(stuck.wait(10), -signal.SIGINT)
        golden_page.expect(self, "cli", stuck.stderr.read())
        self.assertEqual(termios.tcgetattr(terminal)[3], before[3])
        stuck.stdout.close()
        stuck.stderr.close()
        os.close(master)
        os.close(terminal)


if __name__ == "__main__":
    unittest.main()
