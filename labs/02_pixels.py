# %% [markdown]
# # Lab 2: pixels, pinhole, distortion and half a pixel
# A camera turns a point (x right, y down, z forward) into a pixel. You write that map and its inverse, and meet the half pixel on which
# libraries disagree. 45 minutes.

# %%
import numpy as np

from waymark import camera, labs

lab = labs.Lab("Lab 2")
fx, fy, cx, cy = 500.0, 510.0, 321.0, 239.0  # [px], the centre of pixel (i, j) is (i + 1/2, j + 1/2)
k1, k2, p1, p2 = -0.2, 0.05, 1e-3, -5e-4

# %% [markdown]
# ## 1. Pinhole
# <details><summary>Hint</summary>Divide by depth first. What should become of a point behind the camera?</details>

# %%
def pinhole(p):
    """(3,) -> pixel (2,), or None for a point that the camera cannot see because it is not in front of it"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Distortion
# Brown's model moves the normalised point (x, y): radial `1 + k1 r² + k2 r⁴`, tangential `2 p1 x y + p2 (r² + 2 x²)` for x and
# `p1 (r² + 2 y²) + 2 p2 x y` for y.
#
# **Question:** do straight lines bend inwards or outwards for k1 < 0?

# %%
def distort(x, y):
    """normalised, undistorted -> normalised, distorted (x, y)"""
    raise NotImplementedError

# %% [markdown]
# ## 3. Back again
# There is no closed form: iterate. Start at the distorted point, and move by what is missing.
#
# <details><summary>Hint</summary>x ← x + (x_distorted − distort(x)). How many steps are enough? Measure.</details>

# %%
def undistort(x_distorted, y_distorted):
    """the inverse of distort(), to 1e-9"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Half a pixel
# OpenCV and ROS say that the centre of the first pixel is (0, 0), here it is (1/2, 1/2). Convert a principal point from their files to ours.

# %%
def from_opencv(cx_opencv, cy_opencv):
    """principal point with centres at integers -> with centres at + 1/2"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_plain = camera.pinhole(640, 480, fx, fy, cx, cy)
_bent = camera.pinhole(640, 480, fx, fy, cx, cy, [k1, k2, p1, p2])
_points = np.array([[0.1, -0.2, 1.0], [0.4, 0.3, 1.5], [-0.8, 0.5, 2.0], [0.0, 0.0, 3.0]])


def _pinhole():
    for p in _points:
        found, right = labs.numbers(pinhole(p), (2,)), _plain.project(p)
        if not np.allclose(found, right, atol=1e-9):
            return "off by half a pixel" if np.allclose(np.abs(found - right), 0.5) else f"wrong for the point {p}"


def _behind():
    for p in ([0.1, 0.1, -1.0], [0.1, 0.1, 0.0]):
        if pinhole(np.array(p)) is not None:
            return f"a point at depth {p[2]} has a pixel"


def _distort():
    for p in _points:
        x, y = labs.numbers(distort(p[0] / p[2], p[1] / p[2]), (2,))
        px = np.array([fx * x + cx, fy * y + cy])
        if not np.allclose(px, _bent.project(p), atol=1e-9):
            radial = abs(p[0] * p[1]) > 0 and np.linalg.norm(px - _bent.project(p)) > 1
            return "the radial part is wrong" if radial else "the tangential part is wrong"


def _undistort():
    for x, y in ((0.1, -0.2), (0.3, 0.25), (-0.45, 0.3)):
        bearing = _bent.unproject([fx * x + cx, fy * y + cy])
        found = labs.numbers(undistort(x, y), (2,))
        error = np.abs(found - bearing[:2] / bearing[2]).max()
        if not error < 1e-9:
            return f"off by {error:.1e} at ({x}, {y})"


def _half():
    file = "image_width: 640\nimage_height: 480\ncamera_name: a\ncamera_matrix: {rows: 3, cols: 3, data: [500, 0, 320.25, 0, 500, 239.75, 0, 0, 1]}\n" \
        "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
    right = camera.parse_camera(file).intrinsics[2:4]
    if not np.allclose(labs.numbers(from_opencv(320.25, 239.75), (2,)), right):
        return "draw the first pixel: where are its edges in each convention?"


lab.check("pinhole", 2, _pinhole)
lab.check("points that are not in front", 1, _behind)
lab.check("distortion", 3, _distort)
lab.check("undistortion", 3, _undistort)
lab.check("half a pixel", 1, _half)
lab.finish()
