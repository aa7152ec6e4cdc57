# %% [markdown]
# # Lab 9: EKF and right-invariant EKF
# An overconfident filter is worse than one with a large covariance. The extended Kalman filter linearises at its estimate, and with a large heading
# error its covariance shrinks in directions without information. The right-invariant filter measures its error on the group. Its derivative of an
# observation does not depend on the estimate (Barrau and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer", IEEE TAC 62, 2017).
# You write the parts that differ. Both filters start with a heading error of 30 degrees (one standard deviation), drive 5 m without observations, and then observe landmarks. 60 minutes.

# %%
import numpy as np

from waymark import geometry, labs

landmarks = np.array([[3.0, 1.0], [-2.0, 4.0], [1.0, -3.0]])  # positions in the map [m]
Q = np.diag([0.01, 0.01, 0.01]) ** 2  # noise of a step, in the robot's frame: x, y [m], heading [rad]
sigma_m = 0.3  # noise of a landmark observation, in the robot's frame, on each coordinate
start_deg = 30.0  # standard deviation of the heading at the beginning

# A robot at map_T_base = (R, p) observes a landmark m at y = R^T (m - p) + noise, in its own frame (forward, left).

# %% [markdown]
# ## 1. The EKF's prediction
# The estimate is (x, y, heading), its error the plain difference. A step `u` = (forward, left, turned) moves (x, y) by R (forward, left) and adds `turned` to the
# heading; R is the rotation by the heading before the step. Return the derivative of the new state with respect to the old one.
# <details><summary>Hint</summary>A small heading error moves the end of the step sideways.</details>

# %%
def step_jacobian(heading, u):
    """number [rad], (3,) -> (3, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## 2. The EKF's observation
# The derivative of y = R^T (m - p) with respect to (x, y, heading).

# %%
def seen_jacobian(state, m):
    """(3,), (2,) -> (2, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## 3. The right-invariant error
# Now the error is xi with map_T_base_estimated = exp(xi) map_T_base_true. The innovation is the displacement of the landmark in the map according to the estimate: z =
# R y + p - m, with estimated R and p. To first order z = H xi + noise. Return H for xi = (x, y, turned): exp(xi) moves a point m by (x, y) + turned · (-m_y, m_x).
#
# **Question:** where does H depend on the estimate?

# %%
def invariant_jacobian(m):
    """(2,) -> (2, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## 4. The noise of a step
# The noise of a step acts in the robot's frame: the true step is u exp(w). Expressed as xi it is Ad w, with exp(Ad w) X = X exp(w). Write Ad of (x, y, heading).
# <details><summary>Hint</summary>R rotates the translation; a rotation about the robot moves the map's origin by (y, -x).</details>

# %%
def adjoint(state):
    """(3,) -> (3, 3)"""
    raise NotImplementedError

# %% [markdown]
# ## 5. Is it consistent?
# The fraction of runs whose normalised error squared e^T P^-1 e is below `limit`. For a consistent filter with three coordinates 95 % are below 7.815.

# %%
def share_below(errors, covariances, limit):
    """(n, 3), (n, 3, 3), number -> number from 0 to 1"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
lab = labs.check(9, globals())

# %% [markdown]
# ## Figure
# **Questions:** before the first observation both have the same estimate: why is only one consistent? Why is the
# invariant filter overconfident after the first observation? What are the results with 3 degrees instead of 30, and why is an EKF sufficient for most robots? (Set
# `start_deg = 3.0` in a new cell, and call `loops.run_filters(lab.answers, 16)` of `from waymark.labs import loops` there: the fractions of both after 16 observations.)
# %%
if lab.points == 10:
    _shares = lab.answers.shares
    labs.figure("runs within their 95 %", "observations", "fraction", EKF=[(n, s[0]) for n, s in _shares.items()], right_invariant=[(n, s[1]) for n, s in _shares.items()])
