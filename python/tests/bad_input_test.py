#!/usr/bin/python3
"""Bad input gives clear exceptions and never a crash: arrays, options, closed objects, callbacks, threads, fork.

usage: bad_input_test.py     (PYTHONPATH names the package)
"""
import copy
import os
import pathlib
import pickle
import tempfile
import threading
import unittest

import numpy as np

from waymark import camera, config, errors, families, geometry, localization, mapping, pose, recording, replay, samples, simulation, tags

LENS = camera.pinhole(320, 240, 300, 300, 160, 120)

WORLD, LIMO = config.read_world("circuit24"), config.read_robot("limo")
ANCHORED = {"anchor": 0, "map_T_anchor": WORLD.tags[0].map_T_tag, "tag_size_m": 0.16}


def record_lap(path):
    """A lap that a script drives, as a recording of a robot."""
    lap = simulation.scripted_lap(WORLD, LIMO, seed=1)
    with recording.Writer(path) as writer:
        writer.add_attachment("robot.yaml", "application/yaml", LIMO.to_yaml())
        writer.add_camera(lap[0].stamp_ns, LIMO.camera, LIMO.base_T_cam)
        for sample in lap:
            writer.add(sample)


class Arrays(unittest.TestCase):
    def refused(self, image, *words):
        with self.assertRaises(errors.InvalidArgument) as raised:
            tags.Detector().detect(image)
        self.assertEqual(raised.exception.key, "image")
        for word in words:
            self.assertIn(word, str(raised.exception))

    def test_invalid_images(self):
        grey = np.zeros((40, 60), np.uint8)
        self.refused(grey.astype(float), "float64", "uint8")
        self.refused(np.zeros((40, 60, 3), np.uint8), "(40, 60, 3)", "grey")
        self.refused(grey[:, ::2], "ascontiguousarray")
        self.refused(grey[::-1], "ascontiguousarray")
        self.refused(np.broadcast_to(grey[0], (40, 60)), "ascontiguousarray")
        self.refused(grey.T, "ascontiguousarray")
        self.refused([[0, 1], [2, 3]], "list")
        self.refused(None, "NoneType")
        self.refused(np.array("text"), "uint8")

    def test_empty_and_tiny_images_contain_no_tag(self):
        for shape in ((0, 0), (0, 5), (1, 1), (3, 2), (1, 1000)):
            self.assertEqual(tags.Detector().detect(np.zeros(shape, np.uint8)), [])

    def test_invalid_numbers(self):
        for matrix, word in ((np.full((4, 4), np.nan), "not finite"), (np.eye(3), "(3, 3)"), (np.eye(4) * 2, ""),
                             (np.eye(4, dtype=complex), "complex"), ("text", ""), (np.array([object()] * 16).reshape(4, 4), "object"),
                             (np.diag([1.0, 1, -1, 1]), "")):
            with self.assertRaises(errors.InvalidArgument) as raised:
                geometry.SE3.from_matrix(matrix)
            self.assertIn(word, str(raised.exception))
        with self.assertRaises(errors.InvalidArgument):
            geometry.SE3.exp([1, 2, 3])
        with self.assertRaises(errors.InvalidArgument):
            LENS.project(np.zeros((2, 2)))
        self.assertTrue(np.isnan(LENS.project([np.nan, 0, 1])).all())
        self.assertEqual(LENS.project(np.zeros((0, 3))).shape, (0, 2))
        self.assertEqual(LENS.project(np.array([[0, 0, 1]], dtype=np.int32)).tolist(), [[160, 120]])
        with self.assertRaises(TypeError):
            geometry.SE2("x", 0, 0)

    def test_corners_of_a_detection(self):
        detection = samples.TagDetection(tag=7)
        with self.assertRaises(errors.InvalidArgument):
            detection.corners_px = np.full((4, 2), np.inf)
        with self.assertRaises(errors.InvalidArgument):
            detection.corners_px = np.zeros(8)

    def test_state_of_corners(self):
        detection = samples.TagDetection(tag=7)
        self.assertEqual(detection.corner_state, "measured")
        detection.corner_state = "unreliable"
        with self.assertRaisesRegex(errors.InvalidArgument, "unknown state 'good'"):
            detection.corner_state = "good"
        self.assertEqual(detection.corner_state, "unreliable")
        detection.corners_px = np.array([[100, 60], [200, 60], [200, 160], [100, 160]])
        with self.assertRaisesRegex(errors.InvalidArgument, "unreliable"):
            pose.estimate_tag_pose(detection, 0.2, LENS)


class Groups(unittest.TestCase):
    def test_non_finite_numbers_are_refused(self):
        for bad in (float("nan"), float("inf"), -float("inf")):
            for call, name in ((lambda: geometry.SO2(bad), "angle_rad"), (lambda: geometry.SE2(bad, 0, 0), "x"), (lambda: geometry.SE2(0, bad, 0), "y"),
                               (lambda: geometry.SE2(0, 0, bad), "yaw"), (lambda: geometry.SO3.from_rpy(bad, 0, 0), "roll"),
                               (lambda: geometry.SO3.from_rpy(0, bad, 0), "pitch"), (lambda: geometry.SO3.from_rpy(0, 0, bad), "yaw")):
                with self.assertRaisesRegex(errors.InvalidArgument, f"{name}.*not a finite number"):
                    call()

    def test_tangents_too_large_for_exp_are_refused(self):
        for kind, size in ((geometry.SO3, 3), (geometry.SE3, 6), (geometry.SE23, 9)):
            for large in (1e160, 1e200):
                with self.assertRaisesRegex(errors.InvalidArgument, "xi.*not finite"):
                    kind.exp([large] * size)
        self.assertTrue(np.isfinite(geometry.SO3.exp([1e100, 0, 0]).matrix()).all())

    def test_products_of_different_groups_are_refused(self):
        elements = [geometry.SO2(0.1), geometry.SO3(), geometry.SE2(1, 2, 3), geometry.SE3(), geometry.SE23()]
        for a in elements:
            for b in elements:
                if type(a) is type(b):
                    self.assertIsInstance(a @ b, type(a))
                    continue
                for call in (lambda: a @ b, lambda: a * b):
                    with self.assertRaises(TypeError):
                        call()
        with self.assertRaisesRegex(TypeError, r"SE3 and SE2 .*lift\(\)"):
            geometry.SE3() @ geometry.SE2(1, 2, 3)
        with self.assertRaisesRegex(TypeError, "SE3 and SE2"):
            geometry.SE3().act(geometry.SE2(1, 2, 3))


class Words(unittest.TestCase):
    def test_options(self):
        for keywords, key, word in (({"quad_decimat": 2}, "quad_decimat", "quad_decimate"), ({"quad_decimate": 99}, "quad_decimate", "[1, 8]"),
                                    ({"quad_decimate": float("nan")}, "quad_decimate", ""), ({"max_hamming": 1.5}, "max_hamming", ""),
                                    ({"families": "tag36h11"}, "families", "list"), ({"families": ["tag99"]}, "", "tag99"),
                                    ({"max_hamming": object()}, "max_hamming", "object"), ({"max_hamming": [[]]}, "max_hamming", ""),
                                    ({"refinement": 3}, "refinement", "dictionary"), ({"refinement": {"x": 1}}, "x", "")):
            with self.assertRaises(errors.InvalidArgument, msg=str(keywords)) as raised:
                tags.Detector(**keywords)
            self.assertIn(word, str(raised.exception))
            self.assertIn(key, raised.exception.key)
        with self.assertRaisesRegex(errors.InvalidArgument, "quad_decimate is an option of AprilTag 3"):
            tags.Detector(quad_decimate=2)
        tags.Detector(detector="apriltag3", max_hamming=np.int64(1), quad_decimate=np.float32(2), refine_edges=np.bool_(True), families=("tag36h11",))

    def test_unknown_attributes_and_tags(self):
        with self.assertRaises(TypeError) as raised:
            samples.Odometry(stamp=3)
        self.assertIn("stamp_ns", str(raised.exception))
        for tag in ("tag36h11:9999", "nothing", -1, 2**70, 1.5, None, True):
            with self.assertRaises(errors.InvalidArgument, msg=str(tag)):
                samples.TagDetection(tag=tag)
        for name in ("tag36h12", "36h12"):
            with self.assertRaises(errors.InvalidArgument, msg=name) as raised:
                families.family(name)
            self.assertIn("'tag36h11'", str(raised.exception))
        with self.assertRaises(KeyError):
            samples.TagMap()[3]

    def test_files(self):
        with self.assertRaises(errors.NotFound) as raised:
            recording.Recording("/nowhere.mcap")
        self.assertIn("/nowhere.mcap", str(raised.exception))
        self.assertIn("Check the path", raised.exception.hint)
        for device in ("/dev/zero", "/dev/null"):
            with self.assertRaisesRegex(errors.Unreadable, f"{device}: this is a device"):
                recording.Recording(device)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "camera.yaml"
            path.write_text("image_width: 3\nfolly: 1\n")
            with self.assertRaises(errors.WaymarkError) as raised:
                camera.read_camera(str(path))
            again = pickle.loads(pickle.dumps(raised.exception))
            self.assertEqual((again.source, again.line, again.message), (str(path), raised.exception.line, raised.exception.message))
            self.assertIsNotNone(again.line)
        with self.assertRaises(errors.NotFound) as raised:
            config.read_world("circuit25")
        self.assertIn("circuit24", str(raised.exception))


class Closed(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = os.path.join(self.folder.name, "a.mcap")
        with recording.Writer(self.path) as writer:
            for i in range(500):
                writer.add(samples.Odometry(stamp_ns=i * 20_000_000))
        self.writer = writer

    def test_use_after_close(self):
        self.writer.close()
        with self.assertRaisesRegex(ValueError, "closed"):
            self.writer.add(samples.Odometry())
        with self.assertRaises(errors.Unwritable):
            recording.Writer(self.path)
        iterator = recording.Recording(self.path).samples()
        next(iterator)
        iterator.close()
        iterator.close()
        with self.assertRaisesRegex(ValueError, "closed"):
            next(iterator)

    def test_iterators_that_are_not_closed(self):
        for _ in range(50):
            next(recording.Recording(self.path).samples())
        self.assertEqual(len(list(recording.Recording(self.path))), 500)

    def test_damaged_recording(self):
        data = pathlib.Path(self.path).read_bytes()
        cut = pathlib.Path(self.folder.name) / "cut.mcap"
        cut.write_bytes(data[: len(data) // 2])
        damaged = recording.Recording(str(cut))
        list(damaged)
        self.assertFalse(damaged.summary["complete"])
        self.assertTrue(damaged.problems)

    def test_data_skipped_by_an_iterator_is_reported(self):
        self.writer.close()
        data = bytearray(pathlib.Path(self.path).read_bytes())
        packing = next(name for name in (b"zstd", b"lz4") if name in data)
        data[data.index(packing) + 40] ^= 0xFF  # in a chunk
        changed = pathlib.Path(self.folder.name) / "changed.mcap"
        changed.write_bytes(data)
        damaged = recording.Recording(str(changed))
        opened = damaged.problems
        self.assertLess(len(list(damaged)), 500)
        self.assertGreater(len(damaged.problems), len(opened))
        self.assertIn("chunk", damaged.problems[-1])

    def test_fork(self):
        iterator = recording.Recording(self.path).samples()
        next(iterator)
        child = os.fork()
        if child == 0:
            code = 1
            try:
                next(iterator)
            except RuntimeError:
                code = 0 if len(list(recording.Recording(self.path))) == 500 else 2
            finally:
                os._exit(code)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.assertEqual(len(list(iterator)), 499)

    def test_wrong_samples(self):
        with recording.Writer(self.path + "2") as writer, self.assertRaises(TypeError):
            writer.add("odometry")

    def test_wrong_samples_of_a_filter(self):
        class Renamed(samples.Odometry):
            pass

        world, robot = config.read_world("circuit24"), config.read_robot("limo")
        for wrong in ("odometry", None, 3, samples.TagDetection(tag=1), object(), samples.Odometry):
            with self.assertRaises(TypeError, msg=str(wrong)):
                localization.localize([samples.Odometry(), wrong], world.tags, robot)
        for kind in (samples.Odometry, samples.TagFrame):
            with self.assertRaisesRegex(TypeError, "__init__"):
                localization.localize([kind.__new__(kind)], world.tags, robot)
        self.assertEqual(len(localization.localize([Renamed(stamp_ns=1), samples.StampedCommand(stamp_ns=2)], world.tags, robot)), 0)
        with self.assertRaises(ZeroDivisionError):
            localization.localize((1 / 0 for _ in range(3)), world.tags, robot)


class Threads(unittest.TestCase):
    def test_one_detector_in_four_threads(self):
        pose = geometry.SE3(geometry.SO3(), [0, 0, 1])
        image, _ = simulation.photograph(LENS, [(5, pose, 0.2)], seed=1)
        detector = tags.Detector()
        expected = detector.detect(image)
        self.assertEqual(len(expected), 1)
        results = []
        threads = [threading.Thread(target=lambda: results.extend(detector.detect(image) == expected for _ in range(10))) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results, [True] * 40)


class Robot:
    """One line of kinematics that sees the tags of the map."""

    def __init__(self, folder, wrong=None):
        self.robot = config.read_robot("limo")
        self.map = config.read_map(folder / "map.yaml")
        x, y, yaw = config.read_route(folder / "route.yaml").points[0, :3]
        self.at = geometry.SE2(x, y, yaw)
        self.commands = []
        self.wrong = wrong

    def step(self, speed_m_s, yaw_rate_rad_s, now_ns):
        self.commands.append((speed_m_s, yaw_rate_rad_s))
        if self.wrong is not None and len(self.commands) > 40:
            return self.wrong()
        self.at = self.at @ geometry.SE2.exp([0.05 * speed_m_s, 0, 0.05 * yaw_rate_rad_s])
        cam_T_map = (self.at.lift() @ self.robot.base_T_cam).inverse()
        seen = []
        for name in self.map:
            corners = samples.visible_corners(self.robot.camera, cam_T_map @ self.map[name].map_T_tag, self.map[name].size_m)
            if corners is not None:
                seen.append(samples.TagDetection(tag=name, corners_px=corners))
        return [samples.Odometry(stamp_ns=now_ns, odom_T_base=self.at, speed_m_s=speed_m_s, yaw_rate_rad_s=yaw_rate_rad_s),
                samples.TagFrame(stamp_ns=now_ns, detections=seen)]


class Callbacks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        path = pathlib.Path(cls.folder.name)
        cls.lap, cls.map = str(path / "lap.mcap"), path / "map"
        record_lap(cls.lap)
        mapping.map_recording(cls.lap, str(cls.map), **ANCHORED)

    def test_a_python_robot_repeats_the_lap(self):
        robot = Robot(self.map)
        states = set()
        end = replay.drive(str(self.map), robot, on_step=lambda now, step: states.add(step.state))
        self.assertTrue(end["finished"], end)
        self.assertGreater(end["driven_m"], 5)
        self.assertEqual(robot.commands[-1], (0, 0))
        self.assertIn("driving", states)

    def test_a_session_drives_once(self):
        session = replay.ReplaySession(str(self.map), follower={})
        for timeout_s in (-1, 0, float("nan")):
            with self.assertRaisesRegex(errors.InvalidArgument, "timeout_s"):
                session.drive(Robot(self.map), timeout_s=timeout_s)
            with self.assertRaisesRegex(errors.InvalidArgument, "timeout_s"):
                replay.drive(str(self.map), Robot(self.map), timeout_s=timeout_s)
        self.assertEqual(session.drive(Robot(self.map)), replay.drive(str(self.map), Robot(self.map)))
        with self.assertRaisesRegex(ValueError, "already been driven"):
            session.drive(Robot(self.map))
        with self.assertRaisesRegex(TypeError, "pickled"):
            pickle.dumps(session)
        with self.assertRaises(TypeError):
            replay.ReplaySession(str(self.map), folowwer={})

    def test_a_keyword_of_another_type_is_a_type_error_that_names_it(self):
        for name, value in (("tag_size_m", "0.16"), ("map_T_anchor", 3), ("method", 3)):
            with self.assertRaisesRegex(TypeError, f"{name} is an? .*, not {value!r}"):
                mapping.map_recording(self.lap, str(pathlib.Path(self.folder.name) / "typed"), **{name: value})

    def test_reports_and_steps_round_trip(self):
        report = mapping.map_recording(self.lap, str(pathlib.Path(self.folder.name) / "again"), **ANCHORED)
        for copied in (pickle.loads(pickle.dumps(report)), copy.deepcopy(report)):
            self.assertEqual(copied, report)
            self.assertEqual(copied.summary, report.summary)
            self.assertEqual(copied.trajectory, report.trajectory)
        steps = []
        replay.drive(str(self.map), Robot(self.map), on_step=lambda now, step: steps.append(step), timeout_s=5)
        self.assertGreater(len(steps), 20)
        for step in steps:
            self.assertEqual(pickle.loads(pickle.dumps(step)), step)
        self.assertNotEqual(steps[0], steps[-1])
        with self.assertRaises(TypeError):
            replay.ReplayStep.__new__(replay.ReplayStep).__setstate__((99, *steps[0].__getstate__()[1:]))

    def test_routes_round_trip(self):
        route = config.read_route(self.map / "route.yaml")
        again = pickle.loads(pickle.dumps(route))
        self.assertEqual(again, route)
        self.assertEqual(again.points.tolist(), route.points.tolist())

    def test_a_robot_that_raises(self):
        def raises():
            raise KeyError("encoder")

        robot = Robot(self.map, wrong=raises)
        with self.assertRaisesRegex(KeyError, "encoder"):
            replay.drive(str(self.map), robot)
        self.assertGreater(robot.commands[-2][0], 0)
        self.assertEqual(robot.commands[-1], (0, 0))
        for wrong in (lambda: 3, lambda: ["odometry"], lambda: None):
            robot = Robot(self.map, wrong=wrong)
            with self.assertRaises((TypeError, RuntimeError)):
                replay.drive(str(self.map), robot)
            self.assertEqual(robot.commands[-1], (0, 0))
        with self.assertRaises(TypeError):
            replay.drive(str(self.map), object())
        with self.assertRaises(TypeError):
            replay.drive(str(self.map), Robot(self.map), speed=3)
        for end in ({"on_step": lambda now, step: 1 / (len(robot.commands) < 60)}, {"timeout_s": 3}):
            robot = Robot(self.map)
            if "on_step" in end:
                with self.assertRaises(ZeroDivisionError):
                    replay.drive(str(self.map), robot, **end)
            else:
                self.assertTrue(replay.drive(str(self.map), robot, **end)["timed_out"])
            self.assertGreater(robot.commands[-2][0], 0)
            self.assertEqual(robot.commands[-1], (0, 0))

    def test_an_interrupted_job_leaves_no_files(self):
        folder = pathlib.Path(self.folder.name) / "other"

        def stop(words, done, count):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            mapping.map_recording(self.lap, str(folder), progress=stop, **ANCHORED)
        self.assertFalse((folder / "map.yaml").exists())

    def test_wrong_methods(self):
        with self.assertRaisesRegex(errors.InvalidArgument, "riekf"):
            localization.Localizer(config.read_map(self.map / "map.yaml"), config.read_robot("limo"), method="rieqf")
        with self.assertRaises(errors.InvalidArgument):
            localization.Localizer(samples.TagMap(), config.read_robot("limo"))


if __name__ == "__main__":
    unittest.main()
