#!/usr/bin/python3
"""`waymark calibrate guided` with a hand-held board: a live camera (tests/fake_v4l2) and a video, compared with the true lens.

usage: calibrate_guided_test.py PROGRAM [unittest options]
"""
import json
import pathlib
import signal
import subprocess
import unittest

import cv2
import numpy as np

import calibrate_boards_test as boards
from fake_camera import FakeCamera
from harness import PROGRAM, rest_of

VIEWS = 8
HELD = 26  # images of the board at one place
WORDS = ("--target", "charuco", *map(str, boards.PrintedBoards.CHARUCO), "--lens", "radtan4", "--set", f"guide.views_at_most={VIEWS}",
         "--set", "guide.capture.new_share=0.02")


class Guided(boards.InFolder):
    def setUp(self):
        super().setUp()
        self.run_here("tags", "board", "--style", "charuco", *boards.PrintedBoards.CHARUCO, "--dpi", boards.DPI, "-o", "sheet.png")
        page = cv2.imread(str(self.folder / "sheet.png"), cv2.IMREAD_GRAYSCALE)
        photos = self.folder / "photos"
        photos.mkdir()
        self.truth = boards.photographs(page, 0.297, VIEWS + 2, photos, np.random.default_rng(11), scale_px=2 / 3)
        self.images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(photos.iterdir())]

    def check_camera(self, outcome):
        found = json.loads(outcome.out)
        for name, truth in zip(("fx_px", "cx_px", "cy_px"), (self.truth[0], self.truth[1] + 0.5, self.truth[2] + 0.5)):
            value = found["parameters"][name]
            self.assertLess(abs(value["value"] - truth), 4 * value["sigma"], f"{name} {value} {truth}")
            self.assertLess(value["sigma"], 6, name)
        return found

    def camera(self):
        """Plays identical images of the still board for 1.3 s at each place."""
        camera = FakeCamera(self.folder / "fake", PROGRAM)
        height, width = self.images[0].shape
        with open(self.folder / "fake/frames", "wb") as file:
            for image in self.images:
                file.write(image.tobytes() * HELD)
        return camera.add_mode("GREY", width, height, 20, "frames")

    def test_a_live_camera(self):
        camera = self.camera()
        words = ("calibrate", "camera", "v4l2:/dev/video0", *WORDS, "--resume", "views", "-o", "calibration.yaml", "--json")
        outcome = self.run_here(*words, env=camera.environment())
        self.assertEqual(outcome.code, 0, outcome.err)
        found = self.check_camera(outcome)
        self.assertEqual(len(found["images"]), VIEWS)
        self.assertEqual(len(list((self.folder / "views").iterdir())), VIEWS)
        self.assertIn("verdict: known", (self.folder / "calibration.yaml").read_text())
        self.assertIn("exposure_ms", outcome.err, "automatic controls are fixed")
        self.assertIn("8 views", outcome.err)
        self.assertNotIn("unplug", outcome.err, "a still board gives identical images, as a frozen camera does")
        self.assertLessEqual(outcome.err.count("identical"), 1, outcome.err)
        again = self.run_here(*words, "--force", env=camera.environment())
        self.assertEqual(again.code, 0, again.err)
        self.assertIn("views: 8 ", again.err)
        self.assertEqual(len(list((self.folder / "views").iterdir())), VIEWS, "enough from before")

    def test_the_dictionary_of_the_board_at_a_live_camera_is_suggested(self):
        words = [str(word).replace("5x5_100", "6x6_50") for word in WORDS]
        running = subprocess.Popen([PROGRAM, "calibrate", "camera", "v4l2:/dev/video0", *words], cwd=self.folder, text=True,
                                   env=self.camera().environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        printed = []
        while not printed or ("--dictionary" not in printed[-1] and printed[-1]):
            printed.append(running.stderr.readline())
        running.send_signal(signal.SIGINT)
        _, err = rest_of(running)
        self.assertEqual(running.returncode, 130, err)
        self.assertIn("--dictionary 5x5_", printed[-1], "".join(printed))

    def test_ctrl_c_ends_a_video_with_the_views_so_far(self):
        height, width = self.images[0].shape
        video = cv2.VideoWriter(str(self.folder / "board.avi"), cv2.VideoWriter_fourcc(*"MJPG"), 20, (width, height), False)
        self.assertTrue(video.isOpened())
        for image in self.images * 6:
            for _ in range(HELD):
                video.write(image)
        video.release()
        running = subprocess.Popen([PROGRAM, "calibrate", "camera", "board.avi", "--guided", *WORDS, "--set", "guide.views_at_most=1000", "--set", "guide.focal_share=1e-5",
                                    "-o", "calibration.yaml", "--json"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        printed = []
        while not printed or "6 views" not in printed[-1]:
            line = running.stderr.readline()
            if not line:
                break
            printed.append(line)
        running.send_signal(signal.SIGINT)
        out, err = rest_of(running)
        self.assertEqual(running.returncode, 130, "".join(printed) + err)
        self.assertGreaterEqual(len(json.loads(out)["images"]), 6)
        self.assertTrue((self.folder / "calibration.yaml").exists(), "the views so far are used")


if __name__ == "__main__":
    unittest.main()
