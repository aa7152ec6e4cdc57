#!/usr/bin/python3
"""`waymark detect` on images that are harder than a tag on a wall: nested tags, wide lenses, mirrored, inverted and dark images.

usage: hard_images_test.py PROGRAM [unittest options]

The images are rendered without Waymark (tests/support/tag_images.py), so that all corners and poses are known.
"""
import pathlib
import sys
import unittest

import cv2
import numpy as np

from harness import InFolder

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import tag_images  # noqa: E402
from tag_images import Lens, Tag, render, rotation  # noqa: E402

NEAR_PX = 0.15


def pinhole(width, height, focal, d=(0.0,) * 5, fisheye=False):
    return Lens(width, height, [[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1]], d, fisheye)


def camera_yaml(lens):
    model = "equidistant" if lens.fisheye else "plumb_bob"
    return (f"image_width: {lens.width}\nimage_height: {lens.height}\ncamera_name: test\n"
            f"camera_matrix: {{rows: 3, cols: 3, data: {lens.K.ravel().tolist()}}}\ndistortion_model: {model}\n"
            f"distortion_coefficients: {{rows: 1, cols: {len(lens.d)}, data: {lens.d.tolist()}}}\n")


PLAIN = pinhole(480, 360, 375.0)
TWO = [Tag("tag36h11", 3, 0.16, rotation(20, 25, 5), [-0.15, 0.02, 0.9]), Tag("tag36h11", 7, 0.16, rotation(-15, -30, -8), [0.22, 0.05, 1.0])]


class HardImages(InFolder):
    def detect(self, image, *flags, lens=None):
        cv2.imwrite(str(self.folder / "hard.png"), image if image.dtype == np.uint16 else tag_images.grey(image))
        if lens is not None:
            (self.folder / "camera.yaml").write_text(camera_yaml(lens))
            flags = ["--camera", "camera.yaml", *flags]
        outcome = self.run_here("detect", "--json", "hard.png", *flags)
        self.assertEqual(outcome.code, 0, outcome.err)
        (record,) = outcome.records
        return record, {(d["family"], d["id"]): d for d in record["detections"]}

    def assert_corners(self, found, lens, tags):
        for tag in tags:
            detection = found[tag.family, tag.number]
            far = np.abs(np.array(detection["corners_px"]) - lens.corners_px(tag)).max()
            self.assertLess(far, NEAR_PX, detection)
            self.assertEqual(detection["refinement"], "refined", detection)

    def assert_pose(self, detection, tag, far_m):
        pose = detection["pose"]
        error = np.linalg.norm(np.array(pose["cam_t_tag_m"]) - tag.t)
        self.assertLess(error, far_m, pose)
        self.assertLess(error, 5 * np.linalg.norm(pose["sigma_t_m"]), pose)

    def test_nested_tags(self):
        """A small tag is printed in the hole of tagCustom48h12."""
        for number, (turn, place) in enumerate([(rotation(0, 0, 0), [0, 0, 0.6]), (rotation(12, -25, 10), [0.02, -0.01, 0.6]), (rotation(-30, 10, -40), [-0.03, 0.02, 0.7])]):
            outer, inner = (Tag("tagCustom48h12", i, size, turn, place) for i, size in ((2 * number, 0.3), (2 * number + 1, 0.06)))
            inner.t, inner.margin = inner.t - 1e-6 * turn[:, 2], 0  # in front of the outer one
            with self.subTest(number):
                _, found = self.detect(render(PLAIN, [outer, inner], seed=number), "--family", "tagCustom48h12",
                                       "--tag-size-m", "0.3", "--tag-size-m", f"{2 * number + 1}=0.06", lens=PLAIN)
                self.assert_corners(found, PLAIN, [outer, inner])
                self.assert_pose(found[outer.family, outer.number], outer, 0.002)
                self.assert_pose(found[inner.family, inner.number], inner, 0.006)

    def test_wide_lenses(self):
        """With --camera, the refinement of the corners uses the distortion, up to 56 degrees off the axis."""
        barrel = pinhole(960, 540, 465.0, [-0.33, 0.11, 0, 0, 0])
        fisheye = pinhole(960, 720, 333.0, [0.03678, 0.009125, -0.009733, -0.010051], fisheye=True)
        kept = []
        for name, lens, far_m, places in (("barrel", barrel, (0.5, 0.9), ((0, 0), (-25, -12), (33, 15), (-38, 14))),
                                          ("fisheye", fisheye, (0.45, 0.8, 1.4), ((0, 0), (-25, -8), (35, 18), (-48, 5), (55, -12)))):
            for seed, distance in enumerate(far_m):
                turns = [rotation(up, across) for across, up in places]
                tags = [Tag("tag36h11", i, 0.16, turn @ rotation(15, 10, 7 * i), turn @ [0, 0, distance]) for i, turn in enumerate(turns)]
                _, found = self.detect(render(lens, tags, seed), "--tag-size-m", "0.16", lens=lens)
                for tag in tags:
                    with self.subTest(name, distance=distance, tag=tag.number):
                        detection = found[tag.family, tag.number]
                        if detection["refinement"] != "refined":
                            kept.append((name, distance, tag.number))
                            far = np.abs(np.array(detection["corners_px"]) - lens.corners_px(tag)).max()
                            self.assertLess(far, 4 * np.max(detection["corner_sigma_px"]), detection)
                            continue
                        self.assert_corners(found, lens, [tag])
                        self.assert_pose(detection, tag, 0.004)
        self.assertLessEqual(len(kept), 2, kept)  # of 23

    def test_inverted_prints(self):
        image = render(PLAIN, TWO, seed=3)
        record, found = self.detect(255 - image)
        self.assertEqual((record["no_tag_cause"], found), ("inverted", {}))
        record, found = self.detect(255 - image, "--find-inverted")
        self.assertNotIn("no_tag_cause", record)
        self.assert_corners(found, PLAIN, TWO)

    def test_images_without_tags_have_a_cause(self):
        image = render(PLAIN, TWO, seed=4)
        small = cv2.resize(image, None, fx=0.16, fy=0.16, interpolation=cv2.INTER_AREA)
        flat = np.full_like(image, 120) + np.random.default_rng(5).normal(0, 2, image.shape)
        for cause, shown in (("mirrored", image[:, ::-1]), ("dark", image / 16), ("faint", 100 + image / 30), ("faint", flat),
                             ("blurred", cv2.GaussianBlur(image, (0, 0), 15)), ("small", small)):
            with self.subTest(cause):
                record, found = self.detect(shown)
                self.assertEqual((record.get("no_tag_cause"), found), (cause, {}))
        record, _ = self.detect(image, "--family", "tag25h9")
        self.assertEqual(record["no_tag_cause"], "other_family")
        record, _ = self.detect(image)
        self.assertNotIn("no_tag_cause", record)

    def test_a_number_refers_to_the_family_that_is_searched_for(self):
        large, small = (Tag("tagStandard41h12", i, size, rotation(5, 15 * side, 0), [0.12 * side, 0, 0.6]) for i, size, side in ((1, 0.16, 1), (0, 0.08, -1)))
        image = render(PLAIN, [large, small], seed=6)
        for name in ("0", "tagStandard41h12:0"):
            with self.subTest(name):
                _, found = self.detect(image, "--family", "tagStandard41h12", "--tag-size-m", "0.16", "--tag-size-m", name + "=0.08", lens=PLAIN)
                self.assert_pose(found[small.family, 0], small, 0.004)
                self.assert_pose(found[large.family, 1], large, 0.004)
        for flags in (["--family", "tagStandard41h12", "--tag-size-m", "tag36h11:0=0.08"],
                      ["--family", "tagStandard41h12", "--family", "tag36h11", "--tag-size-m", "0=0.08"]):
            refused = self.run_here("detect", "hard.png", "--camera", "camera.yaml", "--tag-size-m", "0.16", *flags)
            self.assertEqual(refused.code, 2, refused.err)
            self.assertIn("(--tag-size-m)", refused.err)

    def test_sixteen_bits(self):
        image = render(PLAIN, TWO, seed=8)
        for name, offset, step in (("16 bits", 0, 257), ("12 bits", 0, 16), ("10 bits", 0, 4), ("thermal", 21500, 9)):
            with self.subTest(name):
                _, found = self.detect(np.rint(image * step + offset).astype(np.uint16))
                self.assert_corners(found, PLAIN, TWO)


if __name__ == "__main__":
    unittest.main()
