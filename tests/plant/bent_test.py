#!/usr/bin/python3
"""Tags on bottles and under uneven light, rendered by ray casting: the errors of their corners must be consistent with the covariance.

    tests/plant/bent_test.py build/check/bin/waymark
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import tag_bitmaps

IMAGE_PX = 2.2  # side of an image, relative to that of its tag
FOCAL_PX = 700.0
SAMPLES = 8  # of a pixel, along each axis
SIDES_PX = (45, 110)
TAGS = 8  # of each size
# Name: angle between the normals at the sides of a tag, gamma, share of the light in a shadow.
CONDITIONS = {"flat": (0, 1.0, 1.0), "bottle": (40, 1.0, 1.0), "bottle, gamma": (40, 2.2, 1.0), "shadow": (0, 1.0, 0.6)}
MAX_NEES = 2.0  # median of the mean normalised error squared of a coordinate


def rotation(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross


class Sheet:
    """A tag with a black square of side 1 on a cylinder; its axis lies in the direction (cos a, sin a) of the print."""

    def __init__(self, cells: np.ndarray, random: np.random.Generator, side_px: float, bend_deg: float) -> None:
        self.cells = cells
        self.bend_rad = math.radians(bend_deg) * random.choice([-1, 1])
        a = random.uniform(0, math.pi)
        self.across, self.along = np.array([-math.sin(a), math.cos(a)]), np.array([math.cos(a), math.sin(a)])
        tilt = rotation(np.array([*random.normal(size=2), 0]), math.radians(random.uniform(0, 40)))
        self.R = tilt @ rotation(np.array([0, 0, 1.0]), random.uniform(0, 2 * math.pi))
        self.t = np.array([*random.uniform(-0.05, 0.05, 2), FOCAL_PX / side_px])
        self.image_px = round(IMAGE_PX * side_px)

    def points(self, print_xy: np.ndarray) -> np.ndarray:
        """Points of the print in the frame of the camera."""
        s, t = print_xy @ self.across, print_xy @ self.along
        if self.bend_rad:
            s, z = np.sin(s * self.bend_rad) / self.bend_rad, (1 - np.cos(s * self.bend_rad)) / self.bend_rad
        else:
            z = 0 * s
        return np.column_stack([s[:, None] * self.across + t[:, None] * self.along, z]) @ self.R.T + self.t

    def levels(self, rays: np.ndarray) -> np.ndarray:
        """1 white, 0 black, NaN beside the paper."""
        origin, d = -self.R.T @ self.t, rays @ self.R
        os, ds = origin[:2] @ self.across, d[:, :2] @ self.across
        if self.bend_rad:
            radius = 1 / self.bend_rad  # signed; the axis of the cylinder is at z = radius
            oz = origin[2] - radius
            a, b, c = ds**2 + d[:, 2] ** 2, os * ds + oz * d[:, 2], os**2 + oz**2 - radius**2
            root = np.sqrt(np.maximum(b * b - a * c, 0))
            ways = [np.where(b * b > a * c, (-b + sign * root) / a, np.nan) for sign in (-1, 1)]
        else:
            ways = [-origin[2] / d[:, 2]]
        level = np.full(len(rays), np.nan)
        for way in ways:  # at most one of the two lies on the paper
            s, z = os + way * ds, origin[2] + way * d[:, 2]
            if self.bend_rad:
                s = np.arctan2(s, (radius - z) * np.sign(radius)) * abs(radius)
            t = origin[:2] @ self.along + way * (d[:, :2] @ self.along)
            xy = s[:, None] * self.across + t[:, None] * self.along
            cell = np.floor(np.nan_to_num(8 * xy + 5, nan=-9)).astype(int)
            paper = ((cell >= -1) & (cell <= 10)).all(axis=1) & np.isnan(level)
            inside = paper & ((cell >= 0) & (cell < 10)).all(axis=1)
            level[paper] = 1
            level[inside] = self.cells[cell[inside, 1], cell[inside, 0]]
        return level


def corners_px(sheet: Sheet) -> np.ndarray:
    p = sheet.points(np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]))
    return FOCAL_PX * p[:, :2] / p[:, 2:] + sheet.image_px / 2


def blurred(image: np.ndarray, sigma_px: float) -> np.ndarray:
    at = np.arange(-4, 5)
    kernel = np.exp(-0.5 * (at / sigma_px) ** 2)
    kernel /= kernel.sum()
    padded = np.pad(image, 4, mode="edge")
    rows = sum(w * padded[:, i:i + image.shape[1]] for i, w in enumerate(kernel))
    return sum(w * rows[i:i + image.shape[0]] for i, w in enumerate(kernel))


def photograph(sheet: Sheet, random: np.random.Generator, gamma: float, shadow: float) -> np.ndarray:
    side_px = sheet.image_px
    sub = (np.arange(side_px * SAMPLES) + 0.5) / SAMPLES
    x, y = np.meshgrid(sub, sub)
    rays = np.column_stack([(x.ravel() - side_px / 2) / FOCAL_PX, (y.ravel() - side_px / 2) / FOCAL_PX, np.ones(x.size)])
    level = sheet.levels(rays).reshape(x.shape)
    light = np.where(np.isnan(level), 0.45, 0.1 + 0.7 * np.nan_to_num(level))
    if shadow < 1:
        turn = random.uniform(0, 2 * math.pi)
        middle = corners_px(sheet).mean(axis=0)
        out = ((x - middle[0]) * math.cos(turn) + (y - middle[1]) * math.sin(turn)) / random.uniform(0.5, 3)
        light *= shadow + (1 - shadow) / (1 + np.exp(-np.clip(out, -50, 50)))
    image = light.reshape(side_px, SAMPLES, side_px, SAMPLES).mean(axis=(1, 3))
    image = 255 * np.clip(blurred(image, 0.6), 0, 1) ** (1 / gamma)
    return np.clip(np.rint(image + random.normal(0, 1.5, image.shape)), 0, 255).astype(np.uint8)


def detections(program: str, images: list[pathlib.Path]) -> list[list[dict[str, object]]]:
    done = subprocess.run([program, "detect", "--json", "--covariance", *map(str, images)], capture_output=True, text=True, check=True)
    found = {pathlib.Path(line["image"]).name: line["detections"] for line in map(json.loads, done.stdout.splitlines()) if "detections" in line}
    return [found[image.name] for image in images]


def main() -> int:
    cells = tag_bitmaps.tag36h11(list(range(TAGS)))
    failed = False
    for name, (bend_deg, gamma, shadow) in CONDITIONS.items():
        random = np.random.default_rng(7)
        images, truth = [], []
        with tempfile.TemporaryDirectory() as scratch:
            for side_px in SIDES_PX:
                for number in range(TAGS):
                    sheet = Sheet(cells[number], random, side_px, bend_deg)
                    images.append(pathlib.Path(scratch) / f"{len(images):03}.pgm")
                    header = f"P5\n{sheet.image_px} {sheet.image_px}\n255\n".encode()
                    images[-1].write_bytes(header + photograph(sheet, random, gamma, shadow).tobytes())
                    truth.append((number, corners_px(sheet)))
            found = detections(sys.argv[1], images)
        missed, unreliable, wrong, nees, worst_px = 0, 0, 0, [], 0.0
        for (number, true_px), seen in zip(truth, found):
            own = [one for one in seen if one["id"] == number]
            missed += 0 if own else 1
            for one in own:
                if one.get("corners") == "unreliable":
                    unreliable += 1
                    continue
                error = np.array(one["corners_px"]) - true_px
                covariance = np.array(one["corner_covariance_px2"])
                nees.append(error.ravel() @ np.linalg.solve(covariance, error.ravel()) / 8)
                for k in range(4):
                    block = covariance[2 * k:2 * k + 2, 2 * k:2 * k + 2]
                    wrong += int(np.linalg.norm(error[k]) > 0.5 and error[k] @ np.linalg.solve(block, error[k]) > 25)
                worst_px = max(worst_px, float(np.linalg.norm(error, axis=1).max()))
        print(f"{name}: {len(truth)} tags, {missed} missed, {unreliable} unreliable, worst corner {worst_px:.2f} px, "
              f"{wrong} corners off by more than 0.5 px and five standard deviations, NEES/8 {np.mean(nees):.2f}, median {np.median(nees):.2f}")
        failed |= missed > 0 or unreliable > 2 or wrong > 0 or not np.median(nees) < MAX_NEES
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
