#!/usr/bin/python3
"""Memory that Python and the library share: views outlive what gave them, buffers end where they end, threads and forks keep apart.

usage: lifetime_test.py     (PYTHONPATH names the package). Most effective under the address sanitizer (preset asan-python).
"""
import gc
import os
import pathlib
import pickle
import tempfile
import threading
import unittest

import numpy as np

from waymark import camera, config, errors, geometry, image, localization, pose, recording, samples, simulation, tags

LENS = camera.pinhole(320, 240, 300, 300, 160, 120)
SEEN = [(5, geometry.SE3(geometry.SO3.from_rpy(0, 0.2, 0.1), [0.05, 0, 0.8]), 0.2)]


def photograph():
    return simulation.photograph(LENS, SEEN, seed=1)[0]


class Views(unittest.TestCase):
    def test_corners_outlive_their_detection(self):
        detection = samples.TagDetection(tag=7, corners_px=np.arange(8.0).reshape(4, 2))
        corners = detection.corners_px
        del detection
        gc.collect()
        corners += 1
        self.assertEqual(corners.tolist(), (np.arange(8.0) + 1).reshape(4, 2).tolist())

    def test_corners_outlive_a_deleted_list(self):
        kept = [detection.corners_px for detection in tags.Detector().detect(photograph())]
        gc.collect()
        self.assertEqual(len(kept), 1)
        self.assertTrue(np.isfinite(kept[0]).all())

    def test_images_outlive_their_frame(self):
        taken = samples.CameraFrame(1, photograph())
        photo = taken.image
        part = photo[10:20, 30:40]
        del taken, photo
        gc.collect()
        self.assertEqual(part.tolist(), photograph()[10:20, 30:40].tolist())

    def test_images_of_a_file_own_their_memory(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.png")
            image.write(path, photograph())
            images = [image.read(path) for _ in range(20)]
        gc.collect()
        for photo in images:
            self.assertEqual(photo.shape, (240, 320))
        self.assertTrue((images[0] == images[-1]).all())

    def test_parts_outlive_the_whole(self):
        world = config.read_world("circuit24")
        tag_map, line = world.tags, world.path_m
        tag = tag_map[next(iter(tag_map))]
        corners = samples.visible_corners(LENS, geometry.SE3(geometry.SO3(), [0, 0, 1]), 0.2)
        best = pose.estimate_tag_pose(samples.TagDetection(tag=5, corners_px=corners), 0.2, LENS).best
        del world, tag_map
        gc.collect()
        self.assertGreater(tag.size_m, 0)
        self.assertEqual(line.shape[1], 2)
        self.assertAlmostEqual(best.cam_T_tag.translation[2], 1, places=6)

    def test_iterators_outlive_their_recording(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.mcap")
            with recording.Writer(path) as writer:
                for i in range(200):
                    writer.add(samples.Odometry(stamp_ns=i))
            del writer
            iterator = recording.Recording(path).samples()
            gc.collect()
            self.assertEqual(len(list(iterator)), 200)


class Buffers(unittest.TestCase):
    """Images that lie at the very end of their memory."""

    def test_rows_with_gaps_up_to_the_last_byte(self):
        photo = photograph()
        expected = tags.Detector().detect(photo)
        for gap in (0, 1, 7, 64):
            height, width = photo.shape
            memory = np.empty((height - 1) * (width + gap) + width, np.uint8)
            rows = np.lib.stride_tricks.as_strided(memory, photo.shape, (width + gap, 1))
            rows[:] = photo
            for detector in (tags.Detector(), tags.Detector(refine=False), tags.Detector(detector="apriltag3")):
                found = detector.detect(rows)
                self.assertEqual([tag.tag for tag in found], ["tag36h11:5"])
            self.assertEqual(tags.Detector().detect(rows), expected)

    def test_small_images_up_to_the_last_byte(self):
        random = np.random.default_rng(1)
        detectors = (tags.Detector(), *(tags.Detector(detector="apriltag3", quad_decimate=by) for by in (1, 4)))
        for height in (1, 2, 3, 5, 8, 9, 17, 31):
            for width in (1, 2, 3, 5, 8, 9, 17, 31, 65):
                photo = random.integers(0, 256, (height, width), np.uint8)
                for detector in detectors:
                    detector.detect(photo)
                self.assertEqual(samples.CameraFrame(0, photo).image.tolist(), photo.tolist())

    def test_a_tag_that_touches_the_edge(self):
        lens = camera.pinhole(64, 48, 60, 60, 32, 24)
        for x in (-0.4, -0.2, 0, 0.2, 0.4):
            photo = simulation.photograph(lens, [(5, geometry.SE3(geometry.SO3(), [x, 0, 0.5]), 0.3)], seed=1)[0]
            for detector in ("waymark", "apriltag3"):
                for found in tags.Detector(detector=detector).detect(photo.copy()):
                    self.assertTrue(np.isfinite(found.corners_px).all())

    def test_read_only_and_foreign_memory(self):
        photo = photograph()
        expected = tags.Detector().detect(photo)
        fixed = np.frombuffer(photo.tobytes(), np.uint8).reshape(photo.shape)
        self.assertFalse(fixed.flags.writeable)
        self.assertEqual(tags.Detector().detect(fixed), expected)
        self.assertEqual(tags.Detector().detect(np.frombuffer(memoryview(bytearray(photo.tobytes())), np.uint8).reshape(photo.shape)), expected)

    def test_points_without_copies(self):
        points = np.frombuffer(np.array([[0.0, 0, 1], [0.1, 0, 1]]).tobytes())
        self.assertEqual(LENS.project(points.reshape(2, 3)).tolist(), [[160, 120], [190, 120]])
        self.assertEqual(LENS.project(points[:3]).tolist(), [160, 120])
        with self.assertRaises(errors.InvalidArgument):
            LENS.project(points[:5])


class Threads(unittest.TestCase):
    def in_threads(self, *calls):
        raised = []

        def guarded(call):
            try:
                call()
            except Exception as error:  # pylint: disable=broad-except
                raised.append(error)

        threads = [threading.Thread(target=guarded, args=(call,)) for call in calls]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(raised, [])

    def test_an_image_that_is_deleted_during_detection(self):
        detector = tags.Detector()

        def search():
            for _ in range(5):
                detector.detect(photograph())
                gc.collect()

        self.in_threads(search, search, search)

    def test_an_image_that_changes_during_detection(self):
        photo, busy = photograph(), [True]
        random = np.random.default_rng(1)

        def change():
            while busy[0]:
                photo[:] = random.integers(0, 256, photo.shape, np.uint8)
                photo[:] = photograph()

        def search():
            try:
                for keywords in ({}, {"detector": "apriltag3"}, {"refine": False}):
                    for _ in range(5):
                        tags.Detector(**keywords).detect(photo)
            finally:
                busy[0] = False

        self.in_threads(change, search)

    def test_a_map_that_changes_during_use(self):
        corners = samples.visible_corners(LENS, SEEN[0][1], 0.2)
        seen, busy = [samples.TagDetection(tag=5, corners_px=corners)], [True]
        tag_map = samples.TagMap()
        tag_map[5] = samples.MappedTag(map_T_tag=SEEN[0][1], size_m=0.2)

        def change():
            while busy[0]:
                for number in range(6, 200):
                    tag_map[number] = samples.MappedTag(size_m=0.1)
                for number in range(6, 200):
                    del tag_map[number]

        def locate():
            try:
                for _ in range(300):
                    self.assertEqual(len(pose.estimate_camera_pose(seen, tag_map, LENS).rejected), 0)
            finally:
                busy[0] = False

        self.in_threads(change, locate)

    def test_one_simulator_in_four_threads(self):
        simulator = simulation.Simulator(config.read_world("circuit24"), config.read_robot("limo"))
        stamps = []

        def drive():
            for _ in range(200):
                simulator.command(0.2, 0.1)
                stamps.append(simulator.next().stamp_ns)
                self.assertGreaterEqual(simulator.now_ns, 0)
                self.assertTrue(np.isfinite(simulator.true_map_T_base.x))

        self.in_threads(drive, drive, drive, drive)
        self.assertEqual(len(stamps), 800)

    def test_values_are_pickled_while_others_are_made(self):
        world = config.read_world("circuit24")

        def copy_world():
            for _ in range(10):
                self.assertEqual(pickle.loads(pickle.dumps(world)), world)

        self.in_threads(copy_world, copy_world, lambda: simulation.scripted_lap(world, config.read_robot("limo"), seed=1))

    def test_one_iterator_in_two_threads(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.mcap")
            with recording.Writer(path) as writer:
                for i in range(2000):
                    writer.add(samples.Odometry(stamp_ns=i))
            iterator = recording.Recording(path).samples()
            counts = [0, 0]

            def take(which):
                counts[which] = sum(1 for _ in iterator)

            self.in_threads(lambda: take(0), lambda: take(1))
            self.assertEqual(sum(counts), 2000)

    def test_an_iterator_that_is_closed_by_another_thread(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.mcap")
            with recording.Writer(path) as writer:
                for i in range(5000):
                    writer.add(samples.Odometry(stamp_ns=i))
            iterator = recording.Recording(path).samples()

            def take():
                try:
                    for _ in iterator:
                        pass
                except ValueError as error:
                    self.assertIn("closed", str(error))

            self.in_threads(take, iterator.close)


class Forks(unittest.TestCase):
    def in_child(self, call):
        child = os.fork()
        if child == 0:
            code = 1
            try:
                call()
                code = 0
            finally:
                os._exit(code)
        self.assertEqual(os.waitpid(child, 0)[1], 0)

    def test_a_child_works_on_what_its_parent_made(self):
        detector, photo = tags.Detector(), photograph()
        expected = detector.detect(photo)
        world, robot = config.read_world("circuit24"), config.read_robot("limo")
        localizer = localization.Localizer(world.tags, robot)

        def child():
            assert detector.detect(photo) == expected
            localizer.add_all(simulation.scripted_lap(world, robot, seed=1)[:500])
            assert pickle.loads(pickle.dumps(world)) == world

        self.in_child(child)
        self.assertEqual(detector.detect(photo), expected)

    def test_a_writer_in_parent_and_child(self):
        """The child closes its copy; the parent's file is whole afterwards."""
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.mcap"
            simulator = simulation.Simulator(config.read_world("circuit24"), config.read_robot("limo"))
            self.in_child(lambda: simulator.advance(1))
            with recording.Writer(str(path)) as writer:
                for sample in simulator.advance(1):
                    writer.add(sample)
            self.assertTrue(recording.Recording(str(path)).summary["complete"])


if __name__ == "__main__":
    unittest.main()
