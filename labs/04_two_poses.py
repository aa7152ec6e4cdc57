# %% [markdown]
# # Lab 4: PnP and its two solutions
# Four corners of a square give its pose. If perspective is weak, two poses fit almost equally well, and noise decides which fits better
# (Collins and Bartoli, "Infinitesimal Plane-Based Pose Estimation", IJCV 109, 2014). You observe this ambiguity and resolve it. 50 minutes.

# %%
import numpy as np

from waymark import camera, geometry, labs, pose, samples

lens = camera.pinhole(640, 480, 500, 500, 320, 240)
size_m = 0.16  # tag frame: centre, x right, y down, z into the tag

# %% [markdown]
# ## 1. Corners in the image
# Top left, top right, bottom right, bottom left of the tag. Use `lens.project(points)` with points (4, 3) in the camera frame.

# %%
def corners(cam_T_tag):
    """geometry.SE3 -> pixels (4, 2)"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Reprojection error
# The root mean square of the distances of the four corners [px].
# <details><summary>Hint</summary>A distance has two coordinates; the mean is over corners, not over coordinates.</details>

# %%
def rms(cam_T_tag, seen_px):
    """geometry.SE3, pixels (4, 2) -> number [px]"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The other pose
# To first order the second solution has the tag's normal mirrored about the line of sight. Write it.
# <details><summary>Hint</summary>Mirror n about the unit vector v: keep the component along v, negate the rest.</details>
#
# **Question:** at which position of the tag do both solutions agree?

# %%
def other_normal(normal, position):
    """the tag's unit normal (3,) and its centre (3,) in the camera frame -> unit normal of the other solution (3,)"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Choose
# The camera is level (its y axis points down), and the tag hangs upright on a wall. Choose between the two poses by that, not by the error.

# %%
def choose(best, other):
    """two geometry.SE3 -> the one whose tag hangs upright on a wall"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(4, globals())
