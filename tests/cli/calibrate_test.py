#!/usr/bin/python3
"""`waymark calibrate` on the command line, with corners projected here by an independent camera model.

usage: calibrate_test.py PROGRAM [unittest options]
"""
import json
import math
import pathlib
import random
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from harness import PROGRAM, event, waymark
from laps import MAP, OTHER_LAP, made, put
import golden_page

FX, FY, CX, CY, K1 = 505.0, 502.0, 322.0, 238.5, -0.12
SIZE, SPACING, COLS, ROWS = 0.03, 0.3, 6, 5
NOISE_PX = 0.05


def turned(quaternion, draw):
    """Rotated by 0.2 degrees (one sigma) about each axis."""
    x, y, z, w = (float(number) for number in quaternion.split(","))
    a, b, c = (draw.gauss(0, math.radians(0.2) / 2) for _ in range(3))
    turned_by = [a * w + b * z - c * y + x, b * w + c * x - a * z + y, c * w + a * y - b * x + z, w - a * x - b * y - c * z]
    length = math.sqrt(sum(number * number for number in turned_by))
    return [number / length for number in turned_by]


def rotate(vector, axis_angle):
    """Rodrigues."""
    angle = math.sqrt(sum(a * a for a in axis_angle)) or 1e-12
    k = [a / angle for a in axis_angle]
    cross = (k[1] * vector[2] - k[2] * vector[1], k[2] * vector[0] - k[0] * vector[2], k[0] * vector[1] - k[1] * vector[0])
    dot = sum(a * b for a, b in zip(k, vector))
    return [v * math.cos(angle) + c * math.sin(angle) + a * dot * (1 - math.cos(angle)) for v, c, a in zip(vector, cross, k)]


def image(name, rng, turn, place):
    pitch, half = SIZE * (1 + SPACING), SIZE / 2
    detections = []
    for number in range(COLS * ROWS):
        x0 = pitch * (number % COLS - (COLS - 1) / 2)
        y0 = -pitch * (number // COLS - (ROWS - 1) / 2)  # ids increase upwards, y downwards
        corners = []
        for dx, dy in ((-half, -half), (half, -half), (half, half), (-half, half)):
            x, y, z = (a + b for a, b in zip(rotate((x0 + dx, y0 + dy, 0), turn), place))
            u, v = x / z, y / z
            bend = 1 + K1 * (u * u + v * v)
            corners.append([FX * u * bend + CX + rng.gauss(0, NOISE_PX), FY * v * bend + CY + rng.gauss(0, NOISE_PX)])
        if all(0 < px < 640 and 0 < py < 480 for px, py in corners):
            detections.append({"tag": f"tag36h11:{number}", "corners_px": corners, "hamming": 0, "decision_margin": 50})
    return {"image": name, "width_px": 640, "height_px": 480, "detections": detections}


def board(count=14):
    rng = random.Random(2)
    lines = []
    for i in range(count):
        about = 2 * math.pi * i / count
        turn = (0.5 * math.cos(about), 0.5 * math.sin(about), rng.uniform(-0.3, 0.3))
        place = (0.06 * math.sin(about), 0.04 * math.cos(about), rng.uniform(0.22, 0.4))
        lines.append(json.dumps(image(f"{i}.png", rng, turn, place)))
    return "\n".join(lines) + "\n"


class Calibrate(unittest.TestCase):
    BOARD = ["--cols", COLS, "--rows", ROWS, "--tag-size-m", SIZE, "--spacing", SPACING]

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-calibrate-"))
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "tags.jsonl").write_text(board())

    def run_here(self, *words):
        outcome = waymark("calibrate", "camera", *words, cwd=self.folder)
        self.assertGreaterEqual(outcome.code, 0, outcome.err)
        return outcome

    def test_finds_the_camera_and_writes_it(self):
        words = ["--detections", "tags.jsonl", *self.BOARD, "--corner-sigma-px", NOISE_PX, "--lens", "radtan4"]
        outcome = self.run_here(*words, "-o", "calibration.yaml", "--camera-info", "camera.yaml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        found = outcome.records[0]
        for name, truth in (("fx_px", FX), ("fy_px", FY), ("cx_px", CX), ("cy_px", CY), ("k1", K1)):
            value = found["parameters"][name]
            self.assertLess(abs(value["value"] - truth), 4 * value["sigma"], name)
        self.assertAlmostEqual(found["noise_scale"], 1, delta=0.1)
        self.assertAlmostEqual(found["held_out_rms_px"], NOISE_PX * math.sqrt(2), delta=0.01)
        self.assertEqual(len(found["images"]), 14)
        self.assertIn("verdict: known", (self.folder / "calibration.yaml").read_text())
        self.assertIn("camera_matrix", (self.folder / "camera.yaml").read_text())
        self.assertEqual(len(found["regions"]), 9)
        table = self.run_here(*words)
        for part in ("fx_px", "13.png"):
            self.assertIn(part, table.out)

    def test_few_images_are_reported(self):
        (self.folder / "few.jsonl").write_text(board(4))
        words = ["--detections", "few.jsonl", *self.BOARD, "--lens", "none"]
        outcome = self.run_here(*words, "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        advice = outcome.records[0]["advice"]
        self.assertRegex(advice[0], r"\b4 ")
        golden_page.expect(self, "calibrate", "\n".join(advice))
        self.assertIn(advice[0], self.run_here(*words).out)

    def test_bad_input(self):
        (self.folder / "two.jsonl").write_text(board(2))
        (self.folder / "mixed.jsonl").write_text(board(5) + board(5).replace('"width_px": 640', '"width_px": 320'))
        (self.folder / "text.jsonl").write_text("no\n")
        for words, code, part in (
                (["--detections", "two.jsonl", *self.BOARD], 1, " 2 "),
                (["--detections", "mixed.jsonl", *self.BOARD], 1, "0.png: 320 x 480"),
                (["--detections", "text.jsonl", *self.BOARD], 1, "text.jsonl:1"),
                (["--detections", "none.jsonl", *self.BOARD], 1, "none.jsonl: "),
                (["--detections", "tags.jsonl"], 2, "--map"),
                (["--detections", "tags.jsonl", "--cols", "6"], 2, "--rows"),
                (["--detections", "tags.jsonl", "--cols", "1000000", "--rows", "1000000", "--tag-size-m", "0.02"], 2, "586"),
                ([*self.BOARD], 2, "--detections"),
                (["--detections", "tags.jsonl", *self.BOARD, "--lens", "wide"], 2, "--lens"),
                (["--detections", "tags.jsonl", "--map", "none.yaml"], 1, "none.yaml")):
            outcome = self.run_here(*words)
            self.assertEqual((outcome.code, outcome.out), (code, ""), f"{words}: {outcome.err}")
            self.assertIn(part, outcome.err)
            golden_page.expect(self, "calibrate", outcome.err)


class CalibrateRobot(unittest.TestCase):
    """The camera mounting differs from the robot file by 3 cm and 2 degrees; wheel odometry is 2 % too long."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="waymark-calibrate-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def test_estimates_the_observable_values(self):
        put(self.folder, *OTHER_LAP, "map lap.mcap -o map --tag-size-sigma-percent 0")  # the world's prints are exact
        text = (self.folder / "map/robot.yaml").read_text()
        true = {name: float(value) for name, value in re.findall(r"(\w+): ([-\d.e]+)", re.search(r"camera_mounting: .*", text)[0])}
        wrong = re.sub(r"(camera_mounting: .*y_m: )[-\d.e]+(.*yaw_deg: )[-\d.e]+",
                       lambda m: f"{m[1]}{true['y_m'] + 0.03}{m[2]}{true['yaw_deg'] + 2}", text)
        (self.folder / "wrong.yaml").write_text(wrong)
        words = ["calibrate", "robot", "lap.mcap", "--by", "innovations", "--map", "map/map.yaml", "--robot", "wrong.yaml", "-o",
                 "calibration.yaml"]
        outcome = waymark(*words, "--json", cwd=self.folder)
        self.assertEqual(outcome.code, 0, outcome.err)
        values = outcome.records[0]["values"]
        for name, truth, enough in (("mounting_y_m", true["y_m"], 0.012), ("mounting_yaw_rad", math.radians(true["yaw_deg"]), 0.006),
                                    ("odometry_scale", 1 / 1.02, 0.006)):
            self.assertEqual(values[name]["verdict"], "known", name)
            self.assertLess(abs(values[name]["value"] - truth), 3 * values[name]["sigma"], name)
            self.assertLess(values[name]["sigma"], enough, name)
        self.assertLess(abs(values["camera_latency_s"]["value"]), 3 * values["camera_latency_s"]["sigma"])
        self.assertLess(abs(values["focal_scale"]["value"] - 1), 0.01, "the mounting is wrong, not the lens")
        self.assertNotIn("sight_scale", values)  # corners determine the focal length instead
        self.assertNotIn("yaw_scale", values)  # the gyro measures turns
        right = waymark(*words[:-3], "map/robot.yaml", "--json", cwd=self.folder).records[0]["values"]
        for name, given in (("mounting_x_m", true["x_m"]), ("mounting_y_m", true["y_m"]), ("mounting_yaw_rad", math.radians(true["yaw_deg"]))):
            self.assertAlmostEqual(right[name]["value"], given, places=9, msg="a value consistent with the drive is kept")
            self.assertTrue(right[name]["advice"], name)
        self.assertLess(abs(right["odometry_scale"]["value"] - 1 / 1.02), 3 * right["odometry_scale"]["sigma"])
        lap = (self.folder / "lap.mcap").read_bytes()
        spoilt = waymark(*words[:-1], "lap.mcap", cwd=self.folder)
        self.assertEqual((spoilt.code, (self.folder / "lap.mcap").read_bytes() == lap), (2, True))
        self.assertIn(".yaml", spoilt.err)
        nowhere = waymark("calibrate", "robot", "none.mcap", "-o", "no/such/calibration.yaml", cwd=self.folder)
        self.assertEqual(nowhere.code, 1)
        self.assertIn("no/such/calibration.yaml: ", nowhere.err)
        self.assertNotIn("none.mcap", nowhere.err, "the output is checked before any work")
        golden_page.expect(self, "calibrate", nowhere.err)
        backwards = waymark("calibrate", "robot", "lap.mcap", "--from", "50", "--to", "10", cwd=self.folder)
        self.assertEqual((backwards.code, backwards.out), (2, ""))
        self.assertRegex(backwards.err, r"\(--to\): .*--from 50 .*--to 10\b")
        for by in (["--by", "lap"], ["--by", "innovations"]):
            beyond = waymark("calibrate", "robot", "lap.mcap", "--map", "map", *by, "--from", "5000", cwd=self.folder)
            self.assertEqual(beyond.code, 1, beyond.err)
            self.assertIn("lap.mcap: ", beyond.err)
            self.assertIn("--from", beyond.err)
            golden_page.expect(self, "calibrate", beyond.err)
        mapped = (self.folder / "map/map.yaml").read_bytes()
        spoilt = waymark(*words[:-1], "map/map.yaml", cwd=self.folder)
        self.assertEqual((spoilt.code, (self.folder / "map/map.yaml").read_bytes() == mapped), (1, True))
        self.assertIn("map/map.yaml: ", spoilt.err)
        golden_page.expect(self, "calibrate", spoilt.err)
        large = waymark("calibrate", "robot", "lap.mcap", "--tag-size-m", "0.3", "--to", "15", cwd=self.folder)
        self.assertEqual(large.code, 0, large.err)
        self.assertRegex(large.err, r"\b0\.3 m .*--tag-size-m.* 0\.16 m ")
        self.assertRegex(large.err, r" \d\d % .* 0\.1\d+ m .* 0\.300 m")
        localized = waymark("localize", "lap.mcap", "--map", "map/map.yaml", "--calibration", "calibration.yaml", "-o", "est.mcap",
                            cwd=self.folder)
        self.assertEqual(localized.code, 0, localized.err)
        running = subprocess.Popen([PROGRAM, *words[:-1], "stopped.yaml"], cwd=self.folder, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        event.until_it_catches(running, signal.SIGINT)  # while it reads or searches, which takes longer
        running.send_signal(signal.SIGINT)
        _, err = running.communicate(timeout=60)
        self.assertEqual(running.returncode, 130, err)
        self.assertFalse((self.folder / "stopped.yaml").exists())
        too_little = waymark(*words[:7], "--to", "0.2", cwd=self.folder)
        self.assertEqual(too_little.code, 1)
        golden_page.expect(self, "calibrate", too_little.err)
        nothing = waymark(*words[:7], "--to", "1.3", "-o", "nothing.yaml", cwd=self.folder)
        self.assertEqual(nothing.code, 1, nothing.err)
        self.assertIn("lap.mcap: ", nothing.err)
        golden_page.expect(self, "calibrate", nothing.err)
        self.assertFalse((self.folder / "nothing.yaml").exists())
        self.tags_of_a_map_measured_by_hand_are_not_reported_as_moved()

    def tags_of_a_map_measured_by_hand_are_not_reported_as_moved(self):
        """Every tag, the anchor included, has an error of 2 mm and 0.2 degrees, and the map contains no covariances."""
        draw = random.Random(5)
        text = re.sub(r"\n    (covariance|tied_to|tied_covariance): .*", "", (self.folder / "map/map.yaml").read_text())
        text = re.sub(r"\nfloor:\n(  .*\n)+", "\n", text)
        text = re.sub(r"position_m: \[(.*)\]", lambda m: f"position_m: {[float(x) + draw.gauss(0, 0.002) for x in m[1].split(',')]}", text)
        text = re.sub(r"quaternion_xyzw: \[(.*)\]", lambda m: f"quaternion_xyzw: {turned(m[1], draw)}", text)
        (self.folder / "measured.yaml").write_text(text)
        outcome = waymark("map", "lap.mcap", "--extend", "measured.yaml", "-o", "extended", "--json", cwd=self.folder)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(outcome.records[0]["extended_tags_agreeing"], outcome.records[0]["tags"], outcome.err)
        tight = waymark("map", "lap.mcap", "--extend", "measured.yaml", "--map-sigma", "0.0001", "-o", "tight", "--json", cwd=self.folder)
        self.assertEqual(tight.code, 0, tight.err)
        self.assertLess(tight.records[0]["extended_tags_agreeing"], tight.records[0]["tags"], tight.err)
        self.assertRegex(tight.err, r"warning: tag36h11:\d+ ")

    def test_bends_at_two_speeds_determine_the_camera_mounting(self):
        """An error of 3 cm and 2 degrees is estimated within 5 mm and 0.2 degrees, with and without a map."""
        share = pathlib.Path(__file__).resolve().parents[2] / "share/robots/limo.yaml"
        text = share.read_text()
        x_m, y_m, yaw_deg = (float(re.search(rf"camera_mounting: .*\b{name}: ([-\d.e]+)", text)[1]) for name in ("x_m", "y_m", "yaw_deg"))
        wrong = re.sub(r"camera_mounting: {x_m: [-\d.e]+, y_m: [-\d.e]+(.*yaw_deg: )[-\d.e]+",
                       lambda m: f"camera_mounting: {{x_m: {x_m + 0.02}, y_m: {y_m + 0.0224}{m[1]}{yaw_deg + 2}", text)
        self.assertNotEqual(wrong, text)
        (self.folder / "wrong.yaml").write_text(wrong)
        shutil.copytree(made(*MAP) / "map", self.folder / "map")
        taught = waymark("teach", "--world", "circuit24", "--seed", "1", "--speed-m-s", "0.3", "--second-speed-m-s", "1", "--wander-m", "0.3",
                         "--wander-time-s", "1.5", "--overlap-m", "16", "-o", "lap.mcap", cwd=self.folder)
        self.assertEqual(taught.code, 0, taught.err)
        for words in ([], ["--map", "map"]):
            outcome = waymark("calibrate", "robot", "lap.mcap", "--robot", "wrong.yaml", "--json", *words, cwd=self.folder)
            self.assertEqual(outcome.code, 0, outcome.err)
            values = outcome.records[0]["values"]
            for name, truth, most in (("mounting_x_m", x_m, 0.005), ("mounting_y_m", y_m, 0.005),
                                      ("mounting_yaw_rad", math.radians(yaw_deg), math.radians(0.2))):
                self.assertEqual(values[name]["verdict"], "known", (name, words))
                self.assertLess(abs(values[name]["value"] - truth), most, (name, words))
                self.assertLess(abs(values[name]["value"] - truth), 2.5 * values[name]["sigma"], (name, words))
        alone = waymark("calibrate", "robot", "lap.mcap", "--by", "innovations", cwd=self.folder)
        self.assertEqual(alone.code, 2)
        self.assertIn("--map", alone.err)
        for flags, part in ((["--corner-sigma-px", "-1"], "--corner-sigma-px"), (["--corner-sigma-px", "0.5"], "(--by): ")):
            outcome = waymark("calibrate", "robot", "lap.mcap", *flags, cwd=self.folder)
            self.assertEqual((outcome.code, outcome.out), (2, ""), outcome.err)
            self.assertIn(part, outcome.err)


if __name__ == "__main__":
    unittest.main()
