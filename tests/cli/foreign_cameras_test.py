#!/usr/bin/python3
"""Calibrations and images as other programs record them: `waymark localize`, `map` and `info` on ROS 2 bags.

usage: foreign_cameras_test.py PROGRAM [unittest options]

A robot at a known pose sees two tags of a known map, or drives towards a wall of tags. Images and corners are rendered without Waymark
(tests/support/tag_images.py). In each bag, the pose or the map must be right, or the error must name the cause.
"""
import functools
import math
import pathlib
import re
import sys
import unittest

import numpy as np

from harness import InFolder

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import ros2_bag as bag  # noqa: E402
import tag_images  # noqa: E402
from tag_images import Lens, Tag, rotation  # noqa: E402

WIDTH, HEIGHT, FOCAL = 480, 360, 375.0
START_NS = 100 * 10**9
FRAME = "camera_optical"
MOUNTING = np.array([0.1, 0, 0.2])
BASE_R_CAM = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)
X, Y, YAW = 0.3, -0.2, math.radians(20)  # of the standing robot in the map
NEAR_M, NEAR_RAD = 0.003, 0.003
TAGS = [Tag("tag36h11", 3, 0.16, rotation(20, 25, 5), [-0.15, 0.02, 0.9]), Tag("tag36h11", 7, 0.16, rotation(-15, -30, -8), [0.22, 0.05, 1.0])]
BARREL = [-0.28, 0.09, 0.001, -0.0007, 0.0]
FISHEYE = [0.03, 0.009, -0.0097, -0.01]


def matrix(focal=FOCAL, cx=WIDTH / 2 - 0.5, cy=HEIGHT / 2 - 0.5, skew=0.0):
    return [focal, skew, cx, 0, focal, cy, 0, 0, 1]


def camera_3x4(focal, cx, cy):
    return [focal, 0, cx, 0, 0, focal, cy, 0, 0, 0, 1, 0]


def lens(k, d=(0.0,) * 5, fisheye=False):
    return Lens(WIDTH, HEIGHT, np.reshape(k, (3, 3)), d, fisheye)


PLAIN = lens(matrix())
BENT = lens(matrix(), BARREL)
SKEWED = lens(matrix(250.0, skew=-6.0), FISHEYE, fisheye=True)


@functools.cache
def view(seen_through):
    return tag_images.render(seen_through, TAGS, seed=7)


def plain_info(ns):
    return bag.camera_info(ns, FRAME, WIDTH, HEIGHT, matrix(), [0.0] * 5)


def info(width=WIDTH, height=HEIGHT, k=None, d=(0.0,) * 5, **more):
    return lambda ns: bag.camera_info(ns, FRAME, width, height, k or matrix(), d, **more)


def raw(encoding, data, step):
    return lambda ns: bag.image(ns, FRAME, WIDTH, HEIGHT, encoding, data, step)


def mono8(seen_through):
    return raw("mono8", tag_images.grey(view(seen_through)).tobytes(), WIDTH)


def standing(path, make_view, make_info, topic="/camera/image_raw", kind=bag.IMAGE):
    """Six images in half a second, of a robot that stands still."""
    messages = [(START_NS, "/tf_static", bag.TRANSFORMS, bag.transform(START_NS, "base_link", FRAME, MOUNTING, tag_images.quaternion(BASE_R_CAM)))]
    for i in range(31):
        ns = START_NS + i * 20_000_000
        messages.append((ns, "/odom", bag.ODOMETRY, bag.odometry(ns, 0, 0)))
        if i % 5 == 0:
            messages.append((ns, topic.rsplit("/", 1)[0] + "/camera_info", bag.INFO, make_info(ns)))
            messages.append((ns, topic, kind, make_view(ns)))
    return bag.write(path, messages)


def map_yaml():
    turn = rotation(0, 0, math.degrees(YAW))
    lines = ["format: waymark-map-1", 'anchor: "tag36h11:3"', "provenance: {method: rendered}", "tags:"]
    for tag in TAGS:
        place = turn @ (BASE_R_CAM @ tag.t + MOUNTING) + [X, Y, 0]
        lines += [f'  - tag: "{tag.family}:{tag.number}"', f"    size_m: {tag.size_m}", f"    position_m: {place.tolist()}",
                  f"    quaternion_xyzw: {[float(q) for q in tag_images.quaternion(turn @ BASE_R_CAM @ tag.R)]}"]
    return "\n".join(lines) + "\n"


class Bags(InFolder):
    def setUp(self):
        super().setUp()
        (self.folder / "map.yaml").write_text(map_yaml())

    def localize(self, *flags):
        (self.folder / "a.tum").unlink(missing_ok=True)
        return self.run_here("localize", "a.db3", "--map", "map.yaml", "-o", "a.tum", *flags)

    def assert_right(self, outcome):
        self.assertEqual(outcome.code, 0, outcome.err)
        _, x, y, _, qx, qy, qz, qw = map(float, (self.folder / "a.tum").read_text().splitlines()[-1].split())
        self.assertLess(math.hypot(x - X, y - Y), NEAR_M, (x, y))
        self.assertLess(abs(2 * math.atan2(qz, qw) - YAW) + abs(qx) + abs(qy), NEAR_RAD)

    def assert_refused(self, words, *commands):
        for command in commands:
            outcome = self.run_here(*command)
            self.assertEqual(outcome.code, 1, (command, outcome.err))
            for word in words:
                self.assertIn(word, outcome.err, command)

    def assert_trap(self, key, word):
        (shown,) = self.run_here("info", "a.db3", "--json").records
        self.assertTrue(any(trap["key"] == key and word in trap["message"] for trap in shown["traps"]), shown["traps"])


LOCALIZE = ("localize", "a.db3", "--map", "map.yaml", "-o", "a.tum")
MAP = ("map", "a.db3", "--anchor", "3", "--tag-size-m", "0.16", "-o", "m")


class Calibrations(Bags):
    def test_the_part_of_the_image_that_is_sent(self):
        """Binning and region of interest change the matrix, which describes the full image."""
        half = [WIDTH - 0.5, HEIGHT - 0.5]  # the centre of an image of twice the size
        cases = {
            "whole": info(),
            "zero region": info(roi=(0, 0, HEIGHT, WIDTH)),
            "binning": info(2 * WIDTH, 2 * HEIGHT, matrix(2 * FOCAL, *half), binning=2),
            "region": info(2 * WIDTH, 2 * HEIGHT, matrix(FOCAL, WIDTH / 2 - 0.5 + 100, HEIGHT / 2 - 0.5 + 60), roi=(100, 60, HEIGHT, WIDTH)),
            "both": info(3 * WIDTH, 3 * HEIGHT, matrix(2 * FOCAL, half[0] + 80, half[1] + 40), binning=2, roi=(80, 40, 2 * HEIGHT, 2 * WIDTH)),
        }
        for name, made in cases.items():
            with self.subTest(name):
                standing(self.folder / "a.db3", mono8(PLAIN), made)
                self.assert_right(self.localize())

    def test_another_size_is_refused_with_both_sizes(self):
        standing(self.folder / "a.db3", mono8(PLAIN), info(2 * WIDTH, 2 * HEIGHT, matrix(2 * FOCAL, WIDTH - 0.5, HEIGHT - 0.5)))
        self.assert_refused((f"{WIDTH}x{HEIGHT}", f"{2 * WIDTH}x{2 * HEIGHT}"), LOCALIZE, MAP)
        self.assertFalse((self.folder / "m/map.yaml").exists())
        # A driver that reports a binning although its calibration is that of the images.
        standing(self.folder / "a.db3", mono8(PLAIN), info(binning=2))
        self.assert_refused((f"{WIDTH}x{HEIGHT}, binning 2x2", f"{WIDTH // 2}x{HEIGHT // 2}"), LOCALIZE, MAP)

    def test_coefficients_and_names_of_the_models(self):
        for model, d in (("plumb_bob", BARREL), ("", BARREL), ("Brown-Conrady", BARREL), ("radial-tangential", BARREL[:4]), ("opencv", BARREL),
                         ("rational_polynomial", BARREL + [0.0] * 3), ("rational_polynomial", BARREL + [0.0] * 7),
                         ("Rational Polynomial", BARREL + [0.0] * 9)):
            with self.subTest(model, count=len(d)):
                standing(self.folder / "a.db3", mono8(BENT), info(d=d, model=model))
                self.assert_right(self.localize())
        for model in ("equidistant", "fisheye", "Kannala-Brandt", "kannala_brandt4"):
            with self.subTest(model):  # skew: u = fx x + s y + cx
                standing(self.folder / "a.db3", mono8(SKEWED), info(k=matrix(250.0, skew=-6.0), d=FISHEYE, model=model))
                self.assert_right(self.localize())

    def test_an_unusable_calibration_is_named_by_every_command(self):
        tilted = BARREL + [0.0] * 3 + [0.004, -0.001, 0.003, 0.0005, 0.03, -0.04]
        cases = {"tilted": (info(d=tilted, model="rational_polynomial"), "distortion"),
                 "model": (info(model="funny_lens"), "funny_lens"),
                 "zeros": (info(k=[0.0] * 9), "camera_info")}
        for name, (made, word) in cases.items():
            with self.subTest(name):
                standing(self.folder / "a.db3", mono8(PLAIN), made)
                self.assert_refused((word,), LOCALIZE, MAP)
                self.assert_trap("camera", word)


class RectifiedImages(Bags):
    """The projection matrix P of a CameraInfo describes rectified images, K and D describe the others."""
    K, P = matrix(), camera_3x4(340.0, 236.0, 184.0)
    RECTIFIED = lens([340.0, 0, 236.0, 0, 340.0, 184.0, 0, 0, 1])

    def corners(self, seen_through, seed):
        rng = np.random.default_rng(seed)
        return lambda ns: bag.detections(ns, FRAME, {tag.number: seen_through.corners_px(tag) - 0.5 + rng.normal(0, 0.05, (4, 2)) for tag in TAGS})

    def test_images(self):
        for topic, seen_through in (("image_raw", BENT), ("image_rect", self.RECTIFIED)):
            with self.subTest(topic):
                standing(self.folder / "a.db3", mono8(seen_through), info(d=BARREL, p=self.P), topic="/camera/" + topic)
                self.assert_right(self.localize())

    def test_detections(self):
        for name, seen_through in (("raw", BENT), ("rectified", self.RECTIFIED)):
            with self.subTest(name):
                standing(self.folder / "a.db3", self.corners(seen_through, 3), info(d=BARREL, p=self.P), "/camera/detections", bag.DETECTIONS)
                self.assert_right(self.localize())


class Encodings(Bags):
    def check(self, name, data, step):
        with self.subTest(name):
            standing(self.folder / "a.db3", raw(name, data, step), plain_info)
            self.assert_right(self.localize())

    def test_bytes(self):
        grey = tag_images.grey(view(PLAIN))
        padded = np.pad(grey, ((0, 0), (0, 32)))
        self.check("mono8", padded.tobytes(), WIDTH + 32)
        self.check("8UC1", grey.tobytes(), WIDTH)
        for name, channels in (("rgb8", 3), ("bgr8", 3), ("8UC3", 3), ("rgba8", 4), ("bgra8", 4), ("8UC4", 4)):
            colour = np.repeat(grey[..., None], channels, 2)
            colour[..., 3:] = 255
            self.check(name, colour.tobytes(), channels * WIDTH)

    def test_luma_and_colour_differences(self):
        grey = tag_images.grey(view(PLAIN))
        for name, offset in (("uyvy", 1), ("yuv422", 1), ("yuyv", 0), ("yuv422_yuy2", 0)):
            packed = np.full((HEIGHT, WIDTH, 2), 128, np.uint8)
            packed[..., offset] = grey
            self.check(name, packed.tobytes(), 2 * WIDTH)
        for name, more in (("nv12", WIDTH * HEIGHT // 2), ("nv21", WIDTH * HEIGHT // 2), ("nv24", 2 * WIDTH * HEIGHT)):
            self.check(name, grey.tobytes() + bytes([128]) * more, WIDTH)

    def test_bayer_patterns(self):
        """A scene of one hue: its red and blue pixels are darker than its green ones."""
        gain = {"r": 0.6, "g": 1.0, "b": 0.75}
        for order in ("rggb", "bggr", "grbg", "gbrg"):
            mosaic = view(PLAIN).copy()
            for place, colour in enumerate(order):
                mosaic[place // 2::2, place % 2::2] *= gain[colour]
            self.check(f"bayer_{order}8", tag_images.grey(mosaic).tobytes(), WIDTH)
            self.check(f"bayer_{order}16", np.rint(mosaic * 257).astype("<u2").tobytes(), 2 * WIDTH)

    def test_sensors_of_few_bits(self):
        """Cameras with 10 or 12 bits use a sixteenth or less of the range of 16 bits; thermal cameras use a narrow band of it."""
        for name, encoding, offset, step in (("16 bits", "mono16", 0, 257), ("12 bits", "mono16", 0, 16), ("10 bits", "mono16", 0, 4),
                                             ("infrared", "16UC1", 0, 4), ("thermal", "mono16", 21500, 9)):
            with self.subTest(name):
                wide = np.rint(view(PLAIN) * step + offset).astype("<u2")
                standing(self.folder / "a.db3", raw(encoding, wide.tobytes(), 2 * WIDTH), plain_info, topic="/ir/image_raw")
                self.assert_right(self.localize())

    def test_an_unreadable_encoding_is_named_by_every_command(self):
        standing(self.folder / "a.db3", raw("bayer_rggb4", bytes(WIDTH * HEIGHT), WIDTH), plain_info)
        self.assert_refused(("bayer_rggb4",), LOCALIZE, MAP, ("detect", "a.db3"))
        self.assert_trap("images", "bayer_rggb4")
        (shown,) = self.run_here("info", "a.db3", "--json").records
        self.assertNotIn("images", shown["contents"])  # so that no command is recommended that needs them


def drive(path, make_info, seen_through, seed=1):
    """A robot drives 1.3 m towards a wall of five tags, of which only the corners are recorded. Returns the tags' centres relative to the first."""
    facing = BASE_R_CAM  # the axes of a tag on a wall ahead, seen from the start
    centres = {number: np.array([3.0 + 0.3 * (number % 2), 0.8 - 0.4 * number, 0.3 + 0.15 * (number % 2)]) for number in range(5)}
    rng = np.random.default_rng(seed)
    messages = [(START_NS, "/tf_static", bag.TRANSFORMS, bag.transform(START_NS, "base_link", FRAME, MOUNTING, tag_images.quaternion(BASE_R_CAM)))]
    for i in range(251):
        ns, speed = START_NS + i * 20_000_000, 0.3 if 25 <= i < 240 else 0.0
        x = 0.3 * 0.02 * min(max(i - 25, 0), 215)
        messages.append((ns, "/odom", bag.ODOMETRY, bag.odometry(ns, x, speed)))
        if i % 5:
            continue
        seen = {}
        for number, centre in centres.items():
            tag = Tag("tag36h11", number, 0.2, BASE_R_CAM.T @ facing, BASE_R_CAM.T @ (centre - [x, 0, 0] - MOUNTING))
            corners = seen_through.corners_px(tag) - 0.5 + rng.normal(0, 0.1, (4, 2))
            if corners.min() > 4 and corners[:, 0].max() < WIDTH - 5 and corners[:, 1].max() < HEIGHT - 5:
                seen[number] = corners
        messages += [(ns, "/camera/camera_info", bag.INFO, make_info(ns)), (ns, "/camera/detections", bag.DETECTIONS, bag.detections(ns, FRAME, seen))]
    bag.write(path, messages)
    return {number: centre - centres[0] for number, centre in centres.items()}


class Maps(Bags):
    def test_maps_of_detections(self):
        bent_k = [440.0, 0, 243.0, 0, 440.0, 176.0, 0, 0, 1]
        p = camera_3x4(FOCAL, WIDTH / 2 - 0.5, HEIGHT / 2 - 0.5)
        cases = {
            "plain": (info(), PLAIN),
            "binning": (info(2 * WIDTH, 2 * HEIGHT, matrix(2 * FOCAL, WIDTH - 0.5, HEIGHT - 0.5), binning=2), PLAIN),
            "region": (info(WIDTH + 160, HEIGHT + 120, matrix(FOCAL, WIDTH / 2 - 0.5 + 80, HEIGHT / 2 - 0.5 + 60), roi=(80, 60, HEIGHT, WIDTH)), PLAIN),
            "rectified": (info(k=bent_k, d=BARREL, p=p), PLAIN),
            "raw": (info(k=bent_k, d=BARREL, p=p), lens(bent_k, BARREL)),
        }
        for name, (made, seen_through) in cases.items():
            with self.subTest(name):
                truth = drive(self.folder / f"{name}.db3", made, seen_through)
                outcome = self.run_here("map", f"{name}.db3", "--tag-size-m", "0.2", "--anchor", "0", "-o", name)
                self.assertEqual(outcome.code, 0, outcome.err)
                text = (self.folder / name / "map.yaml").read_text()
                found = {int(number): np.array([float(c) for c in place.split(",")])
                         for number, place in re.findall(r'tag: "tag36h11:(\d+)"\n.*?position_m: \[(.*?)\]', text, re.S)}
                self.assertEqual(found.keys(), truth.keys())
                for number, place in truth.items():
                    self.assertLess(np.linalg.norm(found[number] - found[0] - place), 0.02, (number, found[number] - found[0], place))


if __name__ == "__main__":
    unittest.main()
