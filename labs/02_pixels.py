# %% [markdown]
# # Lab 2: pixels, pinhole, distortion and half a pixel
# A camera maps a point (x right, y down, z forward) to a pixel. You write that map and its inverse, and handle the half pixel by which
# the conventions of libraries differ. 45 minutes.

# %%
import numpy as np

from waymark import camera, labs

fx, fy, cx, cy = 500.0, 510.0, 321.0, 239.0  # [px], the centre of pixel (i, j) is (i + 1/2, j + 1/2)
k1, k2, p1, p2 = -0.2, 0.05, 1e-3, -5e-4

# %% [markdown]
# ## 1. Pinhole
# <details><summary>Hint</summary>Divide by depth first. What should the result be for a point behind the camera?</details>

# %%
def pinhole(p):
    """(3,) -> pixel (2,), or None for a point that is not in front of the camera"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Distortion
# Brown's model moves the normalised point (x, y): radial `1 + k1 r² + k2 r⁴`, tangential `2 p1 x y + p2 (r² + 2 x²)` for x and
# `p1 (r² + 2 y²) + 2 p2 x y` for y.
#
# **Question:** do straight lines curve inwards or outwards for k1 < 0?

# %%
def distort(x, y):
    """normalised, undistorted -> normalised, distorted (x, y)"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The inverse
# There is no closed form: iterate. Start at the distorted point, and move by the remaining difference.
#
# <details><summary>Hint</summary>x ← x + (x_distorted − distort(x)). How many steps are enough? Measure.</details>

# %%
def undistort(x_distorted, y_distorted):
    """the inverse of distort(), to 1e-9"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Half a pixel
# In OpenCV and ROS the centre of the first pixel is (0, 0), here it is (1/2, 1/2). Convert a principal point from their files to this convention.

# %%
def from_opencv(cx_opencv, cy_opencv):
    """principal point with centres at integers -> with centres at + 1/2"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(2, globals())
