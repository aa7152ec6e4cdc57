"""The checks of lab 7, odometry and calibration. Do the lab before reading them."""
import numpy as np

from .. import geometry
from . import instance, number, several


def arc(left_m, right_m, track_m):
    return geometry.SE2.exp([(left_m + right_m) / 2, 0, (right_m - left_m) / track_m])


def driven(wheels, radius_m, track_m):
    poses = [geometry.SE2()]
    for left, right in np.diff(wheels, axis=0) * radius_m:
        poses.append(poses[-1] @ arc(left, right, track_m))
    return poses


def seconds(poses):
    """The motion of each second, from poses at 50 Hz."""
    return [a.inverse() @ b for a, b in zip(poses[:-50:50], poses[50::50])]


def close(a, b):
    return np.allclose((a.inverse() @ b).log(), 0, atol=1e-9)


def step(mine):
    for left, right in ((0.1, 0.1), (0.1, 0.14), (-0.2, 0.25), (1.0, 2.0)):
        found, true = instance(mine.step(left, right, 0.4), geometry.SE2), arc(left, right, 0.4)
        if close(found, true):
            continue
        if not np.isclose(found.yaw, true.yaw):
            if np.isclose(found.yaw, -true.yaw):
                return "it turns in the wrong direction"
            return f"wheels at {left} and {right} m turn a robot {'less' if abs(found.yaw) > abs(true.yaw) else 'more'} than it returns"
        if np.isclose(np.hypot(found.x, found.y), (left + right) / 2):
            return f"for {left} and {right} m, it drives straight ahead and turns afterwards, but a robot does both simultaneously"
        return f"the turn is correct, but the end position is wrong for {left} and {right} m"


def trajectory(mine):
    wheels = np.cumsum(np.random.default_rng(7).uniform(-0.2, 1.0, (60, 2)), axis=0)
    found, right = mine.trajectory(wheels.copy(), 0.05, 0.2), driven(wheels, 0.05, 0.2)
    if not isinstance(found, list) or len(found) != len(right):
        return f"the result must be a list with one pose for each of the {len(wheels)} samples"
    for n, (a, b) in enumerate(zip(found, right)):
        if close(instance(a, geometry.SE2), b):
            continue
        if n == 0:
            return "the first pose is the identity"
        return f"pose {n} is wrong: " + ("how far did the wheels roll since the previous pose, and is step() right?" if n == 1 else "in whose frame is a step?")


def gyro_bias(mine):
    random = np.random.default_rng(7)
    moving = np.repeat([0, 1, 0, 1, 0], 40)[:, None] * np.array([0.1, 0.12])
    still = np.append(False, (np.diff(np.cumsum(moving, axis=0), axis=0) == 0).all(axis=1))
    for bias in random.uniform(0.01, 0.05, 2) * [1, -1]:
        rates = bias + 3 * moving[:, 0] + random.normal(scale=0.001, size=len(moving))
        found = number(mine.gyro_bias(np.cumsum(moving, axis=0), rates.copy()))
        if not np.isclose(found, rates[still].mean(), atol=1e-4):
            return "samples in which the robot drives are averaged too" if np.isclose(found, rates.mean(), atol=2e-3) else \
                f"it returns {found:.4f} for a robot that drives, stops and drives again"
        spinning = np.cumsum(np.repeat([[0, 0], [-0.1, 0.1], [0, 0.1]], 40, axis=0), axis=0)
        if not np.isclose(number(mine.gyro_bias(spinning, bias + np.repeat([0, 1.0, 0.5], 40))), bias, atol=1e-9):
            return "a robot that turns about a wheel is not at rest"


def scales(mine):
    for name, (wheels, _, truth) in mine.laps.items():
        measured, true = seconds(driven(wheels, mine.robot.wheel_radius_m, mine.robot.track_m)), seconds(truth)
        found = [number(s) for s in several(mine.scales(measured, true), 2)]
        for which, part, s in zip(("distances", "turns"), (0, 2), found):
            m, t = (np.array([motion.log()[part] for motion in motions]) for motions in (measured, true))
            if abs(m @ (t - s * m)) < 1e-6 * (m @ m):  # the derivative of the sum of squares
                continue
            if abs(m @ (t - m / s)) < 0.02 * (m @ m):
                return f"the scale of the {which} is inverted"
            return f"{name}.mcap: with the scale {s:.4f} of the {which} the sum of squares is not minimal"


CHECKS = [("one step", 2, step), ("the trajectory", 2, trajectory), ("bias of the gyro", 2, gyro_bias), ("scales", 4, scales)]
