#!/usr/bin/python3
"""Every file that a verb writes is read back by every verb that takes such a file.

WRITTEN lists the written files, each with the command that writes it; READERS lists per kind of file the commands that
read it. A verb, or a file in a written folder, that has no row fails the test.

usage: round_trip_test.py PROGRAM [unittest options]
"""
import fnmatch
import math
import pathlib
import re
import shlex
import shutil
import sys
import tempfile
import unittest

import images
from calibrate_test import board
from harness import PROGRAM, waymark

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOARD = "--cols 6 --rows 5 --tag-size-m 0.03 --spacing 0.3"

# A lap of 6 m with bends to both sides, and a line of 2 m.
RING = [(r * math.cos(a), r * math.sin(a)) for a in (k * math.pi / 24 for k in range(49)) for r in [0.9 + 0.15 * math.cos(3 * a)]]
LINE = [[2.53, -1.45], [2.89, -0.98], [3.04, -0.4], [3.02, 0.2]]  # among the tags of circuit24

# A robot process between driver and simulator: for three seconds the robot backs up, whatever the driver commands.
BACKS_UP = """
import json, subprocess, sys
robot = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE, text=True)
for count, line in enumerate(sys.stdin):
    command = json.loads(line)
    if command["type"] == "velocity" and 80 <= count < 140:
        command.update(speed_m_s=-0.2, yaw_rate_rad_s=0.0)
    robot.stdin.write(json.dumps(command) + "\\n")
    robot.stdin.flush()
robot.stdin.close()
sys.exit(robot.wait())
"""
BACKING_ROBOT = f"process:exec '{sys.executable}' backs_up.py '{PROGRAM}' robot-sim --world line.yaml --lockstep --seed 4"

# (kind, file, command that writes it), in this order. None: an earlier command has written the file.
WRITTEN = (
    ("world", "ring.yaml", "world new --path ring.csv -o {file}"),
    ("lap of the ring", "ring.mcap", "teach --world ring.yaml --seed 2 -o {file}"),
    ("second lap of the ring", "ring2.mcap", "teach --world ring.yaml --seed 5 -o {file}"),
    ("lap of the line", "line.mcap", "teach --world line.yaml --seed 3 -o {file}"),
    ("lap of the line", "back.mcap", f"teach --world line.yaml --robot {shlex.quote(BACKING_ROBOT)} -o {{file}}"),
    ("map", "ring", "map ring.mcap -o {file}"),
    ("map", "line", "map line.mcap -o {file}"),
    ("reversing map", "back", "map back.mcap -o {file}"),
    ("lap of the line", "like.mcap", "simulate --like line.mcap --world line.yaml -o {file}"),
    ("lap of the line", "copy.mcap", "convert line.mcap {file} --from 0 --to 8"),
    ("lap of the line", "whole.mcap", "recover line.mcap -o {file}"),
    ("lap of the line", "humble_bag", "convert line.mcap {file} --format rosbag2"),
    ("lap of the line", "jazzy_bag", "convert line.mcap {file} --format rosbag2 --ros-distro jazzy"),
    ("table", "seen.csv", "convert ring.mcap {file} --kind detections"),
    ("table", "odometry.csv", "convert ring.mcap {file} --kind odometry"),
    ("table", "imu.csv", "convert ring.mcap {file} --kind imu"),
    ("map", "of_tables", "map seen.csv odometry.csv imu.csv -o {file} --robot limo --tag-size-m 0.16 --anchor 0"),
    ("map", "chained", "map ring.mcap -o {file} --method chain"),
    ("map", "extended", "map ring2.mcap -o {file} --extend ring --route-name part"),
    ("route", "ring/route-fast.yaml", "optimize ring --name fast --rounds 1"),
    ("route", "ring/route.yaml", "routes ring --station door --at-m 1.5 --pause-s 1"),
    ("route", "line/route.yaml", "routes line --station shelf --at-m 1 --pause-s 1"),
    ("route", "back/route.yaml", "routes back --station end --at-m 2 --pause-s 1"),
    ("route", "extended/route-part.yaml", None),
    ("map file", "ring/map.yaml", None),
    ("robot", "ring/robot.yaml", None),
    ("trajectory", "ring/trajectory.txt", None),
    ("trajectory", "ring/truth_trajectory.txt", None),
    ("trajectory", "ring.tum", "convert ring.mcap {file} --topics /odom"),
    ("trajectory", "estimate.tum", "localize ring.mcap --map ring -o {file}"),
    ("poses", "estimate.mcap", "localize ring.mcap --map ring -o {file}"),
    ("drive", "replay.mcap", "replay ring --world ring.yaml --seed 11 -o {file}"),
    ("robot calibration", "calibration.yaml", "calibrate robot ring.mcap --map ring -o {file}"),
    ("map of others with poses", "academy.yaml", "map convert ring {file} --to academy"),
    ("map of others", "tagslam.yaml", "map convert ring {file} --to tagslam"),
    ("map of others", "tf.yaml", "map convert ring {file} --to tf"),
    ("map of others", "tf.mcap", "map convert ring {file} --to tf"),
    ("map of others with poses", "wpilib.json", "map convert ring {file} --to wpilib"),
    ("map of others with poses", "limelight.fmap", "map convert ring {file}"),
    ("map of others with poses", "ours.yaml", "map convert ring {file}"),
    ("world", "laid.yaml", "world new --path ring.mcap -o {file}"),
    ("world", "twin/world.yaml", "world from-recording ring.mcap --map ring -o twin"),
    ("robot", "twin/robot.yaml", None),
    ("world in SDF", "sdf", "world export ring.yaml --sdf {file}"),
    ("robot", "sdf/robot.yaml", None),
    ("sheet", "tags.png", "tags sheet --ids 0-3 --tag-size-m 0.05 --dpi 100 -o {file}"),
    ("sheet", "board.png", "tags board --style separate --cols 4 --rows 3 --tag-size-m 0.03 --dpi 100 -o {file}"),
    ("detections", "seen.jsonl", "detect photograph.png --json --covariance > {file}"),
    ("camera calibration", "lens.yaml", f"calibrate camera --detections tags.jsonl {BOARD} -o {{file}} --camera-info info.yaml"),
    ("camera calibration", "info.yaml", None),
    *(("camera calibration", f"lens_{form}.{ending}",
       f"calibrate camera --detections tags.jsonl {BOARD} --lens radtan4 --format {form} -o {{file}}")
      for form, ending in (("ros", "yaml"), ("kalibr", "yaml"), ("photonvision", "json"), ("opencv", "yaml"))),
)

WORLD_OF = {"line": "line.yaml", "back": "line.yaml"}  # of the other folders: ring.yaml

# What takes any recording. None of it needs a robot in the recording.
ANY_RECORDING = ("info {file} --json", "play {file} --speed 0 --json", "convert {file} {new}.mcap", "report {file} -o {new}.html",
                 "plot {file}")

# The commands that read a kind of file; a tuple is a documented refusal: exit code, part of the message, command.
READERS = {
    "lap of the line": (*ANY_RECORDING, "map {file} -o {new}", "localize {file} --map line --json"),
    "lap of the ring": (*ANY_RECORDING, "map {file} -o {new}", "localize {file} --map ring --json", "play {file} --speed 0 --messages",
                        "info {file} --quick", "recover {file} -o {new}.mcap", "evaluate {file} {file} --est-topic /odom",
                        "calibrate robot {file} -o {new}.yaml", "world from-recording {file} --map ring -o {new}",
                        "world new --path {file} -o {new}.yaml", "simulate --like {file} --world ring.yaml -o {new}.mcap"),
    "second lap of the ring": (*ANY_RECORDING, "map {file} -o {new}", "localize {file} --map ring --json"),
    "poses": (*ANY_RECORDING, "evaluate {file} {file}", "evaluate {file} ring/truth_trajectory.txt --odometry ring.mcap",
              "evaluate {file} ring/route.yaml", "evaluate {file} {file} --map ring/map.yaml --figures {new}"),
    "drive": (*ANY_RECORDING, "evaluate {file} {file}", "map {file} -o {new}", "localize {file} --map ring --json",
              "recover {file} -o {new}.mcap", "world new --path {file} -o {new}.yaml"),
    "table": ("info {file} --json", "play {file} --speed 0 --json", "convert {file} {new}.mcap --robot limo"),
    "map": ("replay {file} --world {world} --seed 12 --json", "routes {file} --json", "localize {lap} --map {file} --json",
            "report {file} -o {new}.html", "plot {file}", "map {lap} -o {new} --extend {file}",
            "map {lap} -o {new} --prior {file}", "map convert {file} {new}.yaml", "calibrate robot {lap} --map {file}"),
    "reversing map": ("replay {file} --world {world} --seed 12 --json", "routes {file} --json", "report {file} -o {new}.html",
                      "plot {file}", "map {lap} -o {new} --extend {file}",
                      "world from-recording {lap} --map {file} -o {new}", (1, "reverse", "optimize {file} --name {new} --rounds 1")),
    "map file": ("localize ring.mcap --map {file} --json", "map convert {file} {new}.yaml"),
    "route": ("evaluate {folder}/trajectory.txt {file}",
              "replay {folder} --world {world} --seed 13 {route}"),
    "trajectory": ("evaluate {file} {file}", "evaluate {file} ring/truth_trajectory.txt --alignment se2"),
    "robot": ("robots {file}", "world check ring.yaml --robot-file {file}", "teach --world ring.yaml --robot-file {file} -o {new}.mcap",
              "localize ring.mcap --map ring --robot {file}"),
    "robot calibration": ("localize ring.mcap --map ring --calibration {file}", "calibrate robot ring.mcap --map ring --calibration {file}",
                          "replay ring --world ring.yaml --calibration {file}"),
    "camera calibration": ("detect photograph.png --camera {file} --tag-size-m 0.1 --json",),
    "map of others": ("map convert {file} {new}.yaml --tag-size-m 0.16",),
    "map of others with poses": ("map convert {file} {new}.yaml --tag-size-m 0.16",
                                 "localize ring.mcap --map {file} --robot ring/robot.yaml --tag-size-m 0.16"),
    "world": ("world check {file}", "world orbit {file}", "world export {file} --sdf {new}", "teach --world {file} -o {new}.mcap"),
    "world in SDF": ("world import {file}/world.sdf -o {new}.yaml",),
    "sheet": ("detect {file} --json",),
    "detections": ("evaluate detections --truth truth.csv --detections {file}",
                   (1, "images show two tags", f"calibrate camera --detections {{file}} {BOARD}")),
}

# Verbs without a row, and why.
WITHOUT_A_ROW = {
    "demo": "writes the files of teach, map and replay", "run": "writes the files of teach, map and replay",
    "samples": "samples_test.py", "view": "view_test.py",
    "commission": "commission_test.py", "doctor": "reads a live camera", "stop": "no file", "explore": "no file", "cameras": "no file",
    "ros2": "a network", "limo": "a port", "mbot": "a network", "gazebo": "a network", "robot-sim": "speaks to a robot process"}

# Accepted failures: the verdict on a world that was read, and a program that was built without a module.
ACCEPTED_FAILURES = ("good lap", "module for SDF")

# Files of written folders that are read with their folder, or by other programs and people.
WITHOUT_READERS = ("*/odometry*.yaml", "*/trajectory_covariance*.csv", "*/summary*.json", "*.svg", "*.html", "sdf/*", "*_bag/*")


class RoundTrip(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-round-trip-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        text = (ROOT / "share/worlds/circuit24.yaml").read_text().split("path_closed:")[0]
        (cls.folder / "line.yaml").write_text(f"{text}path_closed: false\npath_m: {LINE}\n")
        (cls.folder / "ring.csv").write_text("x,y\n" + "".join(f"{x:.4f},{y:.4f}\n" for x, y in RING))
        (cls.folder / "backs_up.py").write_text(BACKS_UP)
        (cls.folder / "tags.jsonl").write_text(board())
        images.write_png(cls.folder / "photograph.png", images.scene(640, 480, images.SCENE_TAGS))
        (cls.folder / "truth.csv").write_text(images.truth_csv({"photograph": images.SCENE_TAGS}))
        cls.given = cls.files()
        cls.count = 0
        cls.not_written = [failed for _, file, command in WRITTEN if command for failed in cls.run_line(command, file)]
        cls.written = cls.files() - cls.given

    @classmethod
    def files(cls):
        return {str(path.relative_to(cls.folder)) for path in cls.folder.rglob("*") if path.is_file()}

    @classmethod
    def run_line(cls, command, file, code=0, part=""):
        """The failures, in a list."""
        cls.count += 1
        path = pathlib.PurePath(file)
        top = path.parts[0]
        route = re.match(r"route-(\w+)\.yaml", path.name)
        line = command.format(file=file, new=f"new{cls.count}", folder=path.parent, route=f"--route {route[1]}" if route else "",
                              world=WORLD_OF.get(top, "ring.yaml"), lap=f"{top}.mcap" if top in WORLD_OF else "ring.mcap")
        line, _, output = line.partition(" > ")
        outcome = waymark(*shlex.split(line), cwd=cls.folder)
        if output:
            (cls.folder / output).write_text(outcome.out)
        if outcome.code == code and part in outcome.err:
            return []
        if outcome.code == 1 and any(part in outcome.err for part in ACCEPTED_FAILURES):
            return []
        return [f"waymark {line}: exit code {outcome.code}, not {code}\n{outcome.err[-600:]}"]

    def test_every_written_file_is_read(self):
        failed = list(self.not_written)
        for kind, file, _ in WRITTEN:
            for reader in READERS[kind]:
                code, part, command = reader if isinstance(reader, tuple) else (0, "", reader)
                failed += self.run_line(command, file, code, part)
        self.assertEqual(len(failed), 0, "\n".join(["", *failed]))

    def test_every_written_file_has_a_row(self):
        rows = {file for _, file, _ in WRITTEN}
        like_a_row = {pathlib.PurePath(file).name for file in rows if "/" in file}  # in another folder
        without = [file for file in sorted(self.written) if file not in rows and
                   re.sub(r"-part\b", "", pathlib.PurePath(file).name) not in like_a_row and
                   not any(fnmatch.fnmatch(file, pattern) for pattern in WITHOUT_READERS)]
        self.assertEqual(without, [])

    def test_every_verb_has_a_row(self):
        verbs = re.findall(r"^  ([a-z][\w-]*) ", waymark("--help").out.split("Verbs:")[1].split("\n\n")[0], re.MULTILINE)
        self.assertGreater(len(verbs), 30)
        commands = [command for _, _, command in WRITTEN if command]
        commands += [reader[-1] if isinstance(reader, tuple) else reader for readers in READERS.values() for reader in readers]
        have = {command.split()[0] for command in commands} | set(WITHOUT_A_ROW)
        self.assertEqual(sorted(set(verbs) - have), [])
        self.assertEqual(sorted(have - set(verbs)), [], "rows of verbs that do not exist")


if __name__ == "__main__":
    unittest.main()
