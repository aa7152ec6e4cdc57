import numpy as np


def pinhole(p):
    if p[2] <= 0:
        return None
    return np.array([fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy])


def distort(x, y):
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def undistort(x_distorted, y_distorted):
    x, y = x_distorted, y_distorted
    for _ in range(60):
        u, v = distort(x, y)
        x, y = x + (x_distorted - u), y + (y_distorted - v)
    return x, y


def from_opencv(cx_opencv, cy_opencv):
    return cx_opencv + 0.5, cy_opencv + 0.5


WRONG = {
    "points behind are projected": ("if p[2] <= 0:", "if p[2] == 0:", "a point at depth"),
    "one focal length for both": ("fy * p[1] / p[2]", "fx * p[1] / p[2]", "the y of the pixel is wrong for the point"),
    "half a pixel added twice": ("fx * p[0] / p[2] + cx,", "fx * p[0] / p[2] + cx + 0.5,", "off by half a pixel"),
    "r instead of r squared": ("r2 = x * x + y * y", "r2 = np.hypot(x, y)", "the radial part is wrong"),
    "tangential coefficients exchanged": ("2 * p1 * x * y + p2 * (r2 + 2 * x * x)", "2 * p2 * x * y + p1 * (r2 + 2 * x * x)", "the tangential part is wrong"),
    "one step is not enough": ("range(60)", "range(1)", "undistortion: off by"),
    "half a pixel the other way": ("cx_opencv + 0.5, cy_opencv + 0.5", "cx_opencv - 0.5, cy_opencv - 0.5", "draw the first pixel: where are its edges in each"),
}
