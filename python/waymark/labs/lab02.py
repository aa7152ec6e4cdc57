"""The checks of lab 2, pixels and distortion. Do the lab before reading them."""
import numpy as np

from .. import camera
from . import numbers

POINTS = np.array([[0.1, -0.2, 1.0], [0.4, 0.3, 1.5], [-0.8, 0.5, 2.0], [0.0, 0.0, 3.0]])


def lens(mine, bent=False):
    return camera.pinhole(640, 480, mine.fx, mine.fy, mine.cx, mine.cy, *([[mine.k1, mine.k2, mine.p1, mine.p2]] if bent else []))


def pinhole(mine):
    for p in POINTS:
        apart = numbers(mine.pinhole(p.copy()), (2,)) - lens(mine).project(p)
        if np.allclose(apart, 0, atol=1e-9):
            continue
        if np.isin(np.abs(apart).round(9), (0, 0.5)).all():
            return "off by half a pixel"
        which = " and ".join(name for name, off in zip(("x", "y"), apart) if abs(off) > 1e-9)
        return f"the {which} of the pixel is wrong for the point {p}"


def behind(mine):
    for p in ([0.1, 0.1, -1.0], [0.1, 0.1, 0.0]):
        with np.errstate(all="ignore"):
            if mine.pinhole(np.array(p)) is not None:
                return f"a pixel is returned for a point at depth {p[2]}"


def distort(mine):
    focal, centre = np.array([mine.fx, mine.fy]), np.array([mine.cx, mine.cy])
    for p in POINTS:
        apart = focal * numbers(mine.distort(p[0] / p[2], p[1] / p[2]), (2,)) + centre - lens(mine, bent=True).project(p)
        if not np.allclose(apart, 0, atol=1e-9):
            return f"the {'radial' if np.linalg.norm(apart) > 1 else 'tangential'} part is wrong"


def undistort(mine):
    for x, y in ((0.1, -0.2), (0.3, 0.25), (-0.45, 0.3)):
        bearing = lens(mine, bent=True).unproject([mine.fx * x + mine.cx, mine.fy * y + mine.cy])
        error = np.abs(numbers(mine.undistort(x, y), (2,)) - bearing[:2] / bearing[2]).max()
        if not error < 1e-9:
            return f"off by {error:.1e} at ({x}, {y})"


def half_a_pixel(mine):
    for cx, cy in ((320.25, 239.75), (160.0, 100.5)):
        file = (f"image_width: 640\nimage_height: 480\ncamera_name: a\ncamera_matrix: {{rows: 3, cols: 3, data: [500, 0, {cx}, 0, 500, {cy}, 0, 0, 1]}}\n"
                "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n")
        if not np.allclose(numbers(mine.from_opencv(cx, cy), (2,)), camera.parse_camera(file).intrinsics[2:4]):
            return "draw the first pixel: where are its edges in each convention?"


CHECKS = [("pinhole", 2, pinhole), ("points that are not in front", 1, behind), ("distortion", 3, distort), ("undistortion", 3, undistort),
          ("half a pixel", 1, half_a_pixel)]
