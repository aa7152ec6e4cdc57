# %% [markdown]
# # Lab 4: PnP and its two solutions
# Four corners of a square give its pose, but seen nearly without perspective two poses fit almost equally well, and noise decides which fits better
# (Collins and Bartoli, "Infinitesimal Plane-Based Pose Estimation", IJCV 109, 2014). You see it happen and choose. 50 minutes.

# %%
import numpy as np

from waymark import camera, geometry, labs, pose, samples

lab = labs.Lab("Lab 4")
lens = camera.pinhole(640, 480, 500, 500, 320, 240)
size_m = 0.16  # tag frame: centre, x right, y down, z into the tag

# %% [markdown]
# ## 1. Corners in the picture
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
    raise NotImplementedError

# %% [markdown]
# ## 3. The other pose
# To first order the second solution has the tag's normal mirrored about the line of sight. Write it.
# <details><summary>Hint</summary>Mirror n about the unit vector v: keep the part along v, turn round the rest.</details>
#
# **Question:** at which position of the tag do both solutions agree?

# %%
def other_normal(normal, position):
    """the tag's unit normal (3,) and its centre (3,) in the camera frame -> unit normal of the other solution (3,)"""
    raise NotImplementedError

# %% [markdown]
# ## 4. Choose
# The camera is level (its y axis points down), and the tag hangs on a wall. Choose between the two poses by that, not by the error.

# %%
def choose(best, other):
    """two geometry.SE3 -> the one whose tag hangs upright on a wall"""
    raise NotImplementedError

# %% [markdown]
# ## Check
# %%
_random = np.random.default_rng(4)
_view = geometry.SE3(geometry.SO3.from_rpy(0.1, 0.5, -0.2), [0.2, -0.1, 1.2])


def _truth_px(T):
    return samples.visible_corners(lens, T, size_m)


def _wall():
    """A tag on a wall, upright, small and far: ambiguous."""
    turn = _random.choice([-1, 1]) * _random.uniform(0.25, 0.5)
    return geometry.SE3(geometry.SO3.from_rpy(0, turn, 0), [_random.uniform(-0.5, 0.5), _random.uniform(0.9, 1.1), 3.2])


def _corners():
    found, right = labs.numbers(corners(_view), (4, 2)), _truth_px(_view)
    if not np.allclose(found, right, atol=1e-9):
        if np.allclose(np.sort(found, axis=0), np.sort(right, axis=0), atol=1e-9):
            return "the right corners in another order"
        return "the corners lie elsewhere: half a side on each side of the centre?"


def _rms():
    seen = _truth_px(_view)
    for shift in ([1, 0], [3, 4]):
        found = labs.number(rms(_view, seen + shift))
        if not np.isclose(found, np.hypot(*shift), atol=1e-9):
            return f"all corners are {np.hypot(*shift)} px off, and it says {found:.3f}"
    one = seen.copy()
    one[0] += [2, 0]
    if not np.isclose(labs.number(rms(_view, one)), 1.0, atol=1e-9):
        return "one corner 2 px off is an rms of 1 px"


def _both(T):
    noisy = _truth_px(T) + _random.normal(scale=0.3, size=(4, 2))
    return pose.estimate_tag_pose(samples.TagDetection(tag=0, corners_px=noisy), size_m, lens, corner_sigma_px=0.3)


def _mirror():
    compared = 0
    for _ in range(20):
        both = _both(_wall())
        if both.other is None:
            continue
        a, b = both.best.cam_T_tag, both.other.cam_T_tag
        found = labs.numbers(other_normal(a.rotation.matrix()[:, 2], a.translation), (3,))
        if not np.isclose(np.linalg.norm(found), 1, atol=1e-6):
            return "the normal has not length 1"
        angle = np.degrees(np.arccos(np.clip(found @ b.rotation.matrix()[:, 2], -1, 1)))
        if angle > 12:
            return f"{angle:.0f} degrees from the second solution"
        compared += 1
    return None if compared > 5 else "no second solutions: ask your teacher"


def _choose():
    wrong = misled = 0
    for _ in range(60):
        T = _wall()
        both = _both(T)
        if both.other is None:
            continue
        pair = [both.best.cam_T_tag, both.other.cam_T_tag]
        right = int(np.argmin([np.linalg.norm((p.rotation.inverse() @ T.rotation).log()) for p in pair]))
        misled += right == 1
        for first, second in ((0, 1), (1, 0)):
            wrong += labs.instance(choose(pair[first], pair[second]), geometry.SE3) != pair[right]
    if misled == 0:
        return "the error was never misleading: ask your teacher"
    if wrong > 4:
        return f"wrong in {wrong} of 120 choices; the smaller error alone is wrong in {misled} of 60"


lab.check("corners", 2, _corners)
lab.check("reprojection error", 2, _rms)
lab.check("the other pose", 3, _mirror)
lab.check("the choice", 3, _choose)
lab.finish()
