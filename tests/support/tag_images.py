"""Images of tags seen through a lens, rendered in numpy and OpenCV without any code of Waymark.

Pixel centres are at integers in camera matrices, as in OpenCV and ROS, and at +1/2 in corners, as in the output of Waymark."""
import pathlib
import sys

import cv2
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "plant"))
import tag_bitmaps  # noqa: E402

SQUARE_CELLS = {"tag36h11": 8, "tagStandard41h12": 5, "tagCustom48h12": 6}  # side of the square where black meets white


def rotation(x_deg=0.0, y_deg=0.0, z_deg=0.0):
    """First about x, last about z."""
    one = [cv2.Rodrigues(np.radians(angle) * axis)[0] for angle, axis in zip((x_deg, y_deg, z_deg), np.eye(3))]
    return one[2] @ one[1] @ one[0]


def quaternion(R):
    """As x, y, z, w."""
    turn = cv2.Rodrigues(np.asarray(R, float))[0].ravel()
    angle = np.linalg.norm(turn)
    axis = turn / angle if angle > 0 else turn
    return [*(axis * np.sin(angle / 2)), np.cos(angle / 2)]


class Tag:
    """Pose in the camera; tag axes: x right, y down, z into the tag."""

    def __init__(self, family, number, size_m, R, t):
        self.family, self.number, self.size_m, self.R, self.t = family, number, size_m, R, np.array(t, float)
        self.margin = 1  # white cells around the print
        self.cells = tag_bitmaps.bitmaps(family, [number])[0]
        self.cell_m = size_m / SQUARE_CELLS[family]

    def corners(self):
        """TL, TR, BR, BL [m]."""
        return self.size_m / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) @ self.R.T + self.t


class Lens:
    """A pinhole lens with the distortion of OpenCV, or an equidistant one; K may have a skew."""

    def __init__(self, width, height, K, d=(0, 0, 0, 0, 0), fisheye=False):
        self.width, self.height, self.K, self.d, self.fisheye = width, height, np.array(K, float), np.array(d, float), fisheye

    def bent_angle(self, angle):
        return angle * (1 + sum(k * angle ** (2 * i + 2) for i, k in enumerate(self.d)))

    def project(self, points):
        if self.fisheye:
            across = np.hypot(points[:, 0], points[:, 1])
            flat = points[:, :2] * (self.bent_angle(np.arctan2(across, points[:, 2])) / across)[:, None]
        else:
            flat = cv2.projectPoints(points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), np.eye(3), self.d)[0].reshape(-1, 2)
        return flat @ self.K[:2, :2].T + self.K[:2, 2]

    def rays(self, pixels):
        flat = (pixels - self.K[:2, 2]) @ np.linalg.inv(self.K[:2, :2]).T
        if self.fisheye:
            angles = np.linspace(0, 1.5, 20001)
            bent = self.bent_angle(angles)
            last = np.argmax(bent) + 1  # beyond it, the distortion folds back
            across = np.hypot(flat[:, 0], flat[:, 1])
            angle = np.interp(across, bent[:last], angles[:last])
            return np.c_[flat * (np.sin(angle) / np.maximum(across, 1e-12))[:, None], np.cos(angle)]
        if self.d.any():
            stop = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 50, 1e-10)
            flat = cv2.undistortPointsIter(flat.reshape(-1, 1, 2), np.eye(3), self.d, None, None, stop).reshape(-1, 2)
        return np.c_[flat, np.ones(len(flat))]

    def corners_px(self, tag):
        return self.project(tag.corners()) + 0.5


def light(tag, rays, shade, depth):
    """Paints a tag and its white margin where it is nearer than what was painted before."""
    towards = rays @ tag.R[:, 2]
    far = (tag.R[:, 2] @ tag.t) / np.where(towards > 1e-9, towards, np.inf)
    hit = np.flatnonzero((far > 0) & (far < depth))
    on_tag = (rays[hit] * far[hit, None] - tag.t) @ tag.R[:, :2] / tag.cell_m + len(tag.cells) / 2
    near = np.all((on_tag > -tag.margin) & (on_tag < len(tag.cells) + tag.margin), axis=1)
    hit, cell = hit[near], np.floor(on_tag[near]).astype(int) + 1
    shade[hit] = np.pad(tag.cells, 1, constant_values=1)[cell[:, 1], cell[:, 0]]
    depth[hit] = far[hit]


def shades(lens, tags, pixels):
    """0 black, 0.5 background, 1 white, at each of these points of the image."""
    rays = lens.rays(pixels)
    shade, depth = np.full(len(rays), 0.5), np.full(len(rays), np.inf)
    for tag in tags:
        light(tag, rays, shade, depth)
    return shade


def render(lens, tags, seed, noise=1.5):
    """Grey levels 0 to 255, not rounded. Pixels at an edge are the mean of 64 rays. Each has a random place in its part of the pixel, because
    the rays of a regular grid would shift edges that are parallel to its lines."""
    rng, samples = np.random.default_rng(seed), 8
    x, y = np.meshgrid(np.arange(lens.width, dtype=float), np.arange(lens.height, dtype=float))
    image = shades(lens, tags, np.c_[x.ravel(), y.ravel()]).reshape(x.shape)
    window = np.ones((5, 5))
    edges = cv2.dilate(image, window) > cv2.erode(image, window)
    places = (np.stack(np.mgrid[:samples, :samples], 2).reshape(-1, 2) + rng.random((samples ** 2, 2))) / samples
    image[edges] = np.mean([shades(lens, tags, np.c_[x[edges], y[edges]] + place) for place in places - places.mean(axis=0)], axis=0)
    image = (25 + 195 * image) * (0.92 + 0.16 * x / lens.width)
    return np.clip(cv2.GaussianBlur(image, (0, 0), 0.5) + rng.normal(0, noise, image.shape), 0, 255)


def grey(image):
    return np.rint(image).astype(np.uint8)
