# %% [markdown]
# # Lab 1: frames and SE(3)
# A pose is a rotation and a translation. `a_T_b` takes coordinates of frame `b` to frame `a`: `a_p = a_T_b b_p`. Read the subscripts as dominoes:
# in `map_T_base base_T_cam` the inner two match. 40 minutes. You write three functions with NumPy alone; `waymark.geometry` checks them.

# %%
import numpy as np

from waymark import geometry, labs

lab = labs.Lab("Lab 1")

# %% [markdown]
# ## 1. The inverse
# A homogeneous matrix is `[[R, t], [0, 1]]`. Write its inverse with `R.T`, without `np.linalg.inv`.
#
# <details><summary>Hint</summary>Solve a = R b + t for b. The translation of the inverse is not -t.</details>

# %%
def inverse(T):
    """(4, 4) -> (4, 4)"""
    raise NotImplementedError

# %% [markdown]
# ## 2. Where is the tag?
# The robot knows `map_T_base`, the camera sits at `base_T_cam`, and the picture gave `cam_T_tag`. Where is the tag in the map?
#
# <details><summary>Hint</summary>Write the names in a row so that neighbours match.</details>

# %%
def tag_in_map(map_T_base, base_T_cam, cam_T_tag):
    """Three (4, 4) -> map_T_tag (4, 4)"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The exponential of a rotation
# Write Rodrigues' formula: the rotation matrix of the rotation vector `w` (axis times angle [rad]). It must be right for tiny angles too.
#
# **Question:** which function of the angle has 0 / 0 at zero, and what is its limit?
#
# <details><summary>Hint</summary>R = I + sin(a)/a W + (1 - cos(a))/a² W W, W the matrix of the cross product with w. For small a use the series.</details>

# %%
def rotation(w):
    """(3,) -> (3, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(1)


def _pose():
    return geometry.SE3.exp(np.concatenate([_random.normal(size=3), _random.normal(scale=0.8, size=3)])).matrix()


def _inverse():
    for _ in range(5):
        T = _pose()
        I = labs.numbers(inverse(T), (4, 4))
        if not np.allclose(I[:3, :3] @ T[:3, :3], np.eye(3), atol=1e-9):
            return "the rotation part is no inverse"
        if not np.allclose(I @ T, np.eye(4), atol=1e-9):
            return "rotation right, translation wrong: put a point through T and back"


def _chain():
    a, b, c = _pose(), _pose(), _pose()
    found, right = labs.numbers(tag_in_map(a, b, c), (4, 4)), a @ b @ c
    if np.allclose(found, right, atol=1e-9):
        return None
    if np.allclose(found, c @ b @ a, atol=1e-9):
        return "the order is turned round: look at which names are neighbours"
    return "the subscripts do not match somewhere"


def _rotation():
    for scale in (1.0, 3.0, 1e-3):
        w = _random.normal(size=3)
        w *= scale / np.linalg.norm(w)
        R = labs.numbers(rotation(w), (3, 3))
        if not np.allclose(R, geometry.SO3.exp(w).matrix(), atol=1e-8):
            return "it turns the other way" if np.allclose(R, geometry.SO3.exp(-w).matrix(), atol=1e-8) else f"wrong at an angle of {scale} rad"


def _tiny():
    for angle in (0.0, 1e-9, 1e-200):
        w = np.array([angle, 0, 0])
        with np.errstate(all="ignore"):
            R = rotation(w)
        if isinstance(R, np.ndarray) and R.dtype.kind == "f" and not np.isfinite(R).all():
            return f"not a number at an angle of {angle} rad"
        R = labs.numbers(R, (3, 3))
        if abs(R[2, 1] - angle) > 1e-15:
            return f"at an angle of {angle} rad the small part is lost"


lab.check("inverse", 3, _inverse)
lab.check("tag in the map", 3, _chain)
lab.check("rotation", 2, _rotation)
lab.check("rotation by tiny angles", 2, _tiny)
lab.finish()
