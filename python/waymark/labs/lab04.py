"""The checks of lab 4, PnP and its two solutions. Do the lab before you read them."""
import numpy as np

from .. import geometry, pose, samples
from . import instance, number, numbers

VIEW = geometry.SE3(geometry.SO3.from_rpy(0.1, 0.5, -0.2), [0.2, -0.1, 1.2])


def seen_px(mine, cam_T_tag=VIEW):
    return samples.visible_corners(mine.lens, cam_T_tag, mine.size_m)


def walls(mine, count):
    """(true pose, both solutions) of upright tags on walls, small and far, where there are two solutions."""
    random = np.random.default_rng(4)
    for _ in range(count):
        turn = random.choice([-1, 1]) * random.uniform(0.25, 0.5)
        T = geometry.SE3(geometry.SO3.from_rpy(0, turn, 0), [random.uniform(-0.5, 0.5), random.uniform(0.9, 1.1), 3.2])
        noisy = seen_px(mine, T) + random.normal(scale=0.3, size=(4, 2))
        both = pose.estimate_tag_pose(samples.TagDetection(tag=0, corners_px=noisy), mine.size_m, mine.lens, corner_sigma_px=0.3)
        if both.other is not None:
            yield T, both.best.cam_T_tag, both.other.cam_T_tag


def corners(mine):
    found, right = numbers(mine.corners(VIEW), (4, 2)), seen_px(mine)
    if np.allclose(found, right, atol=1e-9):
        return None
    if np.allclose(np.sort(found, axis=0), np.sort(right, axis=0), atol=1e-9):
        return "the right corners in another order"
    sides = [np.linalg.norm(np.roll(c, 1, axis=0) - c, axis=1).sum() for c in (found, right)]
    return "the corners lie elsewhere" + (": is the square as large as the tag?" if not np.isclose(*sides, rtol=0.2) else ": where is the tag's centre, and where do its axes point?")


def rms(mine):
    seen = seen_px(mine)
    for shift in ([1, 0], [3, 4]):
        if not np.isclose(number(mine.rms(VIEW, seen + shift)), np.hypot(*shift), atol=1e-9):
            return f"wrong where all corners are off alike, by {shift}: how long is that?"
    seen[0] += [2, 0]
    if not np.isclose(number(mine.rms(VIEW, seen)), 1.0, atol=1e-9):
        return "right where all corners are off alike, wrong where a single one is off: what is averaged?"


def mirror(mine):
    compared = 0
    for _, a, b in walls(mine, 20):
        n, v = a.rotation.matrix()[:, 2], a.translation / np.linalg.norm(a.translation)
        found = numbers(mine.other_normal(n.copy(), a.translation.copy()), (3,))
        if not np.isclose(np.linalg.norm(found), 1, atol=1e-6):
            return "the normal is no unit vector: is the line of sight one?"
        if np.isclose(found @ v, -(n @ v)):
            return "the part along the line of sight changed its sign: the tag would show its back"
        angle = np.degrees(np.arccos(np.clip(found @ b.rotation.matrix()[:, 2], -1, 1)))
        if angle > 12:
            return f"{angle:.0f} degrees from the second solution"
        compared += 1
    return None if compared > 5 else "no second solutions: ask your teacher"


def choose(mine):
    wrong = misled = asked = 0
    for T, best, other in walls(mine, 60):
        pair = [best, other]
        right = int(np.argmin([np.linalg.norm((p.rotation.inverse() @ T.rotation).log()) for p in pair]))
        misled, asked = misled + right, asked + 2
        for first, second in ((0, 1), (1, 0)):
            wrong += instance(mine.choose(pair[first], pair[second]), geometry.SE3) != pair[right]
    if misled == 0:
        return "the error was never misleading: ask your teacher"
    if wrong > 4:
        return f"wrong in {wrong} of {asked} choices, of which each pair is asked in both orders; the smaller error alone is wrong for {misled} of {asked // 2} pairs"


CHECKS = [("corners", 2, corners), ("reprojection error", 2, rms), ("the other pose", 3, mirror), ("the choice", 3, choose)]
