# %% [markdown]
# # Lab 5: noise, covariance and the Cramér-Rao bound
# How accurately can a pose be estimated from corners with noise? No unbiased estimator has a smaller covariance than the inverse Fisher information. You compute it, and test
# whether the covariance of an estimator is consistent with its errors (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4). 60 minutes.

# %%
import numpy as np

from waymark import camera, geometry, labs, pose, samples

lens = camera.pinhole(640, 480, 500, 500, 320, 240)
size_m, sigma_px = 0.3, 0.4
cam_T_tag = geometry.SE3(geometry.SO3.from_rpy(0.2, 0.6, 0.1), [0.1, -0.05, 1.0])
h = size_m / 2
cam_corners = cam_T_tag @ np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]])  # (4, 3)

# %% [markdown]
# ## 1. Derivative of a pixel with respect to its point
# The derivative (2, 3) of the pixel (fx x/z + cx, fy y/z + cy), fx = fy = 500.

# %%
def pixel_jacobian(p):
    """(3,) -> (2, 3) [px/m]"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Derivative of the corners with respect to the pose
# A small motion xi = (translation, rotation), in the camera frame and on the left, moves a point p by `translation + rotation x p`. Stack the four corners.
# <details><summary>Hint</summary>d(rotation x p)/d(rotation) is minus the matrix of the cross product with p.</details>

# %%
def pose_jacobian():
    """(8, 6): x0 y0 x1 y1 … with respect to xi"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The bound
# With independent noise of standard deviation sigma on each coordinate, the information is J^T J / sigma². Its inverse bounds the covariance.
#
# **Question:** how does the bound change if the noise doubles? If the tag is twice as far?

# %%
def bound(J, sigma):
    """(8, 6), [px] -> (6, 6)"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Is an estimator consistent?
# The normalised estimation error squared of one error e with covariance P is e^T P^-1 e; its mean is the number of coordinates when P is consistent with the errors.

# %%
def mean_nees(errors, P):
    """(n, 6), (6, 6) -> number"""
    raise NotImplementedError

# %% [markdown]
# ## 5. Fraction inside the ellipsoid
# The fraction of errors inside the ellipsoid that should contain 95 % of them. The 0.95 quantile of chi-square with 6 degrees of freedom is 12.592.

# %%
def share_inside(errors, P):
    """(n, 6), (6, 6) -> number from 0 to 1"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(5, globals())
