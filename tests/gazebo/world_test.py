#!/usr/bin/python3
"""Worlds of Gazebo, exported and imported. The imported worlds have typical contents: included models, boards as boxes thin along x or z, planes,
meshes, nested frames; OpenCV draws the bitmaps. Textures are mapped to boxes as in MeshManager of gz-common, which renders them in Gazebo.
SDFormat reads the exported worlds without a warning, as does Python's XML parser.

usage: world_test.py PROGRAM [TestClass.test]
"""
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

import cv2
import numpy as np
import yaml

PROGRAM = sys.argv.pop(1)
ROOT = pathlib.Path(__file__).resolve().parents[2]
CELL_PX = 10


def bitmap(number, margin_cells=1):
    """A tag36h11 (8 cells wide including its black border) on white paper."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    tag = np.rot90(cv2.aruco.drawMarker(dictionary, number, 8 * CELL_PX), 2)  # OpenCV's tags are upside down
    return cv2.copyMakeBorder(tag, *4 * [margin_cells * CELL_PX], cv2.BORDER_CONSTANT, value=255)


def rotation(roll, pitch, yaw):
    about = lambda axis, angle: cv2.Rodrigues(np.eye(3)[axis] * angle)[0]
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def visual(geometry, texture="", pose="0 0 0 0 0 0", name="v"):
    material = f"<material><diffuse>0.4 0.4 0.4 1</diffuse>{f'<pbr><metal><albedo_map>{texture}</albedo_map></metal></pbr>' if texture else ''}</material>"
    return f"<visual name='{name}'><pose>{pose}</pose><geometry>{geometry}</geometry>{material}</visual>"


def box(x, y, z):
    return f"<box><size>{x} {y} {z}</size></box>"


def model(name, pose, content, static=True):
    return f"<model name='{name}'><static>{str(static).lower()}</static><pose>{pose}</pose><link name='l'>{content}</link></model>"


class Folder(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def run_here(self, *words):
        environment = {**os.environ, "WAYMARK_SHARE": str(ROOT / "share")}
        return subprocess.run([PROGRAM, *words], cwd=self.folder, capture_output=True, text=True, timeout=60, env=environment)

    def world(self, content, version="1.9"):
        (self.folder / "w.sdf").write_text(f"<?xml version='1.0'?><sdf version='{version}'><world name='w'>{content}</world></sdf>")

    def imported(self, *words):
        """The imported tags by number, the world, and the report."""
        run = self.run_here("world", "import", "w.sdf", "-o", "w.yaml", "--json", *words)
        self.assertEqual(run.returncode, 0, run.stderr)
        read = yaml.safe_load((self.folder / "w.yaml").read_text())
        return {tag["id"]: tag for tag in read["tags"]}, read, json.loads(run.stdout)

    def assert_tag(self, tag, place, facing_deg, tilt_deg=0.0, turn_deg=0.0):
        for key, value in zip(("x_m", "y_m", "z_m"), place):
            self.assertAlmostEqual(tag[key], value, delta=1.1e-3, msg=str(tag))
        for key, value in (("facing_deg", facing_deg), ("tilt_deg", tilt_deg), ("turn_deg", turn_deg)):
            self.assertAlmostEqual(abs((tag.get(key, 0) - value + 180) % 360 - 180), 0, delta=0.15, msg=f"{key} {tag}")


class Import(Folder):
    def test_boards_that_are_boxes(self):
        for number in (3, 4, 5):
            cv2.imwrite(str(self.folder / f"t{number}.png"), bitmap(number))
        self.world(model("a", "2 1 0.4 0 0 0.5", visual(box(0.01, 0.2, 0.2), "t3.png")) +
                   model("b", f"-1 2 0.5 {math.pi / 2} 0 0.1", visual(box(0.3, 0.3, 0.012), "t4.png")) +
                   model("c", f"0 -2 0.3 0 0 {-math.pi / 2}", visual(box(0.012, 0.1, 0.1), "t5.png")))
        tags, world, report = self.imported()
        self.assertEqual(sorted(tags), [3, 4, 5])
        out = rotation(0, 0, 0.5) @ [0.005, 0, 0]
        self.assert_tag(tags[3], np.array([2, 1, 0.4]) + out, math.degrees(0.5))
        out = rotation(math.pi / 2, 0, 0.1) @ [0, 0, 0.006]
        # The upper edge of an image on the face +z lies towards +x, to the right of a viewer here: a quarter turn.
        self.assert_tag(tags[4], np.array([-1, 2, 0.5]) + out, math.degrees(0.1) - 90, turn_deg=90)
        self.assert_tag(tags[5], [0, -2.006, 0.3], -90)
        self.assertAlmostEqual(tags[3].get("size_m", world["tag_size_m"]), 0.16, delta=2e-4)
        self.assertAlmostEqual(tags[4].get("size_m", world["tag_size_m"]), 0.24, delta=2e-4)
        self.assertAlmostEqual(tags[5].get("size_m", world["tag_size_m"]), 0.08, delta=2e-4)
        self.assertAlmostEqual(world["two_sided_board_m"], 0.012, delta=1e-4)
        self.assertAlmostEqual(world.get("tag_margin_cells", 1), 0, delta=0.051, msg="the tag's own white border is that margin")
        self.assertNotIn("occluders", world, "tag boards are not occluders")

    def test_planes_meshes_included_models_and_frames(self):
        for name in ("board", "panel"):
            (self.folder / "models" / name / "materials" / "textures").mkdir(parents=True)
            (self.folder / "models" / name / "model.config").write_text(f"<model><name>{name}</name><sdf version='1.6'>model.sdf</sdf></model>")
        cv2.imwrite(str(self.folder / "models/board/materials/textures/any_name.png"), bitmap(7))
        (self.folder / "models/board/model.sdf").write_text("<sdf version='1.6'>" + model("board", "0 0 0 0 0 0", visual(
            box(0.02, 0.2, 0.2), "model://board/materials/textures/any_name.png", pose="0 0 0.5 0 0 0")) + "</sdf>")
        cv2.imwrite(str(self.folder / "models/panel/materials/textures/p.png"), bitmap(8, 2))
        (self.folder / "models/panel/meshes").mkdir()
        (self.folder / "models/panel/meshes/p.mtl").write_text("newmtl m\nmap_Kd p.png\n")
        (self.folder / "models/panel/meshes/p.obj").write_text(  # a square in the plane y z, seen from +x
            "mtllib p.mtl\nv 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n")
        (self.folder / "models/panel/model.sdf").write_text("<sdf version='1.6'>" + model("panel", "0 0 0 0 0 0", visual(
            "<mesh><uri>model://panel/meshes/p.obj</uri><scale>0.15 0.15 0.15</scale></mesh>")) + "</sdf>")
        cv2.imwrite(str(self.folder / "floor tag.png"), bitmap(9))
        self.world(
            "<include><uri>model://board</uri><name>b1</name><pose>1 0 0 0 0 3.14159265</pose></include>"
            "<include><uri>model://panel</uri><pose>0 3 0.7 0 0.2 -1.57079633</pose></include>"
            "<model name='outer'><static>true</static><pose>5 0 0 0 0 1.57079633</pose><link name='l'/>"
            "<frame name='f'><pose>0 1 0 0 0 0</pose></frame><model name='inner'><pose relative_to='f'>0 0 0 0 0 0</pose><link name='l'>" +
            visual("<plane><normal>0 0 1</normal><size>0.2 0.2</size></plane>", "floor tag.png", pose="0 0 0.001 0 0 0") +
            "</link></model></model>")
        tags, world, report = self.imported()
        self.assertEqual(sorted(tags), [7, 8, 9])
        self.assert_tag(tags[7], [0.99, 0, 0.5], 180)
        self.assert_tag(tags[8], [0, 3, 0.7], -90, tilt_deg=-math.degrees(0.2))
        self.assertAlmostEqual(tags[8].get("size_m", world["tag_size_m"]), 0.3 * 8 / 12, delta=3e-4)
        self.assertAlmostEqual(tags[9]["x_m"], 4, delta=1e-3)
        self.assertAlmostEqual(tags[9]["y_m"], 0, delta=1e-3)
        self.assertAlmostEqual(tags[9]["tilt_deg"], 90, delta=0.1)

    def test_furniture_lights_robots_and_the_line(self):
        cv2.imwrite(str(self.folder / "t.png"), bitmap(1))
        self.world("<light type='point' name='lamp'><pose>1 1 2 0 0 0</pose></light>" +
                   model("tag", "2 0 0.5 0 0 0", visual(box(0.01, 0.2, 0.2), "t.png")) +
                   model("crate", "1 2 0.25 0 0 0.5", visual(box(0.6, 0.4, 0.5))) +
                   model("lying", f"3 2 0.2 {math.pi / 2} 0 0.3", visual(box(1.0, 0.4, 0.2))) +
                   model("pillar", "-1 0 1 0 0 0", visual("<cylinder><radius>0.2</radius><length>2</length></cylinder>")) +
                   model("ground", "0 0 0 0 0 0", visual("<plane><normal>0 0 1</normal><size>50 50</size></plane>")) +
                   model("robot", "0.5 0.25 0 0 0 1.57079633", visual(box(0.3, 0.2, 0.2)), static=False))
        _, world, report = self.imported()
        boxes = sorted(world["occluders"], key=lambda b: b["x_m"])
        self.assertEqual([round(b["x_m"]) for b in boxes], [-1, 1, 3])
        pillar, crate, lying = boxes
        self.assertEqual((pillar["length_m"], pillar["width_m"], pillar["height_m"]), (0.4, 0.4, 2.0))
        self.assertEqual((crate["length_m"], crate["width_m"], crate["height_m"]), (0.6, 0.4, 0.5))
        self.assertAlmostEqual(crate["yaw_deg"], math.degrees(0.5), delta=0.06)
        self.assertEqual(sorted((lying["length_m"], lying["width_m"], lying["height_m"])), [0.2, 0.4, 1.0])
        self.assertEqual(lying["height_m"], 0.4, "its y axis points up")
        for pattern in ("robot .*static", r"\b1 .*boxes", "metre .*robot"):
            self.assertTrue(any(re.search(pattern, warning) for warning in report["warnings"]), (pattern, report["warnings"]))
        self.assertEqual(len(report["lights"]), 1)
        self.assertEqual(world["path_m"], [[0.5, 0.25], [0.5, 0.75], [0.5, 1.25]])
        (self.folder / "line.csv").write_text("x,y\n" + "".join(f"{math.cos(a)},{math.sin(a)}\n" for a in np.linspace(0, 2 * math.pi, 60)))
        _, world, _ = self.imported("--path", "line.csv")
        self.assertTrue(world["path_closed"])

    def test_warns_about_unreadable_tags(self):
        cv2.imwrite(str(self.folder / "mirrored.png"), cv2.flip(bitmap(2), 1))
        cv2.imwrite(str(self.folder / "good.png"), bitmap(1))
        mesh = "mtllib none.mtl\nv 0 -1 -1\nv 0 1 -1\nv 0 1 1\nv 0 -1 1\nvt 1 0\nvt 0 0\nvt 0 1\nvt 1 1\nf 1/1 2/2 3/3 4/4\n"  # its texture is mirrored
        (self.folder / "m.obj").write_text(mesh)
        self.world(model("good", "1 0 0.5 0 0 0", visual(box(0.01, 0.2, 0.2), "good.png")) +
                   model("again", "5 0 0.5 0 0 0", visual(box(0.01, 0.2, 0.2), "good.png")) +
                   model("gone", "2 0 0.5 0 0 0", visual(box(0.01, 0.2, 0.2), "nothing.png")) +
                   model("script", "3 0 0.5 0 0 0", visual(box(1, 1, 1)).replace(
                       "<diffuse>0.4 0.4 0.4 1</diffuse>", "<script><uri>file://x</uri><name>Gazebo/Wood</name></script>")) +
                   model("flipped", "4 0 0.5 0 0 0", visual("<mesh><uri>m.obj</uri></mesh>", "good.png")))
        tags, _, report = self.imported()
        self.assertEqual(sorted(tags), [1])
        words = " ".join(report["warnings"])
        for text in ("nothing.png", "Gazebo/Wood", "duplicate", "mirrored"):
            self.assertIn(text, words)

    def test_errors_of_bad_files_contain_place_and_reason(self):
        def error_of(name, *content):
            if content:
                (self.folder / name).write_bytes(content[0])
            run = self.run_here("world", "import", name, "-o", "out.yaml")
            self.assertIn(run.returncode, (1, 2), run.stderr)
            self.assertEqual(len(run.stderr.splitlines()), 1, run.stderr)
            self.assertFalse((self.folder / "out.yaml").exists())
            return run.stderr
        self.assertIn("none.sdf: ", error_of("none.sdf"))
        self.assertRegex(error_of("text.sdf", b"hello\n"), "text.sdf.* XML")
        self.assertIn("bad.sdf:3", error_of("bad.sdf", b"<sdf version='1.9'>\n<world name='w'>\n<model <\n"))
        self.assertRegex(error_of("noise.sdf", np.random.default_rng(1).bytes(100000)), "noise.sdf.* XML")
        self.assertRegex(error_of("nothing.sdf", b"<sdf version='1.9'><world name='w'/></sdf>"), r"nothing\.sdf: .*\b0 of 0 ")
        self.assertIn("pose", error_of("nan.sdf", b"<sdf version='1.9'><world name='w'><model name='m'><pose>nan 0 0 0 0 0</pose><link name='l'/></model></world></sdf>"))
        deep = 20000
        error_of("deep.sdf", b"<sdf version='1.9'><world name='w'>" + deep * b"<model name='m'>" + deep * b"</model>" + b"</world></sdf>")
        self.assertIn("tag99", self.run_here("world", "import", "nothing.sdf", "-o", "x.yaml", "--family", "tag99").stderr)


class Export(Folder):
    def test_every_world_round_trips_without_warnings_of_sdformat(self):
        for world, family in (("circuit24", "tag36h11"), ("limo-walls", "tag36h11"), ("academy-house", "tag36h11"), ("mbot-square", "tagCustom48h12")):
            with self.subTest(world):
                run = self.run_here("world", "export", world, "--sdf", world)
                self.assertEqual((run.returncode, run.stderr), (0, ""), run.stderr)
                run = self.run_here("world", "import", f"{world}/world.sdf", "-o", f"{world}.yaml", "--family", family, "--json")
                self.assertEqual(run.returncode, 0, run.stderr)
                warnings = json.loads(run.stdout)["warnings"]
                self.assertEqual(len(warnings), 2, warnings)  # the robot is not static; the position of the line
                before = yaml.safe_load((ROOT / f"share/worlds/{world}.yaml").read_text())
                after = yaml.safe_load((self.folder / f"{world}.yaml").read_text())
                again = {tag["id"]: tag for tag in after["tags"]}
                count = len(before["tags"]) + sum(len(panel["tags"]) for panel in before.get("panels", []))
                self.assertEqual(len(again), count)
                for tag in before["tags"]:
                    self.assert_tag(again[tag["id"]], (tag["x_m"], tag["y_m"], tag["z_m"]), tag["facing_deg"], tag.get("tilt_deg", 0))
                    self.assertAlmostEqual(again[tag["id"]].get("size_m", after["tag_size_m"]), tag.get("size_m", before["tag_size_m"]), delta=2e-4)

    def test_the_robot_matches_its_robot_file(self):
        self.run_here("world", "export", "circuit24", "--sdf", "out")
        robot = yaml.safe_load((self.folder / "out/robot.yaml").read_text())
        world = xml.etree.ElementTree.parse(self.folder / "out/world.sdf").getroot().find("world")
        made = next(m for m in world.findall("model") if m.find("static") is None)
        camera = made.find("link/sensor[@type='camera']")
        focal_px = robot["camera_info"]["camera_matrix"]["data"][0]
        width_px = robot["camera_info"]["image_width"]
        self.assertEqual(int(camera.find("camera/image/width").text), width_px)
        self.assertAlmostEqual(width_px / 2 / math.tan(float(camera.find("camera/horizontal_fov").text) / 2), focal_px, delta=1e-3)
        place = [float(v) for v in camera.find("pose").text.split()]
        mounting = robot["camera_mounting"]
        np.testing.assert_allclose(place[:3], [mounting["x_m"], mounting["y_m"], mounting["z_m"]], atol=1e-6)
        np.testing.assert_allclose(place[3:], 0, atol=1e-6)
        drive = made.find("plugin[@name='ignition::gazebo::systems::DiffDrive']")
        self.assertEqual(float(drive.find("wheel_separation").text), robot["wheels"]["track_m"])
        self.assertEqual(float(drive.find("wheel_radius").text), robot["wheels"]["radius_m"])
        self.assertEqual(float(drive.find("max_linear_velocity").text), robot["limits"]["speed_m_s"])
        joints = {joint.get("name") for joint in made.findall("joint")}
        self.assertEqual(joints, {drive_joint.text for side in ("left", "right") for drive_joint in drive.findall(f"{side}_joint")})
        profile = yaml.safe_load((self.folder / "out/gazebo.yaml").read_text())
        self.assertEqual(profile["command_topic"], drive.find("topic").text)
        self.assertEqual(profile["odometry_topic"], drive.find("odom_topic").text)
        self.assertEqual(profile["truth_model"], made.get("name"))
        for file in world.iter("albedo_map"):
            self.assertTrue((self.folder / "out" / file.text).is_file(), file.text)

    def test_warns_about_a_camera_that_gazebo_does_not_render(self):
        run = self.run_here("world", "export", "circuit24", "--robot-file", "limo", "--sdf", "out")
        self.assertEqual(run.returncode, 0)
        self.assertIn("pinhole", run.stderr)
        again = self.run_here("world", "export", "circuit24", "--sdf", "out")
        self.assertEqual(again.returncode, 1)
        self.assertIn("out: ", again.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[1:])
