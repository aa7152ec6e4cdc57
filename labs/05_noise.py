# %% [markdown]
# # Lab 5: noise, covariance and the bound of Cramér and Rao
# How well can a pose be known from corners with noise? No unbiased estimator does better than the inverse of Fisher's information. You compute it, and test
# whether the covariance of an estimator is consistent with its errors (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4). 60 minutes.

# %%
import numpy as np

from waymark import camera, geometry, labs, pose, samples

lab = labs.Lab("Lab 5")
lens = camera.pinhole(640, 480, 500, 500, 320, 240)
size_m, sigma_px = 0.3, 0.4
cam_T_tag = geometry.SE3(geometry.SO3.from_rpy(0.2, 0.6, 0.1), [0.1, -0.05, 1.0])
h = size_m / 2
cam_corners = cam_T_tag @ np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]])  # (4, 3)

# %% [markdown]
# ## 1. How a pixel moves with its point
# The derivative (2, 3) of the pixel (fx x/z + cx, fy y/z + cy), fx = fy = 500.

# %%
def pixel_jacobian(p):
    """(3,) -> (2, 3) [px/m]"""
    raise NotImplementedError

# %% [markdown]
# ## 2. How the corners move with the pose
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
# **Question:** how does the bound change when the noise doubles? When the tag is twice as far?

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
# ## 5. How often inside?
# The share of errors inside the ellipsoid that 95 % should be in. The 0.95 quantile of chi-square with 6 degrees of freedom is 12.592.

# %%
def share_inside(errors, P):
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(5)


def _right_jacobian():
    J = np.zeros((8, 6))
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        ahead, behind = (lens.project(geometry.SE3.exp(s * step) @ cam_corners) for s in (1, -1))
        J[:, k] = ((ahead - behind) / 2e-6).ravel()
    return J


def _pixel():
    for p in cam_corners:
        found = labs.numbers(pixel_jacobian(p), (2, 3))
        if not np.allclose(found, lens.project_jacobian(p), atol=1e-9):
            return "the first two columns are right, the third is not" if np.allclose(found[:, :2], lens.project_jacobian(p)[:, :2]) else \
                "compare it with (project(p + d) - project(p)) / d"


def _pose():
    found, right = labs.numbers(pose_jacobian(), (8, 6)), _right_jacobian()
    if not np.allclose(found[:, :3], right[:, :3], atol=1e-3):
        return "the part of the translation is wrong"
    if not np.allclose(found[:, 3:], right[:, 3:], atol=1e-3):
        return "the rotation has the wrong sign" if np.allclose(found[:, 3:], -right[:, 3:], atol=1e-3) else "the part of the rotation is wrong"


def _bound():
    J = _right_jacobian()
    right = np.linalg.inv(J.T @ J / sigma_px**2)
    found = labs.numbers(bound(J, sigma_px), (6, 6))
    ratio = np.trace(found) / np.trace(right)
    if not np.allclose(found, right, rtol=1e-6):
        return f"its trace is {ratio:.3g} times what it should be"


def _errors():
    P, errors = None, []
    clean = lens.project(cam_corners)
    for _ in range(400):
        seen = samples.TagDetection(tag=0, corners_px=clean + _random.normal(scale=sigma_px, size=(4, 2)))
        best = pose.estimate_tag_pose(seen, size_m, lens, corner_sigma_px=sigma_px).best
        errors.append((best.cam_T_tag @ cam_T_tag.inverse()).log())
    return np.array(errors), np.linalg.inv(_right_jacobian().T @ _right_jacobian() / sigma_px**2)


_E, _P = _errors()


def _nees():
    right = np.einsum("ni,ij,nj->n", _E, np.linalg.inv(_P), _E).mean()
    found = labs.number(mean_nees(_E, _P))
    if not np.isclose(found, right, rtol=1e-6):
        return f"it says {found:.3g}; a consistent covariance of 6 numbers gives about 6"


def _inside():
    nees = np.einsum("ni,ij,nj->n", _E, np.linalg.inv(_P), _E)
    found = labs.number(share_inside(_E, _P))
    if not np.isclose(found, (nees <= 12.592).mean(), atol=1e-6):
        return f"it says {found:.3f}; a consistent covariance gives about 0.95"


lab.check("derivative of a pixel", 2, _pixel)
lab.check("derivative of the corners", 3, _pose)
lab.check("bound", 2, _bound)
lab.check("mean NEES", 2, _nees)
lab.check("share inside", 1, _inside)
lab.finish()
