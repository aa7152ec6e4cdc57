#!/usr/bin/python3
"""What the Python package computes is what the program computes, to the last bit; values round-trip.

usage: rooms_test.py PROGRAM     (PYTHONPATH names the package)
"""
import copy
import json
import math
import pathlib
import pickle
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import waymark
from waymark import camera, config, evaluation, families, geometry, image, localization, mapping, pose, recording, samples, simulation, tags

PROGRAM = sys.argv.pop(1)


def program(*arguments, cwd=None):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{arguments}: {done.stderr}")
    return done.stdout


def tag_before_camera(distance_m=1.5, turn_rad=0.5):
    turn = geometry.SO3.from_rpy(0, turn_rad, 0)
    return geometry.SE3(turn, [0.1, -0.05, distance_m])


LENS = camera.pinhole(640, 480, 500, 501, 320.5, 240.5, [-0.1, 0.02, 1e-4, -2e-4])


class Geometry(unittest.TestCase):
    def test_groups_keep_their_laws(self):
        random = np.random.default_rng(1)
        for group, size in ((geometry.SO2, 1), (geometry.SE2, 3), (geometry.SO3, 3), (geometry.SE3, 6), (geometry.SE23, 9)):
            xi = random.normal(scale=0.5, size=size)
            X = group.exp(xi)
            np.testing.assert_allclose(X.log(), xi, atol=1e-12)
            np.testing.assert_allclose((X @ X.inverse()).matrix(), np.eye(len(X.matrix())), atol=1e-15)
            np.testing.assert_allclose(group.vee(group.hat(xi)), xi, atol=1e-15)
            moved = (X @ group.exp(xi) @ X.inverse()).log()
            np.testing.assert_allclose(group.exp(X.adjoint() @ xi).log(), moved, atol=1e-12)
            self.assertEqual(pickle.loads(pickle.dumps(X)), X)

    def test_agrees_with_numpy(self):
        X = geometry.SE3.exp([0.3, -0.2, 0.5, 0.4, -0.7, 0.2])
        points = np.random.default_rng(2).normal(size=(7, 3))
        expected = points @ X.matrix()[:3, :3].T + X.matrix()[:3, 3]
        np.testing.assert_allclose(X @ points, expected, atol=1e-14)
        np.testing.assert_allclose(X @ points[0], expected[0], atol=1e-14)
        np.testing.assert_allclose(np.asarray(X), X.matrix())


class Cameras(unittest.TestCase):
    def test_projects_one_and_many(self):
        points = np.array([[0.1, 0.2, 1.0], [0, 0, 2.0], [0, 0, -1.0]])
        px = LENS.project(points)
        np.testing.assert_array_equal(px[0], LENS.project(points[0]))
        np.testing.assert_array_equal(px[1], [320.5, 240.5])
        self.assertTrue(np.isnan(px[2]).all())
        bearings = LENS.unproject(px[:2])
        np.testing.assert_allclose(bearings[0], points[0] / np.linalg.norm(points[0]), atol=1e-12)

    def test_half_a_pixel_and_pickle(self):
        self.assertIn("320.0", LENS.to_yaml())  # centres at integers in files of ROS
        again = pickle.loads(pickle.dumps(LENS))
        self.assertEqual(again, LENS)
        np.testing.assert_array_equal(again.intrinsics, LENS.intrinsics)
        with self.assertRaises(AttributeError):
            LENS.width_px = 3


class Families(unittest.TestCase):
    def test_distances(self):
        family = families.family("tag16h5")
        self.assertEqual(len(family["codes"]), 30)
        self.assertEqual(families.minimum_distance("tag16h5"), 5)
        code = int(family["codes"][3])
        self.assertEqual(families.turned("tag16h5", code, 4), code)
        self.assertEqual(families.min_rotational_distance("tag16h5", code, families.turned("tag16h5", code, 1)), 0)
        self.assertEqual(families.bitmap("tag36h11:7").shape, (10, 10))


class Tags(unittest.TestCase):
    """The detector through Python, and through the program."""

    @classmethod
    def setUpClass(cls):
        cls.truth = tag_before_camera()
        cls.image, cls.truths = simulation.photograph(LENS, [("tag36h11:7", cls.truth, 0.3), (9, tag_before_camera(2.5, -0.3), 0.2)], seed=3)
        cls.found = tags.Detector().detect(cls.image, LENS)

    def test_same_bits_as_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "image.png"
            image.write(path, self.image)
            np.testing.assert_array_equal(image.read(path), self.image)
            line = json.loads(program("detect", path, "--json").splitlines()[0])
            plain = tags.Detector().detect(self.image)
        self.assertEqual(len(line["detections"]), len(plain))
        for theirs, ours in zip(line["detections"], plain):
            self.assertEqual(theirs["id"], ours.id)
            np.testing.assert_array_equal(theirs["corners_px"], np.round(ours.corners_px, 6))  # as many decimals as it prints

    def test_rows_may_have_gaps_and_nothing_is_copied(self):
        wide = np.zeros((480, 700), np.uint8)
        wide[:, 20:660] = self.image
        view = wide[:, 20:660]
        view.flags.writeable = False
        self.assertEqual(tags.Detector().detect(view, LENS), self.found)

    def test_pose_is_near_the_truth(self):
        seven = next(d for d in self.found if d.id == 7)
        both = pose.estimate_tag_pose(seven, 0.3, LENS)
        error = (both.best.cam_T_tag @ self.truth.inverse()).log()
        self.assertLess(np.linalg.norm(error[:3]), 0.03)
        self.assertEqual(both.best.covariance.shape, (6, 6))
        np.testing.assert_allclose(seven.corners_px, self.truths[0]["corners_px"], atol=0.3)

    def test_corners_are_the_detections_own_memory(self):
        detection = copy.copy(self.found[0])
        corners = detection.corners_px
        corners[0, 0] = 12.5
        self.assertEqual(detection.corners_px[0, 0], 12.5)
        self.assertNotEqual(detection, self.found[0])
        del detection
        self.assertEqual(corners[0, 0], 12.5)

    def test_detector_pickles_by_its_options(self):
        other = pickle.loads(pickle.dumps(tags.Detector(max_hamming=0, refine=False)))
        self.assertIsNone(other.detect(self.image)[0].corner_covariance_px2)


class Images(unittest.TestCase):
    def test_sample_values(self):
        frame = samples.CameraFrame(stamp_ns=5, image=np.arange(12, dtype=np.uint8).reshape(3, 4))
        again = pickle.loads(pickle.dumps(frame))
        self.assertEqual(again, frame)
        self.assertEqual(again.image[2, 3], 11)
        odometry = samples.Odometry(stamp_ns=7, odom_T_base=geometry.SE2(1, 2, 0.5), speed_m_s=0.25)
        self.assertEqual(pickle.loads(pickle.dumps(odometry)), odometry)
        self.assertIn("speed_m_s=0.25", repr(odometry))
        scan = samples.LaserScan(stamp_ns=1, ranges_m=[1.0, math.inf])
        self.assertEqual(scan.ranges_m.dtype, np.float32)
        self.assertEqual(copy.deepcopy(scan), scan)


class Loop(unittest.TestCase):
    """Record, map, localise and judge a lap: as the program does it."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        path = pathlib.Path(cls.folder.name)
        cls.lap, cls.map = path / "lap.mcap", path / "map"
        program("teach", "--world", "circuit24", "--seed", 1, "-o", cls.lap)
        cls.steps = []
        cls.report = mapping.map_recording(str(cls.lap), str(cls.map), progress=lambda *now: cls.steps.append(now))
        program("map", cls.lap, "-o", path / "map_of_program")

    def test_map_is_the_programs(self):
        theirs = (pathlib.Path(self.folder.name) / "map_of_program" / "map.yaml").read_text()
        self.assertEqual((self.map / "map.yaml").read_text(), theirs)
        self.assertTrue(self.steps)
        self.assertLess(evaluation.map_errors(self.report.map, self.report.true_map)["rmse_m"], 0.02)
        self.assertEqual(len(config.read_map(self.map / "map.yaml")), 24)
        self.assertEqual(len(self.report.route), len(config.read_route(self.map / "route.yaml")))

    def test_report_has_the_keys_of_the_summary(self):
        summary = json.loads((self.map / "summary.json").read_text())
        self.assertEqual(self.report.summary, summary)
        self.assertEqual(list(self.report.summary), list(summary))
        for key, value in summary.items():
            self.assertEqual(getattr(self.report, key), value, key)
        self.assertIsNone(self.report.prior_rms_m)
        self.assertIn("root mean square", mapping.MapReport.tag_rmse_m.__doc__)

    def test_simulated_lap_is_the_programs(self):
        world, robot = config.read_world("circuit24"), config.read_robot("limo")
        ours = [s for s in simulation.scripted_lap(world, robot, seed=1) if isinstance(s, samples.Odometry)]
        theirs = list(recording.Recording(str(self.lap)).samples(topics={"/odom"}))
        self.assertEqual(len(ours), len(theirs))
        for a, b in zip(ours[:200], theirs[:200]):
            self.assertEqual((a.stamp_ns, a.odom_T_base.x), (b.stamp_ns, b.odom_T_base.x))

    def test_localised_as_by_the_program(self):
        estimate = localization.localize_recording(str(self.lap), str(self.map))
        tum = pathlib.Path(self.folder.name) / "estimate.tum"
        program("localize", self.lap, "--map", self.map, "-o", tum)
        theirs = config.read_trajectory(tum)
        ours = {int(stamp): row for stamp, row in zip(estimate.stamps_ns, estimate.xy_yaw)}
        shared = [(ours[int(stamp)], row) for stamp, row in zip(theirs.stamps_ns, theirs.xy_yaw) if int(stamp) in ours]
        self.assertGreater(len(shared), 100)
        self.assertGreater(len(estimate), 100)
        scores = evaluation.score_trajectory(estimate, self.report.true_trajectory)
        self.assertLess(scores["ate_m"]["rmse"], 0.02)
        self.assertEqual(pickle.loads(pickle.dumps(estimate)).xy_yaw.tolist(), estimate.xy_yaw.tolist())

    def test_filter_over_samples_is_that_of_the_recording(self):
        robot, tags = config.read_robot(str(self.map / "robot.yaml")), config.read_map(str(self.map / "map.yaml"))
        for method in ("riekf", "smoother"):
            ours = localization.localize(recording.Recording(str(self.lap)), tags, robot, method=method)
            theirs = localization.localize_recording(str(self.lap), str(self.map), method=method)
            self.assertEqual(ours.stamps_ns.tolist(), theirs.stamps_ns.tolist())
            self.assertEqual(ours.xy_yaw.tolist(), theirs.xy_yaw.tolist())
        self.assertEqual(len(localization.localize([], tags, robot)), 0)
        for refused in (lambda: localization.localize([samples.Odometry(), "words"], tags, robot), lambda: localization.Localizer(tags, robot).add_all([1])):
            with self.assertRaisesRegex(TypeError, "is not a sample"):
                refused()
        with self.assertRaises(ZeroDivisionError):
            localization.localize((1 / 0 for _ in range(2)), tags, robot)

    def test_filter_step_by_step(self):
        robot = config.read_robot("limo")
        localizer = localization.Localizer(self.report.map, robot)
        self.assertIsNone(localizer.estimate())
        localizer.add_all(recording.Recording(str(self.lap)))
        self.assertTrue(localizer.estimate().certain)
        self.assertLess(localizer.estimate().position_sigma_m, 0.05)

    def test_written_recording_reads_back(self):
        path = pathlib.Path(self.folder.name) / "copy.mcap"
        originals = [s for s in recording.Recording(str(self.lap)).samples() if isinstance(s, (samples.Odometry, samples.TagFrame))][:300]
        with recording.Writer(str(path)) as writer:
            for sample in originals:
                writer.add(sample)
        again = list(recording.Recording(str(path)))
        self.assertEqual(len(again), len(originals))
        for a, b in zip(again, originals):
            if isinstance(b, samples.Odometry):  # a message has a quaternion where we have a yaw
                np.testing.assert_allclose(a.odom_T_base.log(), b.odom_T_base.log(), atol=1e-14)
                a.odom_T_base = b.odom_T_base
            self.assertEqual(a, b)
        info = recording.Recording(str(path))
        self.assertTrue(info.summary["complete"])
        self.assertEqual(info.summary["format"], "mcap")
        raw = list(info.messages(topics={"/odom"}))
        self.assertEqual(raw[0][1], "nav_msgs/msg/Odometry")

    def test_frames_of_pandas(self):
        from waymark import frames  # reads with pandas (Debian: python3-pandas)

        table = frames.read(str(self.lap))
        self.assertEqual(set(table) & {"odometry", "tags", "imu", "truth"}, {"odometry", "tags", "imu", "truth"})
        first = next(iter(recording.Recording(str(self.lap)).samples(topics={"/odom"})))
        self.assertEqual(table["odometry"].x_m.iloc[0], first.odom_T_base.x)


class Speed(unittest.TestCase):
    def test_import_loads_neither_numpy_nor_pandas(self):
        code = "import sys, waymark; print('numpy' in sys.modules, 'pandas' in sys.modules)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        self.assertEqual(done.stdout.split(), ["False", "False"])

    def test_help_names_options_with_their_units(self):
        self.assertIn("quad_decimate", tags.Detector.__init__.__doc__)
        self.assertIn("corner_sigma_px", localization.Localizer.__init__.__doc__)
        self.assertTrue(waymark.__doc__.startswith("Waymark"))


if __name__ == "__main__":
    unittest.main()
