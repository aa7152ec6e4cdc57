"""The checks of lab 4, PnP and its two solutions. Do the lab before reading them."""
import numpy as np

from .. import geometry, pose, samples
from . import instance, number, numbers

VIEW = geometry.SE3(geometry.SO3.from_rpy(0.1, 0.5, -0.2), [0.2, -0.1, 1.2])


def seen_px(mine, cam_T_tag=VIEW):
    return samples.visible_corners(mine.lens, cam_T_tag, mine.size_m)


def solved(mine, random, poses, sigma_px):
    """(true pose, both solutions) of the tags that have two, with noise on their corners."""
    for T in poses:
        noisy = seen_px(mine, T) + random.normal(scale=sigma_px, size=(4, 2))
        both = pose.estimate_tag_pose(samples.TagDetection(tag=0, corners_px=noisy), mine.size_m, mine.lens, corner_sigma_px=sigma_px)
        if both.other is not None:
            yield T, both.best.cam_T_tag, both.other.cam_T_tag


def upright(yaw, *position):
    return geometry.SE3(geometry.SO3.from_rpy(0, yaw, 0), position)


def walls(mine, count):
    """Upright tags on walls, small and far."""
    random = np.random.default_rng(4)
    turns = (random.choice([-1, 1]) * random.uniform(0.25, 0.5) for _ in range(count))
    return solved(mine, random, (upright(turn, random.uniform(-0.5, 0.5), random.uniform(0.9, 1.1), 3.2) for turn in turns), 0.3)


def near_walls(mine, count):
    """Upright tags near, above and below the camera, rotated further to either side: they may face the camera less than their other solutions."""
    random = np.random.default_rng(44)
    heights = (random.choice([-1, 1]) * random.uniform(0.25, 0.5) for _ in range(count))
    poses = (upright(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), height, random.uniform(1.5, 2.5)) for height in heights)
    return solved(mine, random, poses, 0.05)


def without_pixels(found):
    """Whether it contains NaN, which lens.project may return."""
    return isinstance(found, np.ndarray) and found.shape == (4, 2) and found.dtype.kind == "f" and np.isnan(found).any()


def corners(mine):
    found, right = mine.corners(VIEW), seen_px(mine)
    if without_pixels(found):
        return "the result contains NaN, which lens.project returns for points that are not in front of the camera: in which frame are its arguments?"
    found = numbers(found, (4, 2))
    if np.allclose(found, right, atol=1e-9):
        return None
    if np.allclose(np.sort(found, axis=0), np.sort(right, axis=0), atol=1e-9):
        return "the corners are correct, but in a different order"
    sides = [np.linalg.norm(np.roll(c, 1, axis=0) - c, axis=1).sum() for c in (found, right)]
    return "the corners are at other positions" + (": is the square as large as the tag?" if not np.isclose(*sides, rtol=0.2) else ": where is the tag's centre, and where do its axes point?")


def rms(mine):
    if without_pixels(mine.corners(VIEW)):
        return "corners() returns NaN: fix it first"
    seen = seen_px(mine)
    for shift in ([1, 0], [3, 4]):
        if not np.isclose(number(mine.rms(VIEW, seen + shift)), np.hypot(*shift), atol=1e-9):
            return f"wrong if all corners are displaced equally, by {shift}: how long is this displacement?"
    seen[0] += [2, 0]
    if not np.isclose(number(mine.rms(VIEW, seen)), 1.0, atol=1e-9):
        return "correct if all corners are displaced equally, but wrong if only one is: what is averaged?"


def mirror(mine):
    compared = 0
    for _, a, b in walls(mine, 20):
        n, v = a.rotation.matrix()[:, 2], a.translation / np.linalg.norm(a.translation)
        found = numbers(mine.other_normal(n.copy(), a.translation.copy()), (3,))
        if np.isclose(found @ v, 0, atol=1e-6):
            return "the component along the line of sight is zero: what does mirroring do to it?"
        if not np.isclose(np.linalg.norm(found), 1, atol=1e-6):
            return "the normal is not a unit vector: is the line of sight one?"
        if np.isclose(found @ v, -(n @ v)):
            return "the component along the line of sight changed its sign: the tag would face away"
        if np.allclose(found, n * [-1, -1, 1], atol=1e-6):
            return "it is mirrored about the optical axis, but the tag is off that axis: in which direction is the tag?"
        angle = np.degrees(np.arccos(np.clip(found @ b.rotation.matrix()[:, 2], -1, 1)))
        if angle > 12:
            return f"{angle:.0f} degrees from the second solution"
        compared += 1
    return None if compared > 5 else "no second solutions: ask your teacher"


def choices(mine, pairs):
    """(n, 3): is the tag above the camera, is the second solution the right one, number of wrong choices in the two orders of each pair."""
    found = []
    for T, *pair in pairs:
        right = int(np.argmin([np.linalg.norm((p.rotation.inverse() @ T.rotation).log()) for p in pair]))
        wrong = sum(instance(mine.choose(pair[first], pair[second]), geometry.SE3) != pair[right] for first, second in ((0, 1), (1, 0)))
        found.append((T.translation[1] < 0, right, wrong))
    return np.array(found, int).reshape(-1, 3)


def choose(mine):
    far = choices(mine, walls(mine, 60))
    _, misled, wrong = far.sum(axis=0)
    if misled == 0:
        return "the error is never misleading: ask your teacher"
    if wrong > 4:
        return (f"wrong in {wrong} of {2 * len(far)} choices, with each pair in both orders; "
                f"the smaller error alone is wrong for {misled} of {len(far)} pairs")
    near = choices(mine, near_walls(mine, 60))
    above, below = (near[near[:, 0] == side, 2] for side in (1, 0))
    if not near[:, 2].any():
        return None
    if above.all() and not below.any():
        return "correct for tags below the camera, but wrong for tags above it"
    return (f"correct for low tags far away, but wrong in {near[:, 2].sum()} of {2 * len(near)} choices for near ones at various heights and angles: "
            "is the chosen tag upright?")


CHECKS = [("corners", 2, corners), ("reprojection error", 2, rms), ("the other pose", 3, mirror), ("the choice", 3, choose)]
