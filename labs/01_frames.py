# %% [markdown]
# # Lab 1: frames and SE(3)
# A pose is a rotation and a translation. `a_T_b` transforms coordinates of frame `b` to frame `a`: `a_p = a_T_b b_p`. Neighbouring subscripts must match:
# in `map_T_base base_T_cam` the inner two are equal. 40 minutes. You write three functions with NumPy alone; `waymark.geometry` checks them.

# %%
import numpy as np

from waymark import geometry, labs

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
# Given are `map_T_base`, the camera mounting `base_T_cam`, and `cam_T_tag` from the image. Where is the tag in the map?
#
# <details><summary>Hint</summary>Write the names in a row so that neighbours match.</details>

# %%
def tag_in_map(map_T_base, base_T_cam, cam_T_tag):
    """Three (4, 4) -> map_T_tag (4, 4)"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The exponential of a rotation
# Write Rodrigues' formula: the rotation matrix of the rotation vector `w` (axis times angle [rad]). It must be accurate for tiny angles too.
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
lab = labs.check(1, globals())
