#!/usr/bin/python3
"""Wrong arguments are named; non-finite numbers, unknown sizes and finished sessions are refused; every public name has a docstring.

usage: wrong_types_test.py     (PYTHONPATH names the package)
"""
import ast
import gc
import inspect
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import warnings

import numpy as np

import waymark
from waymark import camera, config, errors, evaluation, families, geometry, mapping, recording, replay, samples, simulation, tags

BAD = (float("nan"), float("inf"))
WORLD, ROBOT = config.read_world("circuit24"), config.read_robot("limo")


def is_explained(doc):
    """Whether a docstring holds more than signatures."""
    return any(line.strip() and " -> " not in line and "Overloaded function" not in line for line in (doc or "").splitlines())


class Docstrings(unittest.TestCase):
    def test_every_public_name_has_a_docstring(self):
        silent = []
        for room in (getattr(waymark, name) for name in waymark.__all__ if inspect.ismodule(getattr(waymark, name))):
            for name, value in vars(room).items():
                if name.startswith("_") or not callable(value):
                    continue
                silent += [] if is_explained(value.__doc__) else [f"{room.__name__}.{name}"]
                for member, attribute in vars(value).items() if inspect.isclass(value) else ():
                    called = getattr(attribute, "__func__", attribute)
                    if not member.startswith("_") and (callable(called) or isinstance(called, property)) and not is_explained(called.__doc__):
                        silent.append(f"{room.__name__}.{name}.{member}")
        self.assertEqual(silent, [])

    def test_academy_and_labs_have_docstrings(self):
        folder = pathlib.Path(waymark.__file__).parent
        files = [*(folder / "academy").glob("*.py"), folder / "labs/__init__.py", folder / "labs/loops.py"]  # labNN: each check has its sentence in CHECKS
        self.assertGreater(len(files), 8)
        silent = []
        for file in files:
            for parent in ast.walk(ast.parse(file.read_text())):
                if isinstance(parent, ast.Module) and not ast.get_docstring(parent):
                    silent.append(file.name)
                for node in parent.body if isinstance(parent, (ast.Module, ast.ClassDef)) else ():
                    if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_") and not ast.get_docstring(node):
                        silent.append(f"{file.name}: {node.name}")
        self.assertEqual(silent, [])


class Types(unittest.TestCase):
    def test_errors_name_the_argument_the_expected_type_and_the_given_value(self):
        lens = camera.pinhole(64, 48, 50, 50, 32, 24)
        for call, words in ((lambda: geometry.SE2("a", 0, 0), "SE2(): argument 'x' is 'a' (str): expected a number"),
                            (lambda: geometry.SE2(1, 2), "SE2(): lacks the argument 'yaw'. It takes x, y, yaw"),
                            (lambda: geometry.SE2(1, 2, 3, 4), "SE2(): takes 3 arguments (x, y, yaw), but 4 were given"),
                            (lambda: geometry.SO3(np.eye(3)), "SO3(): takes 0 arguments (), but 1 were given. Other ways: SO3.from_matrix(), SO3.from_quaternion(), SO3.from_rpy()"),
                            (lambda: geometry.SE3(np.eye(4)), "Other ways: SE3.from_matrix()"),
                            (lambda: samples.Odometry(1, 2), "Odometry(): takes keyword arguments only: stamp_ns, odom_T_base, speed_m_s, yaw_rate_rad_s"),
                            (lambda: families.turned("tag16h5", -1, 1), "turned(): argument 'code' is -1: expected a whole number of 0 or more"),
                            (lambda: simulation.Simulator(WORLD, ROBOT, seed=-1), "Simulator(): argument 'seed' is -1: expected a whole number of 0 or more"),
                            (lambda: geometry.SE2(x=1, y=2, jaw=3), "SE2(): has no argument 'jaw'. Known: x, y, yaw"),
                            (lambda: geometry.SE3(geometry.SE3(), [0, 0, 0]), "SE3(): argument 'rotation' is a SE3: expected a waymark.geometry.SO3"),
                            (lambda: camera.pinhole(64.5, 48, 50, 50, 32, 24), "pinhole(): argument 'width_px' is 64.5 (float): expected a whole number"),
                            (lambda: camera.pinhole(64, 48, 50, 50, 32, 24, distortion="k1"), "argument 'distortion' is 'k1' (str): expected a list of a number"),
                            (lambda: tags.Detector().detect(np.zeros((48, 64), np.uint8), "lens"), "Detector.detect(): argument 'camera' is 'lens' (str)"),
                            (lambda: samples.visible_corners(lens, None, 0.1), "visible_corners(): argument 'cam_T_tag' is None: expected a waymark.geometry.SE3"),
                            (lambda: samples.Odometry(speed_m_s="fast"), "Odometry.speed_m_s is 'fast' (str): expected a number"),
                            (lambda: samples.Odometry(stamp_ns=2**70), "Odometry.stamp_ns is too large a whole number"),
                            (lambda: recording.Recording(3), "Recording(): argument 'path' is 3 (int): expected a path"),
                            (lambda: families.bitmap(7), "bitmap(): argument 'tag' is 7 (int): expected a string"),
                            (lambda: geometry.SO3.from_rpy(0, 0, [1]), "from_rpy(): argument 'yaw' is a list of 1: expected a number")):
            with self.assertRaises(TypeError, msg=words) as raised:
                call()
            self.assertIn(words, str(raised.exception))
            for raw in ("incompatible", "Invoked with", "_waymark", "::"):
                self.assertNotIn(raw, str(raised.exception))


class Numbers(unittest.TestCase):
    def test_attributes_that_are_not_finite_are_refused(self):
        for bad in BAD:
            for kind, name in ((samples.Odometry, "speed_m_s"), (samples.Odometry, "yaw_rate_rad_s"), (samples.WheelTicks, "left_rad"), (samples.WheelTicks, "right_rad"),
                               (samples.StampedCommand, "speed_m_s"), (samples.StampedCommand, "yaw_rate_rad_s"), (samples.RangeBearing, "range_m"),
                               (samples.RangeBearing, "bearing_rad"), (samples.LaserScan, "angle_min_rad"), (samples.TagDetection, "decision_margin"), (samples.MappedTag, "size_m")):
                with self.assertRaises(errors.InvalidArgument, msg=f"{kind} {name}") as raised:
                    kind(**{name: bad})
                self.assertEqual(raised.exception.key, name)
        with self.assertRaisesRegex(errors.InvalidArgument, "negative"):
            samples.MappedTag(size_m=-0.1)
        tag_map = samples.TagMap()
        with self.assertRaisesRegex(errors.InvalidArgument, "tag36h11:3 has no size"):
            tag_map[3] = samples.MappedTag()
        self.assertEqual(len(tag_map), 0)

    def test_codes_with_more_bits_than_the_family_are_refused(self):
        for call in (lambda code: families.turned("tag16h5", code, 1), lambda code: families.min_rotational_distance("tag16h5", 0, code)):
            call(0xFFFF)
            with self.assertRaisesRegex(errors.InvalidArgument, r"\((code|b)\): 0x10000 .*16 bits of tag16h5"):
                call(0x10000)

    def test_maps_without_a_common_tag_have_no_errors(self):
        world = config.read_world("circuit24")
        self.assertEqual(evaluation.map_errors(world.tags, world.tags)["rmse_m"], 0)
        for estimated, truth in ((samples.TagMap(), world.tags), (world.tags, samples.TagMap())):
            with self.assertRaisesRegex(errors.InvalidArgument, "no tag"):
                evaluation.map_errors(estimated, truth)

    def test_a_camera_of_another_size_is_refused(self):
        lens = camera.pinhole(64, 48, 50, 50, 32, 24)
        self.assertEqual(tags.Detector().detect(np.zeros((48, 64), np.uint8), lens), [])
        with self.assertRaisesRegex(errors.InvalidArgument, r"\(camera\): .*64 x 48 .*48 x 64"):
            tags.Detector().detect(np.zeros((64, 48), np.uint8), lens)


    def test_the_range_of_a_lidar_is_a_number_or_infinite(self):
        self.assertEqual(samples.LaserScan(range_max_m=float("inf")).range_max_m, float("inf"))
        with self.assertRaisesRegex(errors.InvalidArgument, "range_max_m"):
            samples.LaserScan(range_max_m=float("nan"))

    def test_entries_of_a_photograph_that_are_not_tags_are_named(self):
        lens = camera.pinhole(64, 48, 50, 50, 32, 24)
        for entry in (1, "tag", (1, geometry.SE3()), (1, 2, 3), (1, geometry.SE3(), "wide"), None):
            with self.assertRaisesRegex(errors.InvalidArgument, r"is not \(tag, cam_T_tag, size_m\)"):
                simulation.photograph(lens, [entry])

    def test_hints_name_functions_that_exist(self):
        with self.assertRaises(errors.InvalidArgument) as raised:
            tags.Detector().detect(np.zeros((4, 4, 3), np.uint8))
        for room, name in re.findall(r"waymark\.(\w+)\.(\w+)\(", raised.exception.hint):
            self.assertTrue(callable(getattr(getattr(waymark, room), name, None)), raised.exception.hint)


class Drives(unittest.TestCase):
    """A robot of one's own that is wrong is named, and nothing drives."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.map = str(pathlib.Path(folder.name) / "map")
        lap = str(pathlib.Path(folder.name) / "lap.mcap")
        with recording.Writer(lap) as writer:
            writer.add_attachment("robot.yaml", "application/yaml", ROBOT.to_yaml())
            writer.add_camera(0, ROBOT.camera, ROBOT.base_T_cam)
            for sample in simulation.scripted_lap(WORLD, ROBOT):
                writer.add(sample)
        mapping.map_recording(lap, cls.map, anchor=1, tag_size_m=0.16)

    def test_hints_name_keywords_and_no_flags(self):
        lap = str(pathlib.Path(self.map).parent / "lap.mcap")
        with self.assertRaises(errors.NotFound) as raised:
            mapping.map_recording(lap, self.map + "2")
        self.assertIn("Set tag_size_m to the side", raised.exception.hint)
        self.assertNotIn("--", str(raised.exception))

    def test_numbers_of_laps_are_checked(self):
        for laps in (float("nan"), -1, 0, 1e9):
            with self.assertRaisesRegex(errors.InvalidArgument, "laps"):
                waymark.ReplaySession(self.map, laps=laps)

    def test_a_choice_is_named_as_in_python(self):
        for keyword in ("method", "controller"):
            with self.assertRaises(errors.InvalidArgument) as raised:
                replay.ReplaySession(self.map, **{keyword: "magic"})
            self.assertEqual(raised.exception.key, keyword)
            self.assertNotIn("--", str(raised.exception))

    def robot(self, answer):
        class Robot:
            def step(self, speed_m_s, yaw_rate_rad_s, now_ns):
                return answer(now_ns)
        return Robot

    def refused(self, kind, words, robot, **options):
        with self.assertRaisesRegex(kind, words):
            replay.drive(self.map, robot, timeout_s=5, **options)

    def test_invalid_results_of_a_robot_are_named(self):
        self.refused(TypeError, r"step\(\) returned None: expected a list of samples", self.robot(lambda _: None)())
        self.refused(TypeError, r"step\(\) returned 3: expected a list of samples", self.robot(lambda _: 3)())
        self.refused(TypeError, "an? int is not a sample", self.robot(lambda _: [3])())
        self.refused(TypeError, "robot is the class Robot: expected an instance", self.robot(lambda _: []))
        self.refused(TypeError, r"on_step is 3: expected a function", self.robot(lambda _: [])(), on_step=3)

    def test_images_need_a_detector_and_the_size_of_the_camera(self):
        small = self.robot(lambda now_ns: [samples.CameraFrame(now_ns, np.zeros((10, 10), np.uint8))])
        self.refused(TypeError, "no detector is given", small())
        self.refused(ValueError, "an image of 10 x 10", small(), detector=tags.Detector())


class Writers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = str(pathlib.Path(folder.name) / "a.mcap")

    def test_corners_that_are_not_finite_are_refused(self):
        detection = samples.TagDetection(tag=1)
        detection.corners_px[2, 1] = np.nan
        with recording.Writer(self.path) as writer:
            with self.assertRaisesRegex(errors.InvalidArgument, "corners_px.*not finite"):
                writer.add(samples.TagFrame(detections=[detection]))
            writer.add(samples.Odometry(stamp_ns=1))
        self.assertEqual(len(list(recording.Recording(self.path))), 1)

    def test_unknown_topics_are_refused(self):
        with recording.Writer(self.path) as writer:
            writer.add(samples.Odometry(stamp_ns=1))
        read = recording.Recording(self.path)
        topic = read.channels[0]["topic"]
        self.assertEqual(len(list(read.messages(topics={topic}))), 1)
        for name in ("samples", "messages"):
            with self.assertRaisesRegex(errors.InvalidArgument, f"no topic '/nosuch'.*{topic}"):
                getattr(read, name)(topics={"/nosuch"})

    def test_files_that_cannot_be_created_or_read_have_a_hint(self):
        with self.assertRaises(errors.Unwritable) as raised:
            recording.Writer(self.path + "/none/a.mcap")
        self.assertIn("Create the folder", raised.exception.hint)
        pathlib.Path(self.path).touch()
        with self.assertRaises(errors.Unreadable) as raised:
            recording.Recording(self.path)
        self.assertTrue(raised.exception.hint)
        os.remove(self.path)
        writer = recording.Writer(self.path)
        writer.close()
        with self.assertRaisesRegex(ValueError, "a.mcap' is closed"):
            writer.add(samples.Odometry())

    def test_a_full_disk_is_raised_once(self):
        script = ("import resource, signal, sys\nfrom waymark import errors, recording, samples\nsignal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
                  "resource.setrlimit(resource.RLIMIT_FSIZE, (100000, resource.RLIM_INFINITY))\n"
                  "try:\n    with recording.Writer(sys.argv[1]) as writer:\n        for i in range(100000): writer.add(samples.Odometry(stamp_ns=i))\n"
                  "except errors.Unwritable as error: print(error.__context__, error)")
        run = subprocess.run([sys.executable, "-c", script, self.path], capture_output=True, text=True, check=True)
        self.assertTrue(run.stdout.startswith("None"), run.stdout)
        self.assertIn("Free some space", run.stdout)

    def test_a_deleted_writer_finishes_its_file_and_warns(self):
        writer = recording.Writer(self.path)
        for stamp in range(10):
            writer.add(samples.Odometry(stamp_ns=stamp))
        with self.assertWarnsRegex(ResourceWarning, "a.mcap' was not closed"):
            del writer
            gc.collect()
        read = recording.Recording(self.path)
        self.assertEqual((len(list(read)), read.summary["complete"]), (10, True))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with recording.Writer(self.path + "2") as closed:
                closed.add(samples.Odometry())
            del closed
            gc.collect()

    def test_a_child_cannot_write_into_the_file_of_its_parent(self):
        writer = recording.Writer(self.path)
        writer.add(samples.Odometry(stamp_ns=1))
        child = os.fork()
        if child == 0:
            code = 1
            try:
                writer.add(samples.Odometry(stamp_ns=2))
            except RuntimeError as error:
                code = 0 if "fork" in str(error) else 2
            finally:
                writer.close()
                os._exit(code)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        writer.add(samples.Odometry(stamp_ns=3))
        writer.close()
        read = recording.Recording(self.path)
        self.assertEqual([sample.stamp_ns for sample in read], [1, 3])
        self.assertTrue(read.summary["complete"])


if __name__ == "__main__":
    unittest.main()
