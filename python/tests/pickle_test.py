#!/usr/bin/python3
"""Values come back from pickle and copy as they were, by every protocol; what holds a file or a robot is refused, and so are damaged states.

usage: pickle_test.py     (PYTHONPATH names the package)
"""
import copy
import os
import pathlib
import pickle
import tempfile
import unittest

import numpy as np

from waymark import camera, config, errors, geometry, localization, mapping, pose, recording, replay, samples, simulation


class Pickles(unittest.TestCase):
    def again(self, value):
        by_protocol = [pickle.loads(pickle.dumps(value, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)]
        for copied in (*by_protocol, copy.deepcopy(value)):
            self.assertEqual(copied, value)
            self.assertIsNot(copied, value)

    def test_geometry_cameras_and_samples_round_trip(self):
        for value in (geometry.SO2(0.3), geometry.SO3.from_rpy(0.1, 0.2, 0.3), geometry.SE2(1, 2, 3), geometry.SE3.exp([1, 2, 3, 0.1, 0.2, 0.3]),
                      geometry.SE23(), camera.pinhole(320, 240, 300, 300, 160, 120), samples.Odometry(stamp_ns=3, speed_m_s=0.5),
                      samples.TagDetection(tag=3, corners_px=np.arange(8.0).reshape(4, 2)), samples.TagDetection(corner_state="unreliable"), samples.MappedTag(size_m=0.2)):
            self.again(value)

    def test_maps_routes_and_results_round_trip(self):
        world, robot = config.read_world("circuit24"), config.read_robot("limo")
        self.again(world.tags)
        self.again(samples.TagMap())
        fewer = copy.deepcopy(world.tags)
        del fewer[next(iter(fewer))]
        self.assertNotEqual(fewer, world.tags)
        lens = camera.pinhole(640, 480, 500, 500, 320, 240)
        corners = samples.visible_corners(lens, geometry.SE3(geometry.SO3.from_rpy(0, 0.4, 0), [0.1, 0.9, 3.2]), 0.16)
        both = pose.estimate_tag_pose(samples.TagDetection(tag=0, corners_px=corners), 0.16, lens)
        self.assertIsNotNone(both.other)
        for value in (both, both.best, both.other):
            self.again(value)
        self.assertNotEqual(both.best, both.other)
        lap = simulation.scripted_lap(world, robot, seed=1)[:3000]
        run = localization.localize(lap, world.tags, robot)
        self.assertGreater(len(run), 10)
        self.again(run)
        self.assertNotEqual(localization.localize(lap[:2000], world.tags, robot), run)
        localizer = localization.Localizer(world.tags, robot)
        localizer.add_all(lap)
        self.again(localizer.estimate())

    def test_worlds_and_robots_round_trip(self):
        for name in ("circuit24", "limo-walls", "academy-house"):
            world = config.read_world(name)
            self.again(world)
            other = copy.deepcopy(world)
            other.tags = samples.TagMap()
            self.assertNotEqual(other, world)
        limo, mbot, two = (config.read_robot(name) for name in ("limo", "mbot", "limo-front-rear"))
        for robot in (limo, mbot, two):
            self.again(robot)
        self.assertNotEqual(limo, mbot)
        moved = copy.copy(limo)
        moved.base_T_cam = geometry.SE3.exp([0, 0, 1e-15, 0, 0, 0]) @ limo.base_T_cam
        self.assertNotEqual(moved, limo)
        self.again(moved)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "robot.yaml"
            path.write_text(limo.to_yaml() + "commissioned: {passed: true, date: 2026-11-23, version: 1.0.0, robot: limo, failed: [yaw_sign], "
                            "limits: {speed_m_s: 0.5, yaw_rate_rad_s: 1, acceleration_m_s2: 1, yaw_acceleration_rad_s2: 2}, "
                            "wheels: {radius_m: 0.045, track_m: 0.172}, figures: {response_s: 0.2, stopping_m: 0.04}}\n")
            commissioned = config.read_robot(str(path))
            self.again(commissioned)
            self.assertNotEqual(commissioned, config.read_robot("limo"))
            path.write_text(limo.to_yaml().replace("watchdog_s: 0.25", "watchdog_s: 0.5"))
            self.assertNotEqual(config.read_robot(str(path)), limo)

    def test_a_lap_of_a_pickled_world_is_the_same(self):
        world, robot = config.read_world("limo-walls"), config.read_robot("limo")
        lap = simulation.scripted_lap(world, robot, seed=3)
        again = simulation.scripted_lap(pickle.loads(pickle.dumps(world)), pickle.loads(pickle.dumps(robot)), seed=3)
        self.assertEqual(again, lap)

    def test_poses_of_several_tags_round_trip(self):
        lens = camera.pinhole(640, 480, 500, 500, 320, 240)
        tags_there = samples.TagMap()
        seen = []
        for number in range(3):
            cam_T_tag = geometry.SE3(geometry.SO3.from_rpy(0, 0.3, 0), [0.4 * number - 0.4, 0, 2])
            tags_there[number] = samples.MappedTag(map_T_tag=cam_T_tag, size_m=0.16)
            seen.append(samples.TagDetection(tag=number, corners_px=samples.visible_corners(lens, cam_T_tag, 0.16)))
        seen.append(samples.TagDetection(tag=9, corners_px=seen[0].corners_px + 40))
        found = pose.estimate_camera_pose(seen, tags_there, lens)
        self.assertEqual(len(found.rejected), 1)
        self.again(found)
        self.assertNotEqual(pose.estimate_camera_pose(seen[:2], tags_there, lens), found)

    def test_what_holds_a_file_or_a_robot_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.mcap")
            with recording.Writer(path) as writer:
                writer.add(samples.Odometry())
            log = recording.Recording(path)
            world, robot = config.read_world("circuit24"), config.read_robot("limo")
            held = [(writer, "open file"), (log, "path"), (log.samples(), "open the recording again"),
                    (localization.Localizer(world.tags, robot), r"estimate\(\)"), (simulation.Simulator(world, robot), "seed")]
            for value, word in held:
                for call in (pickle.dumps, copy.copy, copy.deepcopy):
                    with self.assertRaisesRegex(TypeError, f"{type(value).__name__} can be neither pickled nor copied.*{word}"):
                        call(value)

    def test_damaged_states_are_refused(self):
        for kind in (samples.TagMap, samples.Route, pose.TagPose, localization.LocalizationEstimate, config.World, config.RobotDescription,
                     pose.MultiTagPose, replay.ReplayStep, mapping.MapReport):
            for state in ((), (1,), ([("nothing", 3)], 0, [0, 0, 1], None), "text"):
                with self.assertRaises(Exception, msg=f"{kind} {state}") as raised:
                    kind.__new__(kind).__setstate__(state)
                self.assertIsInstance(raised.exception, (TypeError, ValueError, IndexError, RuntimeError, errors.WaymarkError))


if __name__ == "__main__":
    unittest.main()
