"""The checks of lab 8, the nearest tag against a Kalman filter. Do the lab before reading them."""
import numpy as np

from .. import geometry
from . import instance, numbers, several, truth


def wrapped(angle):
    return np.remainder(angle + np.pi, 2 * np.pi) - np.pi


def distance(a, b):
    return np.hypot(a.x - b.x, a.y - b.y)


def nearest(mine):
    random = np.random.default_rng(8)
    for n in (1, 2, 5, 9, 9, 9):
        seen = [(f"tag36h11:{k}", geometry.SE3(geometry.SO3.from_rpy(*random.normal(size=3)), random.uniform(-1, 1, 3) + [0, 0, 2])) for k in range(n)]
        if several(mine.nearest(seen), 2)[0] != min(seen, key=lambda s: np.linalg.norm(s[1].translation))[0]:
            return "there is a nearer one: what is the distance of a tag that is not straight ahead?"
    if mine.nearest([]) is not None:
        return "wrong for an empty list: what is the result without observations?"


def fix(mine):
    random = np.random.default_rng(9)
    mounting = mine.robot.base_T_cam
    for name in list(mine.tag_map)[:6]:
        there = geometry.SE2(*random.uniform(-1, 1, 3))
        cam_T_tag = (there.lift() @ mounting).inverse() @ mine.tag_map[name].map_T_tag
        found = instance(mine.fix(name, cam_T_tag), geometry.SE2)
        if distance(found, there) > 1e-6:
            camera = abs(distance(found, there) - np.linalg.norm(mounting.translation[:2])) < 1e-6
            return "that is the pose of the camera, not of the robot" if camera else f"{distance(found, there):.2f} m from the true position: write the frames in a row"
        if abs(wrapped(found.yaw - there.yaw)) > 1e-6:
            return f"the position is correct, but the heading is wrong by {np.degrees(abs(wrapped(found.yaw - there.yaw))):.0f} degrees"


def carried(mine):
    random = np.random.default_rng(10)
    for _ in range(5):
        fixed, then, moved = (geometry.SE2(*random.uniform(-2, 2, 3)) for _ in range(3))
        found = instance(mine.carried(fixed, then, then @ moved), geometry.SE2)
        if not np.allclose((fixed.inverse() @ found).log(), moved.log(), atol=1e-9):
            return "the robot moved differently: first compute its motion since then, in its own frame; then apply it to the fix"


def accepted(mine):
    far, jump = mine.FAR_M, mine.JUMP_M
    for distance_m, jump_m in ((far / 6, jump / 4), (far - 0.1, 5.0), (far + 0.1, jump - 0.1), (far + 0.1, jump + 0.1), (3 * far, jump + 0.01), (3 * far, 0.0)):
        if truth(mine.accepted(distance_m, jump_m)) != (distance_m < far or jump_m < jump):
            return f"a wrong decision about a tag {distance_m:.1f} m away that makes the robot jump by {jump_m:.2f} m"


def update(mine):
    P, R = np.diag([0.04, 0.01, 0.02]), np.diag([0.01, 0.03, 0.02])
    P[0, 1] = P[1, 0] = 0.01
    information = np.linalg.inv(P) + np.linalg.inv(R)
    for x, z in (([1, 2, 0.1], [1.2, 1.9, 0.2]), ([0, 0, 3.1], [0, 0, -3.1])):
        x, z = np.array(x, float), np.array(z, float)
        found, left = several(mine.update(x.copy(), P.copy(), z.copy(), R.copy()), 2)
        found, left = numbers(found, (3,)), numbers(left, (3, 3))
        apart = z - x
        apart[2] = wrapped(apart[2])
        off = found - x - np.linalg.solve(information, np.linalg.solve(R, apart))
        if not np.allclose(off[:2], 0, atol=1e-9):
            return "the position moves in the wrong direction, or too far: which of the two should a small R favour?"
        if abs(wrapped(off[2])) > 1e-9:
            return "headings of 3.1 and -3.1 rad are neighbours"
        if abs(found[2]) > np.pi + 1e-9:
            return f"a heading of {found[2]:.2f} rad: wrap it"
        if not np.allclose(left @ information, np.eye(3), atol=1e-9):
            return "the covariance after the update is wrong: it combines both, so it is smaller than P and smaller than R"


CHECKS = [("the nearest tag", 1, nearest), ("where the robot is", 3, fix), ("between images", 2, carried), ("which fix to accept", 1, accepted),
          ("the weights", 3, update)]
